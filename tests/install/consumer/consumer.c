/* SPDX-License-Identifier: MIT
 * A C99 program that uses Burin as others do: the header, the library, nothing else. */
#include <burin/burin.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Creates a map in memory of our own, reads its statistics and destroys it. */
static int use_a_map(void) {
    burin_config config = burin_config_default();
    burin_statistics statistics;
    burin_map map;
    burin_status status;
    uint64_t bytes = 0;
    void* raw;
    void* memory;

    config.budget_bytes = 16u << 20;
    status = burin_bytes(&config, &bytes);
    if (status != BURIN_OK) {
        fprintf(stderr, "burin_bytes: %s\n", burin_strerror(status));
        return 1;
    }
    raw = malloc((size_t)bytes + 64);
    if (!raw) return 1;
    memory = (void*)(((uintptr_t)raw + 63) & ~(uintptr_t)63); /* burin_create wants 64-byte alignment */
    status = burin_create(&config, memory, bytes, &map);
    if (status == BURIN_OK) status = burin_stats(map, &statistics);
    if (status != BURIN_OK) {
        fprintf(stderr, "burin_create or burin_stats: %s\n", burin_strerror(status));
        free(raw);
        return 1;
    }
    if (statistics.arena_bytes != bytes || statistics.chunks_live != 0) {
        fprintf(stderr, "a new map of %llu bytes says it has %llu and %u chunks\n", (unsigned long long)bytes,
                (unsigned long long)statistics.arena_bytes, statistics.chunks_live);
        free(raw);
        return 1;
    }
    status = burin_destroy(&map);
    free(raw);
    return status == BURIN_OK ? 0 : 1;
}

int main(int argc, char** argv) {
    if (argc != 2 || strcmp(burin_version(), argv[1]) != 0) {
        fprintf(stderr, "version: the library says %s, expected %s\n", burin_version(),
                argc == 2 ? argv[1] : "an argument");
        return 1;
    }
    return use_a_map();
}
