/* SPDX-License-Identifier: MIT
 *
 * The C API from C99, as an embedder writes it: a made-up wall and a box before it, fused, meshed, looked at,
 * saved and loaded. Compiled with -std=c99 -pedantic -Wall -Wextra -Werror.
 */
#include <burin/burin.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define WIDTH 80
#define HEIGHT 60

static int failures = 0;

#define EXPECT(condition)                                                           \
    do {                                                                            \
        if (!(condition)) {                                                         \
            fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition); \
            ++failures;                                                             \
        }                                                                           \
    } while (0)
#define EXPECT_OK(map, call)                                                   \
    do {                                                                       \
        burin_status expect_status = (call);                                   \
        if (expect_status != BURIN_OK) {                                       \
            fprintf(stderr, "%s:%d: %s: %s (%s)\n", __FILE__, __LINE__, #call, \
                    burin_strerror(expect_status), burin_last_error(map));     \
            ++failures;                                                        \
        }                                                                      \
    } while (0)

typedef struct block {
    void* raw;
    void* aligned;
} block;

/* C99 has no aligned_alloc. */
static block allocate(uint64_t bytes) {
    block b;
    b.raw = malloc((size_t)bytes + 64);
    b.aligned = (void*)(((uintptr_t)b.raw + 63) & ~(uintptr_t)63);
    return b;
}

/* A wall at 2 m, a square at 1.5 m before it. */
static void paint(uint16_t* depth_mm, uint8_t* rgb) {
    int x, y;
    for (y = 0; y < HEIGHT; ++y)
        for (x = 0; x < WIDTH; ++x) {
            const int box = x >= 30 && x < 50 && y >= 20 && y < 40;
            depth_mm[y * WIDTH + x] = (uint16_t)(box ? 1500 : 2000);
            rgb[3 * (y * WIDTH + x)] = (uint8_t)(box ? 200 : 20);
            rgb[3 * (y * WIDTH + x) + 1] = 100;
            rgb[3 * (y * WIDTH + x) + 2] = 50;
        }
}

static burin_camera camera(void) {
    burin_camera c;
    memset(&c, 0, sizeof c);
    c.width = WIDTH;
    c.height = HEIGHT;
    c.fx = c.fy = 66;
    c.cx = (WIDTH - 1) / 2.0;
    c.cy = (HEIGHT - 1) / 2.0;
    return c;
}

static void check_values(void) {
    int status;
    for (status = -7; status <= 0; ++status)
        EXPECT(strcmp(burin_strerror((burin_status)status), "unknown status") != 0);
    EXPECT(strcmp(burin_strerror((burin_status)-99), "unknown status") == 0);
    EXPECT(strlen(burin_version()) >= 5);
    EXPECT(strlen(burin_simd_name()) > 0);
    EXPECT(burin_config_default().struct_size == sizeof(burin_config));
    EXPECT(burin_frame_default().struct_size == sizeof(burin_frame));
    EXPECT(burin_mesh_options_default().struct_size == sizeof(burin_mesh_options));
    EXPECT(burin_frame_default().T_world_camera.qw == 1 && burin_frame_default().T_colour_depth.qw == 1);
}

