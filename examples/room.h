/* SPDX-License-Identifier: MIT
 *
 * A made-up sensor for the examples: a room of 4 x 2.6 x 5 m with a box on its floor, and what a depth camera
 * in its middle sees while it turns around. Replace this by your own camera.
 */
#ifndef ROOM_H
#define ROOM_H

#include <burin/burin.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define ROOM_WIDTH 160
#define ROOM_HEIGHT 120
#define ROOM_FRAMES 48

/* y points down, as in the camera. */
static const double room_low[3] = {-2, -1.3, -2.5}, room_high[3] = {2, 1.3, 2.5};
static const double box_low[3] = {-0.5, 0.6, 0.9}, box_high[3] = {0.5, 1.3, 1.7};

static uint16_t room_depth_mm[ROOM_WIDTH * ROOM_HEIGHT];
static uint8_t room_rgb[3 * ROOM_WIDTH * ROOM_HEIGHT];

/* Where origin + t direction leaves the room; *side is the wall, 0 .. 5. */
static double room_leave(const double origin[3], const double direction[3], int* side) {
    double t = 1e9;
    int k;
    for (k = 0; k < 3; ++k) {
        const double wall = direction[k] > 0 ? room_high[k] : room_low[k];
        const double at = direction[k] != 0 ? (wall - origin[k]) / direction[k] : 1e9;
        if (at < t) {
            t = at;
            *side = 2 * k + (direction[k] > 0);
        }
    }
    return t;
}

/* Where it enters the box, 1e9 when it does not. */
static double room_enter_box(const double origin[3], const double direction[3]) {
    double first = 0, last = 1e9;
    int k;
    for (k = 0; k < 3; ++k) {
        const double d = direction[k] != 0 ? direction[k] : 1e-12;
        const double a = (box_low[k] - origin[k]) / d, b = (box_high[k] - origin[k]) / d;
        first = fmax(first, fmin(a, b));
        last = fmin(last, fmax(a, b));
    }
    return first < last && first > 0 ? first : 1e9;
}

/* Distance of a point to the nearest surface, for the examples to check themselves; metres. */
static double room_distance(const float* p) {
    double least = 1e9, outside = 0, inside = -1e9;
    int k;
    for (k = 0; k < 3; ++k) {
        const double to_box = fmax(box_low[k] - p[k], p[k] - box_high[k]);
        least = fmin(least, fmin(fabs(p[k] - room_low[k]), fabs(p[k] - room_high[k])));
        outside += to_box > 0 ? to_box * to_box : 0;
        inside = fmax(inside, to_box);
    }
    return fmin(least, inside > 0 ? sqrt(outside) : -inside);
}

/* Frame i of ROOM_FRAMES. The images are valid until the next call. */
static burin_frame room_frame(int i) {
    static const uint8_t colours[7][3] = {{200, 90, 80},  {90, 160, 90},  {230, 230, 220}, {120, 90, 60},
                                          {90, 110, 190}, {210, 190, 90}, {60, 60, 70}};
    const double angle = 6.283185307179586 * i / ROOM_FRAMES, c = cos(angle), s = sin(angle);
    const double eye[3] = {0, 0.1, -0.6};
    burin_frame frame = burin_frame_default();
    int x, y;

    frame.depth_camera.width = ROOM_WIDTH;
    frame.depth_camera.height = ROOM_HEIGHT;
    frame.depth_camera.fx = frame.depth_camera.fy = 110;
    frame.depth_camera.cx = (ROOM_WIDTH - 1) / 2.0;
    frame.depth_camera.cy = (ROOM_HEIGHT - 1) / 2.0;
    for (y = 0; y < ROOM_HEIGHT; ++y)
        for (x = 0; x < ROOM_WIDTH; ++x) {
            const double rx = (x - frame.depth_camera.cx) / frame.depth_camera.fx;
            const double ry = (y - frame.depth_camera.cy) / frame.depth_camera.fy;
            const double direction[3] = {c * rx + s, ry,
                                         c - s * rx}; /* z is 1 in the camera, so t is depth */
            const double box = room_enter_box(eye, direction);
            int side = 0;
            double t = room_leave(eye, direction, &side);
            if (box < t) {
                t = box;
                side = 6;
            }
            room_depth_mm[y * ROOM_WIDTH + x] = (uint16_t)(1000 * t + 0.5);
            memcpy(room_rgb + 3 * (y * ROOM_WIDTH + x), colours[side], 3);
        }
    frame.t_ns = (int64_t)i * 33333333;
    frame.depth_type = BURIN_DEPTH_U16;
    frame.depth = room_depth_mm;
    frame.depth_stride_bytes = ROOM_WIDTH * sizeof(uint16_t);
    frame.depth_unit_m = 0.001;
    frame.T_world_camera.tx = eye[0];
    frame.T_world_camera.ty = eye[1];
    frame.T_world_camera.tz = eye[2];
    frame.T_world_camera.qy = sin(angle / 2);
    frame.T_world_camera.qw = cos(angle / 2);
    frame.colour = room_rgb;
    frame.colour_stride_bytes = 3 * ROOM_WIDTH;
    frame.colour_camera = frame.depth_camera; /* one lens for both, so T_colour_depth stays the identity */
    return frame;
}

/* Voxels of 3 cm, up to 5 m, images of this sensor. */
static burin_config room_config(uint64_t budget_bytes) {
    burin_config config = burin_config_default();
    config.budget_bytes = budget_bytes;
    config.voxel_m = 0.03f;
    config.max_depth_m = 5;
    config.max_width = ROOM_WIDTH;
    config.max_height = ROOM_HEIGHT;
    return config;
}

/* The caller owns a map's memory, aligned to 64 bytes. C99 has no aligned_alloc: free what is in *raw. */
static void* room_memory(uint64_t bytes, void** raw) {
    *raw = malloc((size_t)bytes + 64);
    return *raw ? (void*)(((uintptr_t)*raw + 63) & ~(uintptr_t)63) : NULL;
}

#endif
