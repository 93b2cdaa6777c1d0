// SPDX-License-Identifier: MIT
// Which chunks a frame touches, against a search of all voxels in double precision: the marker must not miss
// one, and integration must touch exactly those.
#include <gtest/gtest.h>

#include <array>
#include <functional>

#include "emulated.h"
#include "map/band_marker.h"
#include "scene_helpers.h"

namespace burin {
namespace {

// Chunks that hold a voxel whose nearest pixel reads a depth within tau of it. `slack` > 0 widens every
// comparison by more than the rounding of the kernels (single precision) can be, < 0 narrows it.
struct Slack {
    double pixel, metres;
};
constexpr Slack kMust = {-2e-3, -3e-5}, kMay = {2e-3, 3e-5};
// With the constant model, pixels are found by groups where that is off by less than a tenth.
constexpr Slack kMustByGroups = {-0.102, -3e-5}, kMayByGroups = {0.102, 3e-5};

double tau_of(const simd::TruncationModel& model, double depth_m) {
    if (!model.quadratic) return static_cast<double>(model.truncation_m);
    return std::max(static_cast<double>(model.floor_m),
                    (static_cast<double>(model.a) * depth_m + static_cast<double>(model.b)) * depth_m +
                        static_cast<double>(model.c));
}

// One set for each slack.
template <std::size_t kSlacks>
std::array<std::set<ChunkKey>, kSlacks> brute_force(const DepthImage& image, const Se3& T,
                                                    const simd::TruncationModel& model, double voxel_m,
                                                    const Slack (&slacks)[kSlacks]) {
    std::array<std::set<ChunkKey>, kSlacks> chunks;
    const Se3 T_camera_world = T.inverse();
    const Camera& c = image.camera;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            if (image.at(x, y) == 0) continue;
            const double depth = static_cast<double>(image.at(x, y)) * static_cast<double>(image.unit_m),
                         tau = tau_of(model, depth);
            // The corners of what the pixel sees of the band, and all voxels in the box around them.
            Vec3d low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
            for (int i = 0; i < 8; ++i) {
                const double z = std::max(0.0, depth + (i & 4 ? tau : -tau));
                const Vec3d p =
                    T * (unproject(c, {x + (i & 1 ? 0.61 : -0.61), y + (i & 2 ? 0.61 : -0.61)}) * z);
                for (int r = 0; r < 3; ++r) {
                    low[r] = std::min(low[r], p[r]);
                    high[r] = std::max(high[r], p[r]);
                }
            }
            Vec3i from, to;
            for (int r = 0; r < 3; ++r) {
                from[r] = static_cast<int>(std::floor(low[r] / voxel_m)) - 1;
                to[r] = static_cast<int>(std::floor(high[r] / voxel_m)) + 1;
            }
            for (int k = from.z; k <= to.z; ++k)
                for (int j = from.y; j <= to.y; ++j)
                    for (int i = from.x; i <= to.x; ++i) {
                        const Vec3d p = T_camera_world *
                                        Vec3d{(i + 0.5) * voxel_m, (j + 0.5) * voxel_m, (k + 0.5) * voxel_m};
                        if (!(p.z > 0)) continue;
                        const Pixel at = project(c, p);
                        const double off = std::max(std::fabs(at.u - x), std::fabs(at.v - y));
                        for (std::size_t s = 0; s < kSlacks; ++s) {
                            if (slacks[s].pixel < 0 && !(p.z > 1.1e-3)) continue;  // nearer than any reading
                            if (off < 0.5 + slacks[s].pixel &&
                                std::fabs(depth - p.z) < tau + slacks[s].metres)
                                chunks[s].insert(pack_key({i >> 3, j >> 3, k >> 3}));
                        }
                    }
        }
    return chunks;
}

// The views that a camera and its driver may come up with.
struct Case {
    const char* name;
    std::function<void(Image<float>&, Rng&)> paint;
};
const Case kCases[] = {
    {"noise",
     [](Image<float>& d, Rng& rng) {
         for (float& v : d.pixels) v = static_cast<float>(rng.uniform(0, 3.9));
     }},
    {"sparse",
     [](Image<float>& d, Rng& rng) {
         for (float& v : d.pixels) v = rng.below(50) ? 0 : static_cast<float>(rng.uniform(0.2, 3.9));
     }},
    {"one pixel",
     [](Image<float>& d, Rng& rng) {
         const int x = rng.below(d.width), y = rng.below(d.height);
         d.view().at(x, y) = static_cast<float>(rng.uniform(0.2, 3.9));
     }},
    {"border",
     [](Image<float>& d, Rng& rng) {
         for (int y = 0; y < d.height; ++y)
             for (int x = 0; x < d.width; ++x)
                 if (x == 0 || y == 0 || x == d.width - 1 || y == d.height - 1)
                     d.view().at(x, y) = static_cast<float>(rng.uniform(0.3, 3.5));
     }},
    {"steps",
     [](Image<float>& d, Rng& rng) {
         for (int y = 0; y < d.height; ++y)
             for (int x = 0; x < d.width; ++x)
                 d.view().at(x, y) =
                     (x / 7 + y / 5) % 2 ? 0.6f : 3.1f + 0.01f * static_cast<float>(rng.below(5));
     }},
    {"grazing",
     [](Image<float>& d, Rng& rng) {  // a floor seen at up to 88 degrees
         const AnalyticScene floor{{{{0, -1, 0}, -rng.uniform(0.1, 0.6)}}, {}};
         d = floor.depth(test_camera(d.width, d.height), {});
     }},
    {"near",
     [](Image<float>& d, Rng& rng) {
         for (float& v : d.pixels) v = static_cast<float>(rng.uniform(0.01, 0.2));
     }},
    {"nothing", [](Image<float>&, Rng&) {}},
};

burin_config config_of(float voxel_m, bool quadratic) {
    burin_config c = test_config(voxel_m);
    c.budget_bytes = 64u << 20;
    c.min_depth_m = 0.01f;
    c.truncation = quadratic;
    c.carve = 0;
    c.colour = 0;
    return c;
}

std::set<ChunkKey> marked(BandMarker& marker, const DepthStage& depth, const Se3& T,
                          const FusionOptions& options, int capacity, int* slabs) {
    std::set<ChunkKey> keys;
    std::vector<std::int32_t> x(static_cast<std::size_t>(capacity)), y = x, z = x;
    Jobs jobs(2);
    marker.begin(depth.image, depth.tiles, T, options.integration.truncation, options.volume.voxel_m, jobs);
    *slabs = 0;
    while (marker.next_slab()) {
        ++*slabs;
        ChunkKey last = 0;
        while (const int n = marker.collect(x.data(), y.data(), z.data(), capacity))
            for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i) {
                const ChunkKey key = pack_key(marker.origin() + Vec3i{x[i], y[i], z[i]});
                EXPECT_LT(last, key) << "not in key order within the slab";
                EXPECT_TRUE(keys.insert(key).second) << "a chunk twice";
                last = key;
            }
    }
    return keys;
}

