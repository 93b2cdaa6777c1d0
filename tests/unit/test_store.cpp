// SPDX-License-Identifier: MIT
// A map that does not fit its budget, with a store: bit for bit the map of a large budget.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>

#include "dataset_files.h"
#include "scene_helpers.h"

namespace burin {
namespace {

namespace fs = std::filesystem;
const Camera kCamera = test_camera();

// A hall of 12 x 12 m with a pillar in the middle and balls along the walls; the camera walks around the pillar
// once and a half, so that everything is seen again after it left the pool.
AnalyticScene hall() {
    AnalyticScene scene{{{{0, -1, 0}, -1.4}, {{0, 0, -1}, -6}, {{0, 0, 1}, -6}, {{-1, 0, 0}, -6}, {{1, 0, 0}, -6}},
                        {{{0, 0, 0}, 1.5}}};
    for (int i = 0; i < 12; ++i)
        scene.balls.push_back({{5.2 * std::cos(i * 0.52), 0.3 * (i % 3), 5.2 * std::sin(i * 0.52)}, 0.5});
    return scene;
}
constexpr int kFrames = 90;
Se3 walk(int i) {
    const double a = i * (1.5 * 6.2832) / kFrames;
    const Vec3d eye{3.6 * std::cos(a), 0.1 * std::sin(3 * a), 3.6 * std::sin(a)};
    return look_from(eye, eye + Vec3d{-std::sin(a) + 0.4 * std::cos(a), 0.15, std::cos(a) + 0.4 * std::sin(a)});
}

struct Sequence {
    std::vector<Image<float>> depth;
    std::vector<Image<std::uint8_t>> colour;
    Sequence() {
        Rng rng(80);
        for (int i = 0; i < kFrames; ++i) {
            AnalyticScene scene = hall();
            if (i > kFrames / 2) scene.balls.resize(5);  // what has gone is carved when it is seen again
            depth.push_back(scene.depth(kCamera, walk(i)));
            for (float& d : depth.back().pixels) d += static_cast<float>(0.02 * rng.normal());
            colour.emplace_back(160, 120, 3);
            for (std::uint8_t& c : colour.back().pixels) c = static_cast<std::uint8_t>(rng.below(256));
        }
    }
    FrameView view(int i) const {
        const auto k = static_cast<std::size_t>(i);
        FrameView v = frame_of(depth[k], kCamera, walk(i));
        v.colour = colour[k].view();
        v.colour_camera = kCamera;
        return v;
    }
};
const Sequence& sequence() {
    static const Sequence s;
    return s;
}

burin_config config_of(bool colour, std::uint32_t threads) {
    burin_config c = test_config(0.03f);
    c.budget_bytes = 256u << 20;
    c.colour = colour;
    c.threads = threads;
    c.store_chunks = 60000;
    return c;
}

std::uint64_t large_hash(bool colour) {
    static std::map<bool, std::uint64_t> known;
    if (!known.contains(colour)) {
        TestSession large(config_of(colour, 1));
        std::uint32_t dropped = 0;
        for (int i = 0; i < kFrames; ++i) dropped += large.integrate(sequence().view(i)).chunks.dropped;
        EXPECT_EQ(dropped, 0u);
        EXPECT_GT(large.volume().live(), 3000u);
        known[colour] = large.session.hash();
    }
    return known[colour];
}

TEST(Store, ASmallPoolGivesTheMapOfALargeOne) {
    const TempFolder folder;
    for (const bool colour : {true, false})
        for (const std::uint32_t capacity : {64u, 300u, 1000u, 2500u})
            for (const std::uint32_t threads : {1u, 3u}) {
                if (threads == 3 && capacity != 1000) continue;
                TestSession small(config_of(colour, threads), capacity);
                const std::string path = folder.path("store");
                ASSERT_TRUE(small.session.start_store().ok());
                const Status opened = small.session.open_store(path.c_str(), {});
                ASSERT_TRUE(opened.ok()) << opened.text();
                for (int i = 0; i < kFrames; ++i) {
                    const FrameReport r = small.integrate(sequence().view(i));
                    ASSERT_EQ(r.chunks.dropped, 0u) << "frame " << i << ", capacity " << capacity;
                    ASSERT_FALSE(r.store_full || r.store_failed);
                    ASSERT_LE(small.volume().live(), capacity);
                }
                const ChunkStore::Counts counts = small.session.store().counts();
                EXPECT_GT(counts.evicted, 500u) << capacity;
                EXPECT_GT(counts.reloaded, 500u) << capacity;
                EXPECT_EQ(small.session.hash(), large_hash(colour))
                    << "capacity " << capacity << ", " << threads << " threads";
                fs::remove(path);
            }
}

TEST(Store, WithoutAStoreAFullPoolDropsAndSaysSo) {
    TestSession full(config_of(true, 1), 1000);
    std::uint32_t dropped = 0;
    for (int i = 0; i < kFrames; ++i) dropped += full.integrate(sequence().view(i)).chunks.dropped;
    EXPECT_GT(dropped, 0u);
    EXPECT_EQ(full.volume().live(), 1000u);
}

}  // namespace
}  // namespace burin