static void check_mesh(burin_map map) {
    burin_mesh_options options = burin_mesh_options_default();
    burin_mesh_buffers mesh;
    uint64_t i;
    int inside = 0;
    uint32_t* scratch;
    memset(&mesh, 0, sizeof mesh);
    EXPECT_OK(map, burin_mesh_size(map, &options, &mesh.vertex_capacity, &mesh.triangle_capacity));
    EXPECT(mesh.vertex_capacity > 100 && mesh.triangle_capacity > 100);
    mesh.positions = malloc((size_t)mesh.vertex_capacity * 3 * sizeof(float));
    mesh.normals = malloc((size_t)mesh.vertex_capacity * 3 * sizeof(float));
    mesh.colours = malloc((size_t)mesh.vertex_capacity * 3);
    mesh.triangles = malloc((size_t)mesh.triangle_capacity * 3 * sizeof(uint32_t));
    EXPECT_OK(map, burin_mesh(map, &options, &mesh));
    EXPECT(mesh.vertex_count == mesh.vertex_capacity && mesh.triangle_count == mesh.triangle_capacity);
    for (i = 0; i < mesh.vertex_count; ++i) {
        const float *p = mesh.positions + 3 * i, *n = mesh.normals + 3 * i;
        /* Beside the square's border the voxels are a mixture of both. */
        const float aside = (float)fabs(p[0]), up = (float)fabs(p[1]);
        const int box = aside < 0.15f && up < 0.15f;
        const int wall = aside > 0.45f && up < 0.6f;
        inside += box;
        if (box || wall) EXPECT(fabs(p[2] - (box ? 1.5 : 2.0)) < 0.001 && n[2] < -0.99);
        if (box) EXPECT(abs(mesh.colours[3 * i] - 200) <= 1);
        if (wall) EXPECT(abs(mesh.colours[3 * i] - 20) <= 1);
    }
    EXPECT(inside > 100);
    scratch = malloc((size_t)mesh.vertex_count * 2 * sizeof(uint32_t));
    EXPECT_OK(map, burin_mesh_remove_small(&mesh, mesh.triangle_count + 1, scratch));
    EXPECT(mesh.vertex_count == 0 && mesh.triangle_count == 0);
    free(scratch);
    free(mesh.positions);
    free(mesh.normals);
    free(mesh.colours);
    free(mesh.triangles);
}

static void check_chunks(burin_map map, uint32_t live) {
    burin_chunk_key keys[4000];
    burin_mesh_buffers mesh;
    burin_change_options every = burin_change_options_default();
    uint64_t count = 0, listed = 0, i, triangles = 0;
    every.threshold_voxels = 0;
    every.interval = 1;
    memset(&mesh, 0, sizeof mesh);
    mesh.vertex_capacity = 1944;
    mesh.triangle_capacity = 2560;
    mesh.positions = malloc(1944 * 3 * sizeof(float));
    mesh.triangles = malloc(2560 * 3 * sizeof(uint32_t));
    EXPECT(burin_dirty_chunks(map, keys, 0, &listed) == BURIN_INSUFFICIENT_MEMORY);
    EXPECT(listed > 0 && listed < live); /* those that may hold surface */
    EXPECT(burin_changed_chunks(map, &every, keys, 0, &count) == BURIN_INSUFFICIENT_MEMORY);
    EXPECT(count == live);
    EXPECT_OK(map, burin_changed_chunks(map, &every, keys, 4000, &count));
    for (i = 0; i < count; ++i) {
        EXPECT_OK(map, burin_chunk_mesh(map, keys[i], NULL, &mesh));
        triangles += mesh.triangle_count;
    }
    EXPECT(triangles > 100);
    EXPECT_OK(map, burin_changed_chunks(map, &every, keys, 4000, &count));
    EXPECT(count == 0);
    EXPECT_OK(map, burin_dirty_chunks(map, keys, 4000, &count));
    EXPECT(count == 0);
    free(mesh.positions);
    free(mesh.triangles);
}

static void check_queries(burin_map map) {
    const burin_camera c = camera();
    const burin_pose pose = burin_frame_default().T_world_camera;
    static float depth[WIDTH * HEIGHT], normals[3 * WIDTH * HEIGHT];
    static uint8_t rgb[3 * WIDTH * HEIGHT];
    const double points[9] = {0, 0, 1.46, 0, 0, 1.54, 9, 9, 9};
    float distances[3], gradients[9];
    const int centre = HEIGHT / 2 * WIDTH + WIDTH / 2;
    EXPECT_OK(map, burin_raycast(map, &c, &pose, depth, normals, rgb));
    EXPECT(fabs(depth[centre] - 1.5) < 0.004);
    EXPECT(normals[3 * centre + 2] < -0.99);
    EXPECT(abs(rgb[3 * centre] - 200) <= 1);
    EXPECT(fabs(depth[5 * WIDTH + 5] - 2.0) < 0.004);
    EXPECT_OK(map, burin_raycast(map, &c, &pose, NULL, NULL, NULL));
    EXPECT_OK(map, burin_sample(map, points, 3, distances, gradients));
    EXPECT(fabs(distances[0] - 0.04) < 0.002 && fabs(distances[1] + 0.04) < 0.002);
    EXPECT(isnan(distances[2]));
    EXPECT(fabs(gradients[2] + 1) < 0.05);
}