std::size_t missing(const std::set<ChunkKey>& needed, const std::set<ChunkKey>& have) {
    std::size_t count = 0;
    for (const ChunkKey key : needed) count += !have.contains(key);
    return count;
}

// Under emulation half the pixels each way.
constexpr int kWidth = sized(80, 40), kHeight = sized(60, 30);
const Camera kLopsided = kEmulated ? Camera{40, 30, 20, 45, 5, 35} : Camera{80, 60, 40, 90, 10, 70};

class Band : public testing::TestWithParam<bool> {};

TEST_P(Band, MarksASupersetAndIntegrationTouchesExactlyTheRest) {
    Rng rng(21);
    std::size_t needed = 0, marks = 0;
    for (const Case& c : kCases)
        for (int round = 0; round < 3; ++round) {
            const burin_config config = config_of(round == 2 ? 0.02f : 0.04f, GetParam());
            const FusionOptions options = options_of(config);
            const Camera camera = round == 1 ? kLopsided : test_camera(kWidth, kHeight);
            Image<float> image(kWidth, kHeight);
            c.paint(image, rng);
            const Se3 T = random_pose(rng, 3);

            TestDepth depth(options.depth);
            depth.prepare(frame_of(image, camera, T));
            Arena measure;
            BandMarker().place(measure, image.width, image.height);
            const Memory memory = aligned_memory(measure.used());
            Arena arena(memory.get(), measure.used());
            BandMarker marker;
            marker.place(arena, image.width, image.height);
            int slabs = 0;
            const auto have = marked(marker, depth.stage, T, options, round == 0 ? 7 : 4096, &slabs);
            const double voxel_m = static_cast<double>(config.voxel_m);
            const auto [must, may, must_by_groups, may_by_groups] =
                brute_force(depth.stage.image, T, options.integration.truncation, voxel_m,
                            {kMust, kMay, kMustByGroups, kMayByGroups});
            EXPECT_EQ(missing(must, have), 0u) << c.name << " round " << round << " of " << must.size();
            EXPECT_EQ(must.empty(), std::string(c.name) == "nothing");
            needed += must.size();
            marks += have.size();

            TestSession session(config);
            const FrameReport report = session.integrate(frame_of(image, camera, T));
            const auto touched = session.keys();
            EXPECT_EQ(report.chunks.fused, touched.size());
            EXPECT_EQ(report.chunks.dropped, 0u);
            const auto& required = GetParam() ? must : must_by_groups;
            const auto& allowed = GetParam() ? may : may_by_groups;
            EXPECT_EQ(missing(required, touched), 0u) << c.name << " round " << round;
            EXPECT_EQ(missing(touched, allowed), 0u) << c.name << " round " << round;
        }
    std::printf("%zu chunks touched, %zu marked (%.2f times)\n", needed, marks,
                static_cast<double>(marks) / static_cast<double>(needed));
    EXPECT_LT(marks, 4 * needed) << "a superset that tests far too much";
}

