// SPDX-License-Identifier: MIT
// New planes from regions that grow: a corner of two walls and a parallel one in front.
#include <gtest/gtest.h>

#include "scene_helpers.h"

namespace burin {
namespace {

// A session that founds planes as told.
struct PlaneSession {
    PlaneSession(const burin_config& config, MergeBy merge_by) {
        FusionOptions options = options_of(config);
        options.planes.merge_by = merge_by;
        std::uint64_t bytes = 0;
        options.volume.capacity = FusionSession::capacity_for(options, &bytes);
        memory = aligned_memory(bytes);
        Arena arena(memory.get(), bytes);
        session.place(arena, options);
        session.clear();
    }
    Memory memory;
    FusionSession session;
    Jobs jobs{1};
};

class PlaneGrowing : public testing::TestWithParam<MergeBy> {};

TEST_P(PlaneGrowing, FindsThreeWalls) {
    burin_config config = test_config(0.01f);
    config.budget_bytes = 128u << 20;
    config.truncation_voxels = 6;
    config.planes = 1;
    PlaneSession s(config, GetParam());
    const AnalyticScene scene{
        {{{0, 0, -1}, -2.0}, {normalised(Vec3d{-1, 0, -0.25}), -0.9}, {{0, -1, 0}, -0.6}}, {}};
    const Camera camera = test_camera();
    for (int i = 0; i < 10; ++i) {
        const Se3 T = look_from({-0.2 + 0.04 * i, -0.3, 0.1 * (i % 3)}, {0.3, 0.2, 2});
        const Image<float> depth = scene.depth(camera, T);
        s.session.integrate(frame_of(depth, camera, T), s.jobs);
    }
    s.session.refresh_planes(s.jobs);
    const PlaneLayer& layer = s.session.planes();
    int told = 0;
    std::vector<int> found(scene.planes.size());
    for (std::uint32_t i = 0; i < layer.set().used(); ++i) {
        const GlobalPlane& p = layer.set().at(i);
        if (!layer.told(p)) continue;
        ++told;
        for (std::size_t t = 0; t < scene.planes.size(); ++t) {
            // Exact depth: what is left is the rounding of distances and the bias of views aslant.
            if (dot(p.normal, scene.planes[t].n) < 0.9999) continue;
            const Vec3d middle = (p.low + p.high) * 0.5;
            const Vec3d foot =
                middle - scene.planes[t].n * (dot(scene.planes[t].n, middle) - scene.planes[t].offset);
            EXPECT_NEAR(p.distance(foot), 0, 0.003) << t;
            ++found[t];
        }
    }
    EXPECT_EQ(told, 3);
    EXPECT_EQ(found, std::vector<int>({1, 1, 1}));
}

TEST_P(PlaneGrowing, FindsNoneInABall) {
    burin_config config = test_config(0.01f);
    config.budget_bytes = 64u << 20;
    config.planes = 1;
    PlaneSession s(config, GetParam());
    const AnalyticScene scene{{}, {{{0, 0, 1.2}, 0.25}}};
    const Camera camera = test_camera();
    for (int i = 0; i < 6; ++i) {
        const Se3 T = arc_pose(i, 6);
        const Image<float> depth = scene.depth(camera, T);
        s.session.integrate(frame_of(depth, camera, T), s.jobs);
    }
    s.session.refresh_planes(s.jobs);
    for (std::uint32_t i = 0; i < s.session.planes().set().used(); ++i)
        EXPECT_FALSE(s.session.planes().told(s.session.planes().set().at(i)));
}

INSTANTIATE_TEST_SUITE_P(BothWays, PlaneGrowing, testing::Values(MergeBy::ransac, MergeBy::growing));

}  // namespace
}  // namespace burin
