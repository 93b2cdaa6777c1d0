// SPDX-License-Identifier: MIT
// Analytic scenes, their depth images, and maps fused from them, for the tests of the runtime.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <set>
#include <vector>

#include "api/c_frame.h"
#include "api/config.h"
#include "core/camera.h"
#include "core/image.h"
#include "core/jobs.h"
#include "core/triangle_mesh.h"
#include "session/fusion_session.h"

namespace burin {

// SplitMix64 (Steele, Lea, Flood 2014): the same numbers on every platform, unlike the distributions of
// <random>.
class Rng {
  public:
    explicit Rng(std::uint64_t seed) : state_(seed) {}
    std::uint64_t next() {
        std::uint64_t z = state_ += 0x9e3779b97f4a7c15ULL;
        z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9ULL;
        z = (z ^ z >> 27) * 0x94d049bb133111ebULL;
        return z ^ z >> 31;
    }
    double uniform(double low, double high) {
        return low + (high - low) * static_cast<double>(next() >> 11) * 0x1.0p-53;
    }
    int below(int n) { return static_cast<int>(next() % static_cast<std::uint64_t>(n)); }
    // Sum of twelve uniforms: variance 1, near enough to normal.
    double normal() {
        double sum = -6;
        for (int i = 0; i < 12; ++i) sum += uniform(0, 1);
        return sum;
    }

  private:
    std::uint64_t state_;
};

// Camera at `eye` looking at `target`, image upright against `up`.
inline Se3 look_from(Vec3d eye, Vec3d target, Vec3d up = {0, -1, 0}) {
    const Vec3d z = normalised(target - eye), x = normalised(cross(z, up)), y = cross(z, x);
    return {{{x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z}}, eye};
}

inline Se3 random_pose(Rng& rng, double reach_m) {
    Quaternion q = {rng.normal(), rng.normal(), rng.normal(), rng.normal()};
    const double n = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    const Vec3d t = {rng.uniform(-reach_m, reach_m), rng.uniform(-reach_m, reach_m),
                     rng.uniform(-reach_m, reach_m)};
    return *se3_from_quaternion(t, {q.x / n, q.y / n, q.z / n, q.w / n});
}

// 62 degrees wide at any size, like a Kinect.
inline Camera test_camera(int width = 160, int height = 120) {
    const double f = 525.0 / 640 * width;
    return {width, height, f, f, (width - 1) / 2.0, (height - 1) / 2.0};
}

// Half spaces {n . p < offset} (n unit) and balls, united.
struct AnalyticScene {
    struct Plane {
        Vec3d n;
        double offset;
    };
    struct Ball {
        Vec3d centre;
        double radius;
    };
    std::vector<Plane> planes;
    std::vector<Ball> balls;

    double distance(Vec3d p) const {
        double least = 1e9;
        for (const Plane& s : planes) least = std::min(least, dot(s.n, p) - s.offset);
        for (const Ball& b : balls) least = std::min(least, norm(p - b.centre) - b.radius);
        return least;
    }
    // Parameter of the first hit of origin + t direction, 0 when there is none.
    double trace(Vec3d origin, Vec3d direction) const {
        double first = 1e9;
        for (const Plane& s : planes) {
            const double along = dot(s.n, direction);
            if (along < 0) first = std::min(first, (s.offset - dot(s.n, origin)) / along);
        }
        for (const Ball& b : balls) {
            const Vec3d to = b.centre - origin;
            const double a = dot(direction, direction), h = dot(to, direction),
                         c = dot(to, to) - b.radius * b.radius;
            const double root = h * h - a * c;
            if (root > 0 && h > 0) first = std::min(first, (h - std::sqrt(root)) / a);
        }
        return first < 1e9 && first > 0 ? first : 0;
    }
    // Metres along the optical axis; the camera's distortion is honoured.
    Image<float> depth(const Camera& camera, const Se3& T_world_camera) const {
        Image<float> out(camera.width, camera.height);
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x) {
                const Vec3d ray = unproject(camera, {static_cast<double>(x), static_cast<double>(y)});
                out.view().at(x, y) = static_cast<float>(trace(T_world_camera.t, T_world_camera.R * ray));
            }
        return out;
    }
};

inline FrameView frame_of(const Image<float>& depth, const Camera& camera, const Se3& T_world_camera) {
    FrameView f;
    f.depth_f32 = depth.view();
    f.depth_unit_m = 1;
    f.depth_camera = camera;
    f.T_world_camera = T_world_camera;
    return f;
}
inline FrameView frame_of(const Image<std::uint16_t>& depth, double unit_m, const Camera& camera,
                          const Se3& T_world_camera) {
    FrameView f;
    f.depth_u16 = depth.view();
    f.depth_unit_m = unit_m;
    f.depth_camera = camera;
    f.T_world_camera = T_world_camera;
    return f;
}

