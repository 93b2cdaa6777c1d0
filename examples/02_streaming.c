/* SPDX-License-Identifier: MIT
 *
 * 02  Chunks for a renderer while frames come in: after each frame only what changed is meshed, at most so
 * many chunks a frame, and uploaded under its key. Here the graphics card is a table.
 *
 *     cc 02_streaming.c $(pkg-config --cflags --libs burin) -lm && ./a.out
 */
#include <burin/burin.h>
#include <stdio.h>
#include <stdlib.h>

#include "room.h"

#define MAX_KEYS 20000
#define CHUNKS_PER_FRAME 400 /* what a renderer takes in one frame; the rest stays dirty and comes later */

typedef struct drawn_chunk {
    burin_chunk_key key;
    uint64_t triangles;
} drawn_chunk;

static drawn_chunk drawn[MAX_KEYS];
static size_t drawn_count = 0;
static burin_chunk_key keys[MAX_KEYS];

/* The place of a buffer on the graphics card. */
static void upload(burin_chunk_key key, const burin_mesh_buffers* mesh) {
    size_t i;
    for (i = 0; i < drawn_count; ++i)
        if (drawn[i].key.x == key.x && drawn[i].key.y == key.y && drawn[i].key.z == key.z) break;
    if (i == drawn_count) {
        if (drawn_count == MAX_KEYS) return;
        drawn[drawn_count++].key = key;
    }
    drawn[i].triangles = mesh->triangle_count;
}

/* Meshes up to `most` dirty chunks; how many there were, or -1. */
static long stream(burin_map map, burin_mesh_buffers* mesh, uint64_t most) {
    uint64_t count = 0, i;
    if (burin_dirty_chunks(map, keys, MAX_KEYS, &count) != BURIN_OK) return -1;
    for (i = 0; i < count && i < most; ++i) {
        if (burin_chunk_mesh(map, keys[i], NULL, mesh) != BURIN_OK) return -1;
        upload(keys[i], mesh);
    }
    return (long)count;
}

int main(void) {
    /* The sizes that burin_chunk_mesh may need; one set of buffers serves all chunks. */
    static float positions[3 * 1944], normals[3 * 1944];
    static uint8_t colours[3 * 1944];
    static uint32_t triangles[3 * 2560];
    const burin_config config = room_config(64u << 20);
    burin_mesh_buffers mesh;
    burin_map map = {0, 0};
    uint64_t bytes = 0, sum = 0, vertices = 0, whole = 0;
    void* raw;
    void* memory;
    size_t i;
    int k, failed;

    memset(&mesh, 0, sizeof mesh);
    mesh.vertex_capacity = 1944;
    mesh.triangle_capacity = 2560;
    mesh.positions = positions;
    mesh.normals = normals;
    mesh.colours = colours;
    mesh.triangles = triangles;

    failed = burin_bytes(&config, &bytes) != BURIN_OK;
    memory = failed ? NULL : room_memory(bytes, &raw);
    if (!memory || burin_create(&config, memory, bytes, &map) != BURIN_OK) {
        fprintf(stderr, "no map: %s\n", burin_last_error(map));
        return 1;
    }
    for (k = 0; k < ROOM_FRAMES && !failed; ++k) {
        const burin_frame frame = room_frame(k);
        burin_frame_result result;
        long dirty;
        failed = burin_integrate(map, &frame, &result) != BURIN_OK;
        dirty = failed ? -1 : stream(map, &mesh, CHUNKS_PER_FRAME);
        failed = dirty < 0;
        if (k % 8 == 0)
            printf("frame %2d: %u chunks fused, %ld to draw anew\n", k, (unsigned)result.chunks_fused, dirty);
    }
    /* The camera rests: what is still dirty follows. */
    failed = failed || stream(map, &mesh, MAX_KEYS) < 0;
    failed = failed || burin_mesh_size(map, NULL, &vertices, &whole) != BURIN_OK;
    if (failed) fprintf(stderr, "failed: %s\n", burin_last_error(map));

    for (i = 0; i < drawn_count; ++i) sum += drawn[i].triangles;
    printf("%lu chunks drawn with %lu triangles; the mesh of the whole map has %lu\n",
           (unsigned long)drawn_count, (unsigned long)sum, (unsigned long)whole);
    burin_destroy(&map);
    free(raw);
    return !failed && sum > 0 && sum == whole ? 0 : 1;
}