int main(int argc, char** argv) {
    static uint16_t depth_mm[WIDTH * HEIGHT];
    static uint8_t rgb[3 * WIDTH * HEIGHT];
    burin_config config = burin_config_default();
    burin_frame frame = burin_frame_default();
    burin_frame_result result;
    burin_statistics stats;
    burin_map map = {0, 0}, stale, again = {0, 0};
    block memory, other;
    uint64_t bytes = 0, hash = 0, loaded = 0;
    const char* path = argc > 1 ? argv[1] : "test_api.burin";

    check_values();
    config.budget_bytes = 8u << 20;
    config.voxel_m = 0.02f;
    config.max_width = WIDTH;
    config.max_height = HEIGHT;
    EXPECT_OK(map, burin_bytes(&config, &bytes));
    EXPECT(bytes > 0 && bytes <= config.budget_bytes);
    memory = allocate(bytes);
    EXPECT_OK(map, burin_create(&config, memory.aligned, bytes, &map));

    paint(depth_mm, rgb);
    frame.depth = depth_mm;
    frame.depth_type = BURIN_DEPTH_U16;
    frame.depth_stride_bytes = WIDTH * sizeof(uint16_t);
    frame.depth_unit_m = 0.001;
    frame.depth_camera = frame.colour_camera = camera();
    frame.colour = rgb;
    frame.colour_stride_bytes = 3 * WIDTH;
    EXPECT_OK(map, burin_integrate(map, &frame, &result));
    EXPECT(result.flags == 0 && result.valid_pixels == WIDTH * HEIGHT &&
           result.chunks_new == result.chunks_fused);
    EXPECT(result.chunks_new > 0 && result.chunks_dropped == 0 && result.chunks_carved == 0);
    EXPECT_OK(map, burin_integrate(map, &frame, NULL));
    EXPECT_OK(map, burin_stats(map, &stats));
    EXPECT(stats.frames == 2 && stats.chunks_live == result.chunks_new && stats.arena_bytes == bytes);
    EXPECT(stats.bounds_min_m[2] > 1.0f && stats.bounds_max_m[2] < 2.4f && stats.bounds_min_m[0] < -1.0f);

    check_mesh(map);
    check_chunks(map, stats.chunks_live);
    check_queries(map);

    EXPECT_OK(map, burin_hash(map, &hash));
    EXPECT_OK(map, burin_save(map, path));
    other = allocate(bytes);
    EXPECT_OK(again, burin_create(&config, other.aligned, bytes, &again));
    EXPECT_OK(again, burin_load(again, path));
    EXPECT_OK(again, burin_hash(again, &loaded));
    EXPECT(loaded == hash);
    EXPECT_OK(again, burin_reset(again));
    EXPECT_OK(again, burin_stats(again, &stats));
    EXPECT(stats.chunks_live == 0 && stats.frames == 0 && stats.bounds_min_m[0] > stats.bounds_max_m[0]);
    EXPECT_OK(again, burin_hash(map, &loaded));
    EXPECT(loaded == hash); /* the first map is untouched */

    stale = map;
    EXPECT_OK(map, burin_destroy(&map));
    EXPECT(map.index == 0 && map.generation == 0);
    EXPECT_OK(map, burin_destroy(&map)); /* a null map is fine */
    EXPECT(burin_hash(stale, &hash) == BURIN_STATE);
    EXPECT_OK(again, burin_destroy(&again));
    remove(path);
    free(memory.raw);
    free(other.raw);
    if (failures == 0) printf("burin %s (%s): all well\n", burin_version(), burin_simd_name());
    return failures == 0 ? 0 : 1;
}
