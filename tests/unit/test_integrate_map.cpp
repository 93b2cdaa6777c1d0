// SPDX-License-Identifier: MIT
// What integration does to a map as a whole: carving, a full pool, threads, colour from another camera.
#include <gtest/gtest.h>

#include "core/hash.h"
#include "map/sample.h"
#include "scene_helpers.h"

namespace burin {
namespace {

const Camera kCamera = test_camera();

// Triangles of the mesh nearer than `reach` to a point.
int triangles_near(const TriangleMesh& mesh, Vec3d p, double reach) {
    int count = 0;
    for (const auto& t : mesh.triangles) count += norm(to_double(mesh.positions[t[0]]) - p) < reach;
    return count;
}

TEST(Carving, RemovesWhatIsLaterSeenThrough) {
    const AnalyticScene with = ball_and_wall(), without{with.planes, {}};
    for (const std::uint32_t carve : {1u, 0u}) {
        burin_config config = test_config();
        config.carve = carve;
        TestSession session(config);
        const Se3 T = arc_pose(3, 7);
        const Image<float> first = with.depth(kCamera, T), later = without.depth(kCamera, T);
        session.integrate(frame_of(first, kCamera, T));
        EXPECT_GT(triangles_near(session.mesh({}), {0, 0, 1.2}, 0.45), 500);
        std::uint32_t carved = 0;
        for (int i = 0; i < 5; ++i) carved += session.integrate(frame_of(later, kCamera, T)).chunks.carved;
        const int left = triangles_near(session.mesh({}), {0, 0, 1.2}, 0.45);
        if (carve) {
            EXPECT_GT(carved, 0u);
            EXPECT_EQ(left, 0) << "the ball still floats";
        } else {
            EXPECT_EQ(carved, 0u);
            EXPECT_GT(left, 500) << "nothing but carving should have removed it";
        }
        EXPECT_GT(triangles_near(session.mesh({}), {0, 0, 2}, 0.5), 500) << "the wall behind is there";
    }
}

TEST(Carving, DoesNotTouchWhatIsHiddenOrUnseen) {
    const AnalyticScene scene = ball_and_wall();
    TestSession session(test_config());
    for (int i = 0; i < 7; ++i) {
        const Se3 T = arc_pose(i, 7);
        session.integrate(frame_of(scene.depth(kCamera, T), kCamera, T));
    }
    const TriangleMesh before = session.mesh({});
    // From the same places again: the ball hides part of the wall, which must stay.
    const Se3 T = arc_pose(3, 7);
    for (int i = 0; i < 5; ++i) session.integrate(frame_of(scene.depth(kCamera, T), kCamera, T));
    EXPECT_GT(session.mesh({}).triangles.size(), before.triangles.size() * 98 / 100);
    // A frame without depth changes nothing at all.
    const std::uint64_t hash = session.session.hash();
    const Image<float> nothing(160, 120);
    EXPECT_EQ(session.integrate(frame_of(nothing, kCamera, T)).valid_pixels, 0u);
    EXPECT_EQ(session.session.hash(), hash);
}

class CarvingRays : public testing::TestWithParam<double> {};

TEST_P(CarvingRays, ReachEveryChunkTheyPass) {
    // A full frame, then frames of a single pixel that sees far. A chunk must change when a voxel of it,
    // known and not yet free, has this pixel as its nearest and lies in front by the truncation; and it is
    // its turn (one of four).
    const double voxel = GetParam();
    burin_config config = test_config(static_cast<float>(voxel));
    config.budget_bytes = 64u << 20;
    TestSession session(config);
    const Se3 T = arc_pose(2, 7), T_camera_world = T.inverse();
    const Image<float> full = ball_and_wall().depth(kCamera, T);
    session.integrate(frame_of(full, kCamera, T));
    Rng rng(12);
    std::vector<std::uint64_t> before(session.volume().live());
    int changed = 0;
    for (std::uint64_t frame = 2; frame < 200; ++frame) {
        const int x = rng.below(160), y = rng.below(120);
        Image<float> depth(160, 120);
        depth.view().at(x, y) = 3.9f;
        std::vector<int> expected(session.volume().live(), 0);  // 1: must change, -1: rounding decides
        for (std::uint32_t slot = 0; slot < session.volume().live(); ++slot) {
            before[slot] = session.volume().chunk_hash(slot);
            const Vec3i c = unpack_key(session.volume().key(slot));
            const ChunkGeometry& g = session.volume().geometry(slot);
            if ((mix64(session.volume().key(slot)) + frame) % 4 != 0) continue;
            for (int i = 0; i < kChunkVoxels; ++i) {
                const Vec3d p = T_camera_world * Vec3d{(8 * c.x + (i & 7) + 0.5) * voxel,
                                                       (8 * c.y + (i >> 3 & 7) + 0.5) * voxel,
                                                       (8 * c.z + (i >> 6) + 0.5) * voxel};
                if (p.z < 2e-3 || g.weight[i] == 0 || g.sdf[i] == 32767) continue;
                const Pixel at = project(kCamera, p);
                const double off = std::max(std::fabs(at.u - x), std::fabs(at.v - y)),
                             room = 3.9 - p.z - 4 * voxel;
                if (off < 0.498 && room > 1e-4)
                    expected[slot] = 1;
                else if (off < 0.502 && room > -1e-4 && expected[slot] == 0)
                    expected[slot] = -1;
            }
        }
        // Only what is there: a new chunk at 3.9 m is not looked at.
        const std::uint32_t live = session.volume().live();
        session.integrate(frame_of(depth, kCamera, T));
        for (std::uint32_t slot = 0; slot < live; ++slot) {
            const bool different = session.volume().chunk_hash(slot) != before[slot];
            changed += different;
            // At the far end the reading itself is fused.
            const double z =
                (T_camera_world * Vec3d{(unpack_key(session.volume().key(slot)).x + 0.5) * 8 * voxel,
                                        (unpack_key(session.volume().key(slot)).y + 0.5) * 8 * voxel,
                                        (unpack_key(session.volume().key(slot)).z + 0.5) * 8 * voxel})
                    .z;
            if (expected[slot] < 0 || z > 3.9 - 14 * voxel) continue;
            ASSERT_EQ(different, expected[slot] == 1) << "frame " << frame << ", pixel " << x << ' ' << y;
        }
        before.resize(session.volume().live());
    }
    EXPECT_GT(changed, 60);
}

INSTANTIATE_TEST_SUITE_P(Voxels, CarvingRays, testing::Values(0.04, 0.015));

TEST(FullPool, FinishesTheFrameAndKeepsWhatItHas) {
    const AnalyticScene scene = ball_and_wall();
    burin_config config = test_config(0.01f);
    config.budget_bytes = 64u << 20;
    TestSession large(config);
    const Image<float> probe = scene.depth(kCamera, arc_pose(0, 7));
    large.integrate(frame_of(probe, kCamera, arc_pose(0, 7)));
    const std::uint32_t capacity = large.volume().live() * 2 / 3;
    large.session.clear();
    TestSession small(config, capacity);
    std::uint32_t dropped = 0;
    for (int i = 0; i < 7; ++i) {
        const Se3 T = arc_pose(i, 7);
        const Image<float> depth = scene.depth(kCamera, T);
        const FrameReport all = large.integrate(frame_of(depth, kCamera, T)),
                          some = small.integrate(frame_of(depth, kCamera, T));
        EXPECT_EQ(all.chunks.dropped, 0u);
        EXPECT_EQ(some.chunks.fused + some.chunks.dropped, all.chunks.fused)
            << "a chunk neither fused nor counted as dropped";
        if (i == 0) {
            EXPECT_EQ(some.chunks.dropped, all.chunks.added - capacity);
        }
        dropped += some.chunks.dropped;
    }
    EXPECT_EQ(small.volume().live(), capacity);
    EXPECT_GT(dropped, capacity / 2);
    EXPECT_EQ(small.session.dropped(), dropped);
    for (std::uint32_t slot = 0; slot < capacity; ++slot) {
        const std::uint32_t same = large.volume().find(small.volume().key(slot));
        ASSERT_NE(same, kNoChunk);
        ASSERT_EQ(large.volume().chunk_hash(same), small.volume().chunk_hash(slot));
    }
    // Full is not the end: it meshes, and empties.
    EXPECT_GT(small.mesh({}).triangles.size(), 1000u);
    small.session.clear();
    EXPECT_GT(small.integrate(frame_of(probe, kCamera, arc_pose(0, 7))).chunks.added, 0u);
}

TEST(FullPool, TheApiSetsTheFlag) {
    burin_config config = test_config(0.005f);
    config.budget_bytes = 4u << 20;
    const ApiMap map(config);
    const Se3 T = arc_pose(3, 7);
    const Image<float> depth = ball_and_wall().depth(kCamera, T);
    const burin_frame frame = c_frame(frame_of(depth, kCamera, T));
    burin_frame_result result;
    ASSERT_EQ(burin_integrate(map.map, &frame, &result), BURIN_OK);
    EXPECT_EQ(result.flags, static_cast<std::uint32_t>(BURIN_FLAG_POOL_FULL));
    EXPECT_GT(result.chunks_dropped, 0u);
    const burin_statistics stats = map.stats();
    EXPECT_EQ(stats.chunks_dropped, result.chunks_dropped);
    EXPECT_EQ(stats.chunks_live, stats.chunks_capacity);
    EXPECT_EQ(result.chunks_new, stats.chunks_capacity);
}

TEST(Threads, TheMapDoesNotDependOnThem) {
    const AnalyticScene scene = ball_and_wall();
    Rng rng(8);
    std::vector<Image<float>> depths;
    Image<std::uint8_t> colour(160, 120, 3);
    for (std::uint8_t& c : colour.pixels) c = static_cast<std::uint8_t>(rng.below(256));
    for (int i = 0; i < 7; ++i) {
        depths.push_back(scene.depth(kCamera, arc_pose(i, 7)));
        for (float& d : depths.back().pixels) d += static_cast<float>(0.005 * rng.normal());
    }
    std::uint64_t hash = 0;
    TriangleMesh mesh;
    for (const std::uint32_t threads : {1u, 2u, 5u}) {
        burin_config config = test_config(0.01f);
        config.budget_bytes =
            6u << 20;  // full in the end: which chunks are dropped must not depend on threads either
        config.threads = threads;
        config.bilateral = config.edge_removal = config.angle_weight = 1;
        TestSession session(config);
        std::uint32_t dropped = 0;
        for (int i = 0; i < 7; ++i) {
            FrameView frame = frame_of(depths[static_cast<std::size_t>(i)], kCamera, arc_pose(i, 7));
            frame.colour = colour.view();
            frame.colour_camera = kCamera;
            dropped += session.integrate(frame).chunks.dropped;
        }
        EXPECT_GT(dropped, 0u);
        const TriangleMesh got = session.mesh({});
        if (hash == 0) {
            hash = session.session.hash();
            mesh = got;
        }
        EXPECT_EQ(session.session.hash(), hash) << threads << " threads";
        EXPECT_EQ(got.positions, mesh.positions);
        EXPECT_EQ(got.normals, mesh.normals);
        EXPECT_EQ(got.colours, mesh.colours);
        EXPECT_EQ(got.triangles, mesh.triangles);
    }
}

// A wall with squares of 20 cm in two colours, seen by a depth camera and by a colour camera of another size,
// place, focal length and lens. Colours on the reconstructed wall must be those painted on it.
TEST(Colour, ComesFromItsOwnCamera) {
    const AnalyticScene wall{{{{0, 0, -1}, -1.5}}, {}};
    const auto paint = [](Vec3d p) {
        return (static_cast<int>(std::floor(p.x / 0.2)) + static_cast<int>(std::floor(p.y / 0.2))) & 1;
    };
    Camera colour_camera{300, 200, 260, 250, 140, 105};
    colour_camera.k1 = 0.12, colour_camera.k2 = -0.2, colour_camera.p1 = 0.003, colour_camera.p2 = -0.004,
    colour_camera.k3 = 0.05;
    const Se3 T_colour_depth =
        *se3_from_quaternion({-0.08, 0.02, 0.03}, {0.02, -0.03, 0.01, std::sqrt(1 - 0.0014)});
    TestSession session(test_config(0.01f));
    for (int i = 0; i < 3; ++i) {
        const Se3 T = look_from({0.2 * i - 0.2, 0.1, -0.05 * i}, {0, 0, 1.5});
        const Se3 T_world_colour = T * T_colour_depth.inverse();
        Image<std::uint8_t> colour(300, 200, 3);
        for (int y = 0; y < 200; ++y)
            for (int x = 0; x < 300; ++x) {
                const Vec3d ray = T_world_colour.R *
                                  unproject(colour_camera, {static_cast<double>(x), static_cast<double>(y)});
                const bool odd = paint(T_world_colour.t + ray * wall.trace(T_world_colour.t, ray));
                colour.view().at(x, y, 0) = odd ? 200 : 20;
                colour.view().at(x, y, 1) = odd ? 30 : 120;
                colour.view().at(x, y, 2) = odd ? 10 : 240;
            }
        const Image<float> depth = wall.depth(kCamera, T);
        FrameView frame = frame_of(depth, kCamera, T);
        frame.colour = colour.view();
        frame.colour_camera = colour_camera;
        frame.T_colour_depth = T_colour_depth;
        session.integrate(frame);
    }
    Sampler sampler(session.volume());
    int right = 0, wrong = 0, without = 0;
    for (double y = -0.35; y < 0.35; y += 0.011)
        for (double x = -0.45; x < 0.45; x += 0.011) {
            const Vec3d p{x, y, 1.5};
            // Within a voxel and a half of a border the two colours mix.
            const auto border = [](double v) {
                return std::fabs(v / 0.2 - std::round(v / 0.2)) * 0.2 < 0.017;
            };
            if (border(x) || border(y)) continue;
            float rgb[3];
            if (!sampler.colour(p, rgb)) {
                ++without;
                continue;
            }
            const bool odd = paint(p);
            const bool same = std::fabs(rgb[0] - (odd ? 200 : 20)) < 3 &&
                              std::fabs(rgb[1] - (odd ? 30 : 120)) < 3 &&
                              std::fabs(rgb[2] - (odd ? 10 : 240)) < 3;
            ++(same ? right : wrong);
        }
    EXPECT_EQ(wrong, 0) << right << " right";
    EXPECT_GT(right, 2000);
    EXPECT_EQ(without, 0);
}

TEST(Colour, MeanOfManyReadingsIsNotBiased) {
    // Readings alternate between two values; the mean must come out, not the frozen first one.
    const AnalyticScene wall{{{{0, 0, -1}, -1.0}}, {}};
    const Image<float> depth = wall.depth(kCamera, {});
    TestSession session(test_config());
    for (int i = 0; i < 60; ++i) {
        const Image<std::uint8_t> colour(160, 120, 3, i % 2 ? 101 : 106);
        FrameView frame = frame_of(depth, kCamera, {});
        frame.colour = colour.view();
        frame.colour_camera = kCamera;
        session.integrate(frame);
    }
    const TriangleMesh mesh = session.mesh({});
    double sum = 0;
    for (const auto& c : mesh.colours) sum += c[1];
    EXPECT_NEAR(sum / static_cast<double>(mesh.colours.size()), 103.5, 1);
}

}  // namespace
}  // namespace burin
