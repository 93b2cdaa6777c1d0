// SPDX-License-Identifier: MIT
// A map that does not fit its budget, with a store: bit for bit the map of a large budget.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "dataset_files.h"
#include "emulated.h"
#include "scene_helpers.h"

namespace burin {
namespace {

namespace fs = std::filesystem;
const Camera kCamera = test_camera();

// A hall of 12 x 12 m with a pillar in the middle and balls along the walls; the camera walks around the
// pillar once and a half, so that everything is seen again after it left the pool.
AnalyticScene hall() {
    AnalyticScene scene{
        {{{0, -1, 0}, -1.4}, {{0, 0, -1}, -6}, {{0, 0, 1}, -6}, {{-1, 0, 0}, -6}, {{1, 0, 0}, -6}},
        {{{0, 0, 0}, 1.5}}};
    for (int i = 0; i < 12; ++i)
        scene.balls.push_back({{5.2 * std::cos(i * 0.52), 0.3 * (i % 3), 5.2 * std::sin(i * 0.52)}, 0.5});
    return scene;
}
constexpr int kFrames = sized(90, 30);  // under emulation each stands for three
constexpr int frame_at(int of_90) { return of_90 * kFrames / 90; }
Se3 walk(int i) {
    const double a = i * (1.5 * 6.2832) / kFrames;
    const Vec3d eye{3.6 * std::cos(a), 0.1 * std::sin(3 * a), 3.6 * std::sin(a)};
    return look_from(eye,
                     eye + Vec3d{-std::sin(a) + 0.4 * std::cos(a), 0.15, std::cos(a) + 0.4 * std::sin(a)});
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

std::uint64_t api_walk(const ApiMap& map, int begin, int end) {
    std::uint32_t flags = 0;
    for (int i = begin; i < end; ++i) {
        const burin_frame frame = c_frame(sequence().view(i));
        burin_frame_result result{};
        EXPECT_EQ(burin_integrate(map.map, &frame, &result), BURIN_OK) << burin_last_error(map.map);
        flags |= result.flags;
    }
    EXPECT_EQ(flags, 0u);
    return map.hash();
}
using Triangles = std::multiset<std::vector<float>>;
Triangles all_triangles(const ApiMap& map) {  // by position, chunk by chunk
    std::uint64_t count = 0;
    burin_chunks(map.map, nullptr, 0, &count);
    std::vector<burin_chunk_key> keys(count);
    EXPECT_EQ(burin_chunks(map.map, keys.data(), count, &count), BURIN_OK);
    Triangles all;
    std::vector<float> p(3 * 1944);
    std::vector<std::uint32_t> t(3 * 2560);
    for (const burin_chunk_key& key : keys) {
        burin_mesh_buffers mesh{1944, 2560, p.data(), nullptr, nullptr, t.data(), 0, 0};
        EXPECT_EQ(burin_chunk_mesh(map.map, key, nullptr, &mesh), BURIN_OK);
        for (std::uint64_t i = 0; i < mesh.triangle_count; ++i) {
            std::vector<float> corners;
            for (std::uint64_t k = 3 * i; k < 3 * i + 3; ++k)
                corners.insert(corners.end(), &p[3 * t[k]], &p[3 * t[k]] + 3);
            all.insert(corners);
        }
    }
    return all;
}

// The same through the C interface: saving, listing, meshing, stopping and going on, resetting.
TEST(Store, TheWholeMapIsSavedMeshedAndResumed) {
    const TempFolder folder;
    burin_config config = config_of(true, 1);
    const ApiMap large(config);
    EXPECT_EQ(burin_store_commit(large.map), BURIN_STATE);
    api_walk(large, 0, kFrames);
    ASSERT_EQ(large.hash(), large_hash(true));

    config.budget_bytes = 8u << 20;
    const std::string path = folder.path("store");
    {
        const ApiMap small(config);
        EXPECT_EQ(burin_store_open(small.map, path.c_str(), 2), BURIN_INVALID_ARGUMENT);
        EXPECT_EQ(burin_store_open(small.map, nullptr, 0), BURIN_INVALID_ARGUMENT);
        ASSERT_EQ(burin_store_open(small.map, path.c_str(), BURIN_STORE_NEW), BURIN_OK);
        EXPECT_EQ(burin_store_open(small.map, path.c_str(), BURIN_STORE_NEW), BURIN_STATE);
        api_walk(small, frame_at(60), frame_at(81));
        ASSERT_EQ(burin_store_commit(small.map), BURIN_OK);
        ASSERT_EQ(burin_reset(small.map), BURIN_OK);
        EXPECT_EQ(small.stats().chunks_stored + small.stats().chunks_live, 0u);
        api_walk(small, 0, frame_at(51));
        ASSERT_EQ(burin_store_commit(small.map), BURIN_OK);
        api_walk(small, frame_at(51), frame_at(57));  // lost
    }
    const ApiMap small(config);
    ASSERT_EQ(burin_store_open(small.map, path.c_str(), BURIN_STORE_RESUME), BURIN_OK)
        << burin_last_error(small.map);
    EXPECT_EQ(small.stats().frames, static_cast<std::uint64_t>(frame_at(51)));
    EXPECT_EQ(small.stats().chunks_live, 0u);
    EXPECT_EQ(api_walk(small, frame_at(51), kFrames), large.hash());
    EXPECT_GT(small.stats().chunks_stored, 500u);
    EXPECT_EQ(small.stats().chunks_live + small.stats().chunks_stored, large.stats().chunks_live);
    for (int r = 0; r < 3; ++r) {
        EXPECT_EQ(small.stats().bounds_min_m[r], large.stats().bounds_min_m[r]);
        EXPECT_EQ(small.stats().bounds_max_m[r], large.stats().bounds_max_m[r]);
    }
    // The files differ in the configuration alone, in the head.
    ASSERT_EQ(burin_save(small.map, folder.path("small").c_str()), BURIN_OK) << burin_last_error(small.map);
    ASSERT_EQ(burin_save(large.map, folder.path("large").c_str()), BURIN_OK);
    EXPECT_EQ(read_bytes(folder.path("small")).substr(4096), read_bytes(folder.path("large")).substr(4096));
    std::string written;
    const auto append = [](void* user, const void* data, std::uint64_t bytes) {
        static_cast<std::string*>(user)->append(static_cast<const char*>(data), bytes);
        return 0;
    };
    ASSERT_EQ(burin_save_to(small.map, append, &written), BURIN_OK) << burin_last_error(small.map);
    EXPECT_TRUE(written == read_bytes(folder.path("small")));
    const ApiMap loaded(config_of(true, 1));
    ASSERT_EQ(burin_load(loaded.map, folder.path("small").c_str()), BURIN_OK) << burin_last_error(loaded.map);
    EXPECT_EQ(loaded.hash(), large.hash());
    const Triangles expected = all_triangles(large);
    EXPECT_GT(expected.size(), 10000u);
    EXPECT_TRUE(all_triangles(small) == expected);
    EXPECT_EQ(small.hash(), large.hash());
}

// Meshing a chunk brings its neighbours back. They must not count as changed for that, or meshing what has
// changed would never end.
TEST(Store, WhatComesBackUnchangedIsNotMeshedAgain) {
    const TempFolder folder;
    burin_config config = config_of(true, 1);
    config.budget_bytes = 8u << 20;
    const ApiMap small(config);
    ASSERT_EQ(burin_store_open(small.map, folder.path("store").c_str(), BURIN_STORE_NEW), BURIN_OK);
    burin_change_options every = burin_change_options_default();
    every.threshold_voxels = 0;
    every.interval = 1;
    std::vector<burin_chunk_key> keys(config.store_chunks);
    std::uint64_t count = 0, meshed = 0;
    const auto mesh_changed = [&] {
        EXPECT_EQ(burin_changed_chunks(small.map, &every, keys.data(), keys.size(), &count), BURIN_OK);
        std::vector<float> p(3 * 1944);
        std::vector<std::uint32_t> t(3 * 2560);
        for (std::uint64_t i = 0; i < count; ++i, ++meshed) {
            burin_mesh_buffers mesh{1944, 2560, p.data(), nullptr, nullptr, t.data(), 0, 0};
            EXPECT_EQ(burin_chunk_mesh(small.map, keys[i], nullptr, &mesh), BURIN_OK);
        }
    };
    for (int i = 0; i < frame_at(60); ++i) {
        api_walk(small, i, i + 1);
        mesh_changed();
    }
    ASSERT_GT(small.stats().chunks_stored, 500u);
    int rounds = 0;
    for (; count > 0 && rounds < 20; ++rounds) mesh_changed();
    EXPECT_EQ(count, 0u) << rounds << " rounds, " << meshed << " meshed";
    EXPECT_GT(meshed, 1000u);
}

TEST(Store, NeedsRoomInTheBudget) {
    const TempFolder folder;
    burin_config config = test_config();
    std::uint64_t without = 0, with = 0;
    ASSERT_EQ(burin_bytes(&config, &without), BURIN_OK);
    const ApiMap none(config);
    EXPECT_EQ(burin_store_open(none.map, folder.path("store").c_str(), BURIN_STORE_NEW), BURIN_STATE);
    EXPECT_FALSE(fs::exists(folder.path("store")));
    config.store_chunks = 50000;
    ASSERT_EQ(burin_bytes(&config, &with), BURIN_OK);
    EXPECT_LE(with, config.budget_bytes);
    const ApiMap some(config);
    EXPECT_LT(some.stats().chunks_capacity, none.stats().chunks_capacity);
    config.store_chunks = 1u << 28;
    EXPECT_EQ(burin_bytes(&config, &with), BURIN_INVALID_ARGUMENT);
}

}  // namespace
}  // namespace burin