INSTANTIATE_TEST_SUITE_P(Truncation, Band, testing::Bool(),
                         [](const auto& models) { return models.param ? "Quadratic" : "Constant"; });

TEST(BandMarker, ADeepViewIsCutIntoSlabs) {
    // 7 m at 2 mm: some 400 chunks each way, dozens of grids. Sparse readings, so that the search stays
    // small.
    burin_config config = config_of(0.0025f, false);
    config.max_depth_m = 7;
    config.budget_bytes = 256u << 20;
    const FusionOptions options = options_of(config);
    const Camera camera = test_camera();
    Rng rng(22);
    for (int round = 0; round < 2; ++round) {
        Image<float> image(160, 120);
        for (int i = 0; i < 150; ++i)
            image.view().at(rng.below(160), rng.below(120)) = static_cast<float>(rng.uniform(0.2, 6.9));
        for (int x = 0; x < 160; x += 13) image.view().at(x, 0) = image.view().at(x, 119) = 6.9f;
        const Se3 T = random_pose(rng, 30);
        TestDepth depth(options.depth);
        depth.prepare(frame_of(image, camera, T));
        Arena measure;
        BandMarker().place(measure, image.width, image.height);
        const Memory memory = aligned_memory(measure.used());
        Arena arena(memory.get(), measure.used());
        BandMarker marker;
        marker.place(arena, image.width, image.height);
        int slabs = 0;
        const auto have = marked(marker, depth.stage, T, options, 4096, &slabs);
        EXPECT_GT(slabs, 5);
        const auto [must, may] = brute_force(depth.stage.image, T, options.integration.truncation,
                                             static_cast<double>(config.voxel_m), {kMust, kMay});
        EXPECT_GT(must.size(), 500u);
        EXPECT_EQ(missing(must, have), 0u) << "of " << must.size() << " in " << slabs << " slabs";
        TestSession session(config);
        session.integrate(frame_of(image, camera, T));
        EXPECT_EQ(missing(must, session.keys()), 0u);
        EXPECT_EQ(missing(session.keys(), may), 0u);
    }
}

}  // namespace
}  // namespace burin
