/* SPDX-License-Identifier: MIT
 *
 * 03  A budget, what happens when it is used up, and how to go on with a larger one: a full map is no error,
 * frames are finished with the chunks there are. The map is then saved through a function (here into memory,
 * it could be a socket or flash), and loaded into a larger one.
 *
 *     cc 03_budget.c $(pkg-config --cflags --libs burin) -lm && ./a.out
 */
#include <burin/burin.h>
#include <stdio.h>
#include <stdlib.h>

#include "room.h"

typedef struct tape {
    unsigned char* bytes;
    uint64_t size, capacity, at;
} tape;

static int put(void* user, const void* data, uint64_t bytes) {
    tape* t = user;
    if (bytes > t->capacity - t->size) return 1; /* full: burin_save_to ends with BURIN_IO */
    memcpy(t->bytes + t->size, data, (size_t)bytes);
    t->size += bytes;
    return 0;
}

static int get(void* user, void* data, uint64_t bytes) {
    tape* t = user;
    if (bytes > t->size - t->at) return 1;
    memcpy(data, t->bytes + t->at, (size_t)bytes);
    t->at += bytes;
    return 0;
}

/* A map in memory of its own; free *raw after burin_destroy. */
static burin_map make(uint64_t budget_bytes, void** raw) {
    const burin_config config = room_config(budget_bytes);
    burin_map map = {0, 0};
    uint64_t bytes = 0;
    void* memory;
    *raw = NULL;
    if (burin_bytes(&config, &bytes) != BURIN_OK) return map;
    memory = room_memory(bytes, raw);
    if (memory) burin_create(&config, memory, bytes, &map);
    return map;
}

/* One turn of the camera; the chunks that found no room, or -1. */
static long turn(burin_map map) {
    long dropped = 0;
    int k;
    for (k = 0; k < ROOM_FRAMES; ++k) {
        const burin_frame frame = room_frame(k);
        burin_frame_result result;
        if (burin_integrate(map, &frame, &result) != BURIN_OK) return -1;
        dropped += (long)result.chunks_dropped;
    }
    return dropped;
}

static int report(const char* name, burin_map map, long dropped) {
    burin_statistics s;
    if (dropped < 0 || burin_stats(map, &s) != BURIN_OK) {
        fprintf(stderr, "%s: %s\n", name, burin_last_error(map));
        return 1;
    }
    printf("%s: %.1f MiB, %u of %u chunks, dropped %ld, room %.1f x %.1f x %.1f m\n", name,
           (double)s.arena_bytes / 1048576, (unsigned)s.chunks_live, (unsigned)s.chunks_capacity, dropped,
           s.bounds_max_m[0] - s.bounds_min_m[0], s.bounds_max_m[1] - s.bounds_min_m[1],
           s.bounds_max_m[2] - s.bounds_min_m[2]);
    return 0;
}

int main(void) {
    void *raw_small, *raw_large;
    burin_map small, large, none = {0, 0};
    burin_file_info info;
    burin_config config = room_config(1000);
    uint64_t bytes = 0, hash[2] = {0, 0};
    long dropped;
    int failed = 0;
    tape t;

    /* Far too little: the line says what it takes. */
    if (burin_bytes(&config, &bytes) == BURIN_OK) return 1;
    printf("%s\n", burin_last_error(none));

    small = make(5u << 20, &raw_small);
    dropped = turn(small);
    failed |= report("5 MiB", small, dropped) || dropped == 0;

    memset(&t, 0, sizeof t);
    t.capacity = 8u << 20;
    t.bytes = malloc((size_t)t.capacity);
    failed |=
        !t.bytes || burin_save_to(small, put, &t) != BURIN_OK || burin_hash(small, &hash[0]) != BURIN_OK;
    failed |= burin_probe_from(get, &t, &info) != BURIN_OK;
    t.at = 0;
    if (!failed)
        printf("saved: %lu bytes, %lu chunks; a budget of %lu bytes holds them\n", (unsigned long)t.size,
               (unsigned long)info.chunks, (unsigned long)info.least_budget_bytes);

    large = make(32u << 20, &raw_large);
    failed |= burin_load_from(large, get, &t) != BURIN_OK || burin_hash(large, &hash[1]) != BURIN_OK;
    failed |= hash[0] != hash[1]; /* the very same map */
    dropped = turn(large);        /* once more, and now there is room */
    failed |= report("32 MiB", large, dropped) || dropped != 0;
    if (failed) fprintf(stderr, "failed: %s %s\n", burin_last_error(small), burin_last_error(large));

    burin_destroy(&small);
    burin_destroy(&large);
    free(raw_small);
    free(raw_large);
    free(t.bytes);
    return failed;
}