inline FrameView view_of(const Frame& f) {
    FrameView v;
    v.t_ns = f.t_ns;
    v.depth_u16 = f.depth_u16.view();
    v.depth_f32 = f.depth_f32.view();
    v.depth_unit_m = f.depth_unit_m;
    v.depth_camera = f.depth_camera;
    v.colour = f.colour.view();
    v.colour_camera = f.colour_camera;
    v.T_colour_depth = f.T_colour_depth;
    v.T_world_camera = f.T_world_camera;
    v.imu = f.imu.data();
    v.imu_count = static_cast<int>(f.imu.size());
    v.T_camera_imu = f.T_camera_imu;
    return v;
}

struct FreeDeleter {
    void operator()(void* p) const { std::free(p); }
};
using Memory = std::unique_ptr<void, FreeDeleter>;
// Filled with a pattern, since the runtime must not rely on zeros.
inline Memory aligned_memory(std::size_t bytes) {
    void* p = std::aligned_alloc(4096, (bytes + 4095) / 4096 * 4096);
    std::memset(p, 0xa5, bytes);
    return Memory(p);
}

// Small images, coarse voxels, 16 MiB: a test that needs more says so.
inline burin_config test_config(float voxel_m = 0.02f) {
    burin_config c = burin_config_default();
    c.budget_bytes = 16u << 20;
    c.voxel_m = voxel_m;
    c.max_width = 160;
    c.max_height = 120;
    return c;
}

// A session in its own memory: the runtime without its C boundary, so that tests can look at the volume.
class TestSession {
  public:
    explicit TestSession(const burin_config& config, std::uint32_t capacity = 0)
        : jobs(static_cast<int>(config.threads)) {
        EXPECT_TRUE(check_config(config).ok()) << check_config(config).text();
        FusionOptions options = options_of(config);
        std::uint64_t bytes = 0;
        options.volume.capacity = FusionSession::capacity_for(options, &bytes);
        if (capacity != 0) options.volume.capacity = capacity;
        bytes = FusionSession::bytes_for(options, options.volume.capacity);
        memory_ = aligned_memory(bytes);
        Arena arena(memory_.get(), bytes);
        session.place(arena, options);
        session.clear();
    }
    FrameReport integrate(const FrameView& frame) { return session.integrate(frame, jobs); }
    const Volume& volume() const { return session.volume(); }

    TriangleMesh mesh(const MeshOptions& options) {
        const MeshCounts counts = session.count_mesh(options, jobs);
        TriangleMesh m;
        m.positions.resize(counts.vertices);
        m.normals.resize(counts.vertices);
        m.colours.resize(counts.vertices);
        m.triangles.resize(counts.triangles);
        if (counts.vertices > 0)
            session.extract_mesh(
                options, {&m.positions[0].x, &m.normals[0].x, m.colours[0].data(), m.triangles[0].data()},
                jobs);
        return m;
    }
    TriangleMesh chunk_mesh(Vec3i chunk, const MeshOptions& options) {
        TriangleMesh m;
        m.positions.resize(kMaxChunkVertices);
        m.normals.resize(kMaxChunkVertices);
        m.colours.resize(kMaxChunkVertices);
        m.triangles.resize(kMaxChunkTriangles);
        const MeshCounts counts = session.mesh_one_chunk(
            pack_key(chunk), options,
            {&m.positions[0].x, &m.normals[0].x, m.colours[0].data(), m.triangles[0].data()});
        m.positions.resize(counts.vertices);
        m.normals.resize(counts.vertices);
        m.colours.resize(counts.vertices);
        m.triangles.resize(counts.triangles);
        return m;
    }
    std::set<ChunkKey> keys() const {
        std::set<ChunkKey> all;
        for (std::uint32_t slot = 0; slot < volume().live(); ++slot) all.insert(volume().key(slot));
        return all;
    }

  private:
    Memory memory_;  // outlives the session, whose store writes from it to the end

  public:
    FusionSession session;
    Jobs jobs;
};

// The depth stage alone, in its own memory.
class TestDepth {
  public:
    explicit TestDepth(const DepthOptions& options) {
        Arena measure;
        DepthStage().place(measure, options);
        memory_ = aligned_memory(measure.used());
        Arena arena(memory_.get(), measure.used());
        stage.place(arena, options);
    }
    const DepthImage& prepare(const FrameView& frame) {
        stage.prepare(frame, jobs);
        return stage.image;
    }
    double metres(int x, int y) const {
        return static_cast<double>(stage.image.at(x, y)) * static_cast<double>(stage.image.unit_m);
    }

