// SPDX-License-Identifier: MIT
// Frames of a data set as Open3D wants them, and the options of the comparison.
#pragma once

#include <time.h>
#include <unistd.h>

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "datasets/open.h"

namespace peers {

using burin::Camera;
using burin::Frame;
using burin::Se3;
using burin::Vec3d;

struct Options {
    std::string dataset, format, output, frames;
    double voxel_m = 0.01;
    double truncation_voxels = 4;
    double min_depth_m = 0.2, max_depth_m = 4;  // Burin's defaults
    double min_weight = 1.5;                    // as Burin's meshes; VoxelBlockGrid only
    int stride = 4;                             // Open3D's default
    int blocks = 10000;                         // VoxelBlockGrid's default; it grows
    int threads = 1;
    bool colour = false, vbg = false;
    bool preload =
        false;  // decode all frames first: as bench/pipeline does, and for nothing between two frames
    bool extract = true;
};

// A frame as Open3D wants it: float depth in metres with 0 for "none", and colour registered to the depth
// pixels.
struct ReadyFrame {
    int width = 0, height = 0;
    std::vector<float> depth_m;
    std::vector<std::uint16_t> depth_u16;  // the same readings as stored, empty when the data set has floats
    float depth_units_per_m = 1;           // of depth_u16
    std::vector<std::uint8_t> rgb;
    Camera camera;
    Eigen::Matrix4d T_camera_world = Eigen::Matrix4d::Identity();
};

// Processor time of all threads so far.
inline double cpu_ms() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

inline double milliseconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

inline float depth_at(const Frame& frame, std::size_t i, const Options& options) {
    double value = 0;
    if (!frame.depth_u16.empty())
        value = frame.depth_u16.pixels[i] == 65535 ? 0 : frame.depth_u16.pixels[i];
    else
        value = frame.depth_f32.pixels[i];
    const double metres = value * frame.depth_unit_m;
    return metres >= options.min_depth_m && metres <= options.max_depth_m ? static_cast<float>(metres) : 0.0f;
}

// The colour each depth pixel sees, nearest pixel; black where there is none.
inline void register_colour(const Frame& frame, ReadyFrame* out) {
    for (int v = 0; v < out->height; ++v)
        for (int u = 0; u < out->width; ++u) {
            const std::size_t i = static_cast<std::size_t>(v) * out->width + u;
            if (out->depth_m[i] <= 0) continue;
            const Vec3d ray = unproject(frame.depth_camera, {double(u), double(v)});
            const Vec3d p = frame.T_colour_depth * (ray * double(out->depth_m[i]));
            if (p.z <= 0) continue;
            const burin::Pixel pixel = project(frame.colour_camera, p);
            const double x = std::floor(pixel.u + 0.5), y = std::floor(pixel.v + 0.5);
            if (!(x >= 0 && y >= 0 && x < frame.colour.width && y < frame.colour.height)) continue;
            for (int c = 0; c < 3; ++c)
                out->rgb[3 * i + c] = frame.colour.view().at(static_cast<int>(x), static_cast<int>(y), c);
        }
}

inline burin::Status make_ready(const Frame& frame, const Options& options, ReadyFrame* out) {
    if (frame.depth_camera.distorted())
        return burin::Status::error(burin::Code::unsupported,
                                    "Open3D knows no lens distortion, this depth camera has one");
    const bool is_u16 = !frame.depth_u16.empty();
    out->width = is_u16 ? frame.depth_u16.width : frame.depth_f32.width;
    out->height = is_u16 ? frame.depth_u16.height : frame.depth_f32.height;
    out->camera = frame.depth_camera;
    const std::size_t pixels = static_cast<std::size_t>(out->width) * out->height;
    out->depth_m.resize(pixels);
    for (std::size_t i = 0; i < pixels; ++i) out->depth_m[i] = depth_at(frame, i, options);
    out->depth_u16.clear();
    if (is_u16) {
        out->depth_u16 = frame.depth_u16.pixels;
        for (std::size_t i = 0; i < pixels; ++i)
            if (out->depth_m[i] <= 0) out->depth_u16[i] = 0;
        out->depth_units_per_m = static_cast<float>(1 / frame.depth_unit_m);
    }
    if (options.colour) {
        if (frame.colour.empty())
            return burin::Status::error(burin::Code::unsupported, "--colour: the frame has none");
        out->rgb.assign(3 * pixels, 0);
        register_colour(frame, out);
    }
    const Se3 T = frame.T_world_camera.inverse();
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) out->T_camera_world(r, c) = T.R(r, c);
        out->T_camera_world(r, 3) = T.t[r];
    }
    return {};
}

// The value below which the given share of the sorted values lies (nearest rank).
inline double percentile(const std::vector<double>& sorted, double share) {
    const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
    return sorted[std::max<std::size_t>(rank, 1) - 1];
}

// OpenMP and Open3D take the number of threads from the environment when they are loaded, so the program
// starts itself again with it set.
inline void start_over_with_threads(int threads, char** argv) {
    const std::string wanted = std::to_string(threads);
    const char* now = std::getenv("OMP_NUM_THREADS");
    if (now && wanted == now) return;
    setenv("OMP_NUM_THREADS", wanted.c_str(), 1);
    // ScalableTSDFVolume opens a parallel region per block of 16^3 voxels, thousands a frame. libgomp's
    // default, spinning between them, takes seconds a frame when anything else wants a processor; sleeping
    // favours Open3D.
    setenv("OMP_WAIT_POLICY", "passive", 0);
    execv("/proc/self/exe", argv);
    std::fprintf(stderr, "%s: cannot start over with OMP_NUM_THREADS=%s\n", argv[0], wanted.c_str());
    std::exit(1);
}

}  // namespace peers
