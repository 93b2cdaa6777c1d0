/* SPDX-License-Identifier: MIT
 *
 * 01  Depth images in, a coloured mesh out: create a map, fuse frames, ask for sizes, fetch the mesh, write a
 * PLY.
 *
 *     cc 01_first_mesh.c $(pkg-config --cflags --libs burin) -lm && ./a.out first_mesh.ply
 */
#include <burin/burin.h>
#include <stdio.h>
#include <stdlib.h>

#include "room.h"

static int write_ply(const char* path, const burin_mesh_buffers* mesh) {
    FILE* file = fopen(path, "w");
    uint64_t i;
    if (!file) return 0;
    fprintf(
        file,
        "ply\nformat ascii 1.0\nelement vertex %lu\nproperty float x\nproperty float y\nproperty float z\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\n"
        "element face %lu\nproperty list uchar int vertex_indices\nend_header\n",
        (unsigned long)mesh->vertex_count, (unsigned long)mesh->triangle_count);
    for (i = 0; i < mesh->vertex_count; ++i) {
        const float* p = mesh->positions + 3 * i;
        const uint8_t* c = mesh->colours + 3 * i;
        fprintf(file, "%.4f %.4f %.4f %d %d %d\n", p[0], p[1], p[2], c[0], c[1], c[2]);
    }
    for (i = 0; i < mesh->triangle_count; ++i) {
        const uint32_t* t = mesh->triangles + 3 * i;
        fprintf(file, "3 %lu %lu %lu\n", (unsigned long)t[0], (unsigned long)t[1], (unsigned long)t[2]);
    }
    return fclose(file) == 0;
}

static int fail(burin_map map, const char* doing) {
    fprintf(stderr, "%s: %s\n", doing, burin_last_error(map));
    return 1;
}

int main(int argc, char** argv) {
    const char* path = argc > 1 ? argv[1] : "first_mesh.ply";
    const burin_config config = room_config(64u << 20); /* no more than 64 MiB, ever */
    burin_mesh_buffers mesh;
    burin_map map = {0, 0};
    uint64_t bytes = 0, i;
    double sum = 0;
    void* raw;
    void* memory;
    int k;

    /* 1. How many bytes, exactly? Hand them over; from here on the library allocates nothing. */
    if (burin_bytes(&config, &bytes) != BURIN_OK) return fail(map, "burin_bytes");
    memory = room_memory(bytes, &raw);
    if (!memory) return 1;
    if (burin_create(&config, memory, bytes, &map) != BURIN_OK) return fail(map, "burin_create");

    /* 2. Frames with their poses. */
    for (k = 0; k < ROOM_FRAMES; ++k) {
        const burin_frame frame = room_frame(k);
        burin_frame_result result;
        if (burin_integrate(map, &frame, &result) != BURIN_OK) return fail(map, "burin_integrate");
        if (result.flags & BURIN_FLAG_POOL_FULL)
            printf("full: %u chunks dropped\n", (unsigned)result.chunks_dropped);
    }

    /* 3. The mesh, in buffers of our own. */
    memset(&mesh, 0, sizeof mesh);
    if (burin_mesh_size(map, NULL, &mesh.vertex_capacity, &mesh.triangle_capacity) != BURIN_OK)
        return fail(map, "burin_mesh_size");
    mesh.positions = malloc((size_t)mesh.vertex_capacity * 3 * sizeof(float));
    mesh.colours = malloc((size_t)mesh.vertex_capacity * 3);
    mesh.triangles = malloc((size_t)mesh.triangle_capacity * 3 * sizeof(uint32_t));
    if (!mesh.positions || !mesh.colours || !mesh.triangles) return 1;
    if (burin_mesh(map, NULL, &mesh) != BURIN_OK) return fail(map, "burin_mesh");
    if (!write_ply(path, &mesh)) {
        fprintf(stderr, "%s: cannot write\n", path);
        return 1;
    }

    /* 4. How good is it? */
    for (i = 0; i < mesh.vertex_count; ++i) sum += room_distance(mesh.positions + 3 * i);
    printf("%s: %lu vertices, %lu triangles, %.1f mm from the room on average\n", path,
           (unsigned long)mesh.vertex_count, (unsigned long)mesh.triangle_count,
           1000 * sum / (double)mesh.vertex_count);

    free(mesh.positions);
    free(mesh.colours);
    free(mesh.triangles);
    if (burin_destroy(&map) != BURIN_OK) return fail(map, "burin_destroy");
    free(raw); /* only now: the map lived in it */
    return mesh.vertex_count > 10000 && sum / (double)mesh.vertex_count < 0.005 ? 0 : 1;
}