    DepthStage stage;
    Jobs jobs{2};

  private:
    Memory memory_;
};

// A bare volume to write voxels into.
class TestVolume {
  public:
    explicit TestVolume(VolumeShape shape) {
        Arena measure;
        Volume().place(measure, shape);
        memory_ = aligned_memory(measure.used());
        Arena arena(memory_.get(), measure.used());
        volume.place(arena, shape);
        volume.clear();
    }
    // The slot of a chunk, inserted when absent.
    std::uint32_t chunk(Vec3i c) {
        const std::uint32_t slot = volume.find(pack_key(c));
        return slot != kNoChunk ? slot : volume.insert(pack_key(c));
    }
    // Every voxel of chunks low..high (inclusive) from `distance_m(centre)`, with the weight of one
    // observation.
    template <class Distance>
    void fill(Vec3i low, Vec3i high, Distance&& distance_m) {
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x) {
                    ChunkGeometry& g = volume.geometry(chunk({x, y, z}));
                    for (int i = 0; i < kChunkVoxels; ++i) {
                        const Vec3d p = {(8 * x + (i & 7) + 0.5) * volume.voxel_m(),
                                         (8 * y + (i >> 3 & 7) + 0.5) * volume.voxel_m(),
                                         (8 * z + (i >> 6) + 0.5) * volume.voxel_m()};
                        const double units = distance_m(p) / volume.units_to_m();
                        g.sdf[i] = static_cast<std::int16_t>(
                            std::lround(std::fmin(32767, std::fmax(-32767, units))));
                        g.weight[i] = 64;
                    }
                }
    }

    Volume volume;

  private:
    Memory memory_;
};

// A map behind the C API.
class ApiMap {
  public:
    explicit ApiMap(const burin_config& config) {
        EXPECT_EQ(burin_bytes(&config, &bytes), BURIN_OK) << burin_last_error(burin_map{0, 0});
        memory = aligned_memory(bytes);
        EXPECT_EQ(burin_create(&config, memory.get(), bytes, &map), BURIN_OK)
            << burin_last_error(burin_map{0, 0});
    }
    ~ApiMap() { burin_destroy(&map); }
    ApiMap(const ApiMap&) = delete;
    ApiMap& operator=(const ApiMap&) = delete;

    std::uint64_t hash() const {
        std::uint64_t h = 0;
        EXPECT_EQ(burin_hash(map, &h), BURIN_OK);
        return h;
    }
    burin_statistics stats() const {
        burin_statistics s{};
        EXPECT_EQ(burin_stats(map, &s), BURIN_OK);
        return s;
    }

    Memory memory;
    std::uint64_t bytes = 0;
    burin_map map{0, 0};
};

inline burin_frame c_frame(const FrameView& v) {
    burin_frame f = burin_frame_default();
    const bool u16 = !v.depth_u16.empty();
    f.depth_type = u16 ? BURIN_DEPTH_U16 : BURIN_DEPTH_F32;
    f.t_ns = v.t_ns;
    f.depth = u16 ? static_cast<const void*>(v.depth_u16.data) : v.depth_f32.data;
    f.depth_stride_bytes = u16 ? 2 * static_cast<std::uint64_t>(v.depth_u16.stride)
                               : 4 * static_cast<std::uint64_t>(v.depth_f32.stride);
    f.depth_unit_m = v.depth_unit_m;
    f.depth_camera = c_camera(v.depth_camera);
    f.T_world_camera = c_pose(v.T_world_camera);
    if (v.colour.empty()) return f;
    f.colour = v.colour.data;
    f.colour_stride_bytes = static_cast<std::uint64_t>(v.colour.stride);
    f.colour_camera = c_camera(v.colour_camera);
    f.T_colour_depth = c_pose(v.T_colour_depth);
    return f;
}

// A ball of 0.4 m before a wall, seen from an arc around it: curved and flat surface, an occlusion, free
// space.
inline AnalyticScene ball_and_wall() { return {{{{0, 0, -1}, -2.0}}, {{{0, 0, 1.2}, 0.4}}}; }
inline Se3 arc_pose(int i, int n) {
    const double a = (i - (n - 1) / 2.0) * 1.0 / n;
    return look_from({std::sin(a) * 1.5, 0.2 * std::sin(7 * a), 1.2 - 1.5 * std::cos(a)}, {0, 0, 1.2});
}

}  // namespace burin
