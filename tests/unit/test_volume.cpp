// SPDX-License-Identifier: MIT
// Keys, the hash table, and the byte budget.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "scene_helpers.h"

namespace burin {
namespace {

VolumeShape shape_of(std::uint32_t capacity, bool colour = true) { return {capacity, colour, 0.01f, 0.04f}; }

TEST(ChunkKeys, PackAndUnpackToTheLimits) {
    const std::int32_t most = kChunkLimit - 1;
    for (const Vec3i c :
         {Vec3i{0, 0, 0}, Vec3i{-1, -1, -1}, Vec3i{most, most, most}, Vec3i{-most, -most, -most},
          Vec3i{most, -most, 0}, Vec3i{1, 2, 3}, Vec3i{-kChunkLimit + 1, 7, kChunkLimit - 1}}) {
        EXPECT_EQ(unpack_key(pack_key(c)), c);
        EXPECT_TRUE(chunk_in_range(c));
        EXPECT_NE(pack_key(c), 0u);
        EXPECT_EQ(pack_key(c) >> 63, 0u);
    }
    EXPECT_FALSE(chunk_in_range({kChunkLimit, 0, 0}));
    EXPECT_FALSE(chunk_in_range({0, -kChunkLimit, 0}));
    EXPECT_FALSE(chunk_in_range({0, 0, kChunkLimit}));
}

TEST(ChunkKeys, SortLikeZYX) {
    Rng rng(1);
    std::vector<Vec3i> chunks;
    for (int i = 0; i < 1000; ++i) chunks.push_back({rng.below(9) - 4, rng.below(9) - 4, rng.below(9) - 4});
    for (int i = 0; i < 1000; ++i)
        for (int j = i + 1; j < 1000; j += 37) {
            const Vec3i a = chunks[static_cast<std::size_t>(i)], b = chunks[static_cast<std::size_t>(j)];
            EXPECT_EQ(pack_key(a) < pack_key(b), std::tuple(a.z, a.y, a.x) < std::tuple(b.z, b.y, b.x));
        }
}

TEST(Volume, FindsWhatWasInsertedAndNothingElse) {
    TestVolume t(shape_of(5000));
    Rng rng(2);
    std::map<ChunkKey, std::uint32_t> inserted;
    while (inserted.size() < 5000) {
        // A dense block, as surfaces are, and far-flung ones.
        const int reach = inserted.size() % 2 ? 20 : kChunkLimit;
        const Vec3i c = {rng.below(2 * reach - 1) - reach + 1, rng.below(2 * reach - 1) - reach + 1,
                         rng.below(2 * reach - 1) - reach + 1};
        const ChunkKey key = pack_key(c);
        if (inserted.contains(key)) continue;
        ASSERT_EQ(t.volume.find(key), kNoChunk);
        const std::uint32_t slot = t.volume.insert(key);
        ASSERT_EQ(slot, inserted.size());
        inserted[key] = slot;
    }
    EXPECT_EQ(t.volume.insert(pack_key({7777, 7777, 7777})), kNoChunk) << "full";
    EXPECT_EQ(t.volume.live(), 5000u);
    for (const auto& [key, slot] : inserted) {
        ASSERT_EQ(t.volume.find(key), slot);
        ASSERT_EQ(t.volume.key(slot), key);
    }
    for (int i = 0; i < 5000; ++i) {
        const ChunkKey key = pack_key({rng.below(90) - 45, rng.below(90) - 45, rng.below(90) - 45});
        if (!inserted.contains(key)) {
            ASSERT_EQ(t.volume.find(key), kNoChunk);
        }
    }
    std::vector<std::uint32_t> order(5000);
    t.volume.sorted_slots(order.data());
    auto expected = inserted.begin();
    for (const std::uint32_t slot : order) EXPECT_EQ(t.volume.key(slot), (expected++)->first);
}

TEST(Volume, WhatIsRemovedIsGoneAndTheRestIsFound) {
    Rng rng(5);
    TestVolume t(shape_of(300));
    std::map<ChunkKey, int> model;  // key -> what its voxels hold
    for (int step = 0; step < 60000; ++step) {
        const ChunkKey key = pack_key({rng.below(9) - 4, rng.below(9) - 4, rng.below(9) - 4});
        const std::uint32_t slot = t.volume.find(key);
        ASSERT_EQ(slot != kNoChunk, model.contains(key));
        // The filling swings between almost empty and full.
        const bool growing = step / 5000 % 2 == 0;
        if (slot == kNoChunk && rng.below(10) < (growing ? 9 : 2)) {
            const std::uint32_t fresh = t.volume.insert(key);
            ASSERT_EQ(fresh == kNoChunk, model.size() == 300);
            if (fresh == kNoChunk) continue;
            const int mark = rng.below(30000);
            model[key] = mark;
            t.volume.geometry(fresh).sdf[511] = static_cast<std::int16_t>(mark);
            t.volume.colour(fresh).rgbn[7][1] = static_cast<std::uint8_t>(mark);
            t.volume.last_seen(fresh) = static_cast<std::uint32_t>(mark);
            t.volume.least_distance(fresh) = static_cast<std::int16_t>(mark);
            t.volume.colour_readings(fresh) = static_cast<std::uint8_t>(mark);
            t.volume.flags(fresh) = static_cast<std::uint8_t>(mark & 7);
            t.volume.moved(fresh) = static_cast<std::uint16_t>(mark + 1);
            t.volume.mesh_lag(fresh) = static_cast<std::uint16_t>(mark + 2);
        } else if (slot != kNoChunk && rng.below(10) < (growing ? 2 : 9)) {
            t.volume.remove(slot);
            model.erase(key);
        }
        ASSERT_EQ(t.volume.live(), model.size());
        if (step % 97 != 0) continue;
        for (const auto& [k, mark] : model) {
            const std::uint32_t at = t.volume.find(k);
            ASSERT_LT(at, t.volume.live());
            ASSERT_EQ(t.volume.key(at), k);
            ASSERT_EQ(t.volume.geometry(at).sdf[511], mark);
            ASSERT_EQ(t.volume.colour(at).rgbn[7][1], static_cast<std::uint8_t>(mark));
            ASSERT_EQ(t.volume.last_seen(at), static_cast<std::uint32_t>(mark));
            ASSERT_EQ(t.volume.least_distance(at), mark);
            ASSERT_EQ(t.volume.colour_readings(at), static_cast<std::uint8_t>(mark));
            ASSERT_EQ(t.volume.flags(at), mark & 7);
            ASSERT_EQ(t.volume.moved(at), mark + 1);
            ASSERT_EQ(t.volume.mesh_lag(at), mark + 2);
        }
    }
}

TEST(Volume, NewChunksAreEmptyInUsedMemory) {
    TestVolume t(shape_of(64));
    for (int round = 0; round < 2; ++round) {  // the second time over what the first left
        for (int i = 0; i < 64; ++i) {
            const std::uint32_t slot = t.chunk({i, round, 0});
            for (int v = 0; v < kChunkVoxels; ++v) {
                ASSERT_EQ(t.volume.geometry(slot).weight[v], 0);
                ASSERT_EQ(t.volume.geometry(slot).sdf[v], 0);
                ASSERT_EQ(t.volume.colour(slot).rgbn[v][3], 0);
            }
            EXPECT_EQ(t.volume.flags(slot), kChunkDirty | kChunkUnfitted);
            std::memset(static_cast<void*>(&t.volume.geometry(slot)), 0x77, sizeof(ChunkGeometry));
            std::memset(static_cast<void*>(&t.volume.colour(slot)), 0x77, sizeof(ChunkColour));
        }
        t.volume.clear();
        EXPECT_EQ(t.volume.live(), 0u);
        EXPECT_EQ(t.volume.find(pack_key({3, round, 0})), kNoChunk);
    }
}

TEST(Volume, HashSeesEveryByteButNotTheOrder) {
    const auto fill = [](TestVolume& t, const std::vector<int>& order) {
        for (const int i : order) {
            const std::uint32_t slot = t.chunk({i, -i, 2 * i});
            for (int v = 0; v < kChunkVoxels; ++v) {
                t.volume.geometry(slot).sdf[v] = static_cast<std::int16_t>(i * 100 + v);
                t.volume.geometry(slot).weight[v] = static_cast<std::uint16_t>(v);
                t.volume.colour(slot).rgbn[v][1] = static_cast<std::uint8_t>(i);
            }
        }
    };
    TestVolume a(shape_of(64)), b(shape_of(900));
    fill(a, {1, 2, 3, 4, 5});
    fill(b, {4, 2, 5, 1, 3});
    std::uint32_t scratch[8];
    const std::uint64_t hash = a.volume.hash(scratch);
    EXPECT_EQ(b.volume.hash(scratch), hash) << "order of insertion or capacity";
    Rng rng(3);
    for (int i = 0; i < 500; ++i) {  // any bit of any chunk
        const std::uint32_t slot = static_cast<std::uint32_t>(rng.below(5));
        auto* bytes = rng.below(2) ? reinterpret_cast<unsigned char*>(&b.volume.geometry(slot))
                                   : reinterpret_cast<unsigned char*>(&b.volume.colour(slot));
        unsigned char& byte = bytes[rng.below(2048)];
        const auto bit = static_cast<unsigned char>(1 << rng.below(8));
        byte = static_cast<unsigned char>(byte ^ bit);
        ASSERT_NE(b.volume.hash(scratch), hash);
        byte = static_cast<unsigned char>(byte ^ bit);
    }
    EXPECT_EQ(b.volume.hash(scratch), hash);
    b.volume.insert(pack_key({9, 9, 9}));
    EXPECT_NE(b.volume.hash(scratch), hash) << "one more chunk, even an empty one";
}

// ------------------------------------------------------------------------------------------------------ the
// budget

// What one more chunk costs: voxels, key, last seen, least distance, flags, 1.5 table entries of 16 bytes,
// 192 edge rows with 2-byte ranks and four counts for meshing, two scratch indices; parts begin on 64 bytes,
// so ten may shift by 63.
constexpr std::uint64_t share(bool colour) {
    return 2048 + (colour ? 2048 : 0) + 8 + 4 + 2 + 1 + 24 + 192 + 384 + 16 + 8 + 10 * 63;
}

TEST(Budget, IsUsedToTheLastChunk) {
    Rng rng(4);
    for (int i = 0; i < 400; ++i) {
        burin_config c = burin_config_default();
        c.budget_bytes = i < 9 ? std::uint64_t{8} << 20 << (i % 6) : (8u << 20) + rng.next() % (248u << 20);
        c.colour = static_cast<std::uint32_t>(rng.below(2));
        c.bilateral = static_cast<std::uint32_t>(rng.below(2));
        c.angle_weight = static_cast<std::uint32_t>(rng.below(2));
        c.max_width = static_cast<std::uint32_t>(1 + rng.below(1000));
        c.max_height = static_cast<std::uint32_t>(1 + rng.below(1000));
        std::uint64_t bytes = 0;
        ASSERT_EQ(burin_bytes(&c, &bytes), BURIN_OK) << burin_last_error(burin_map{0, 0});
        ASSERT_LE(bytes, c.budget_bytes);
        ASSERT_LT(c.budget_bytes - bytes, share(c.colour != 0)) << "budget " << c.budget_bytes;
        // Exactly these bytes are a budget too, and give the same.
        burin_config exact = c;
        exact.budget_bytes = bytes;
        std::uint64_t again = 0;
        ASSERT_EQ(burin_bytes(&exact, &again), BURIN_OK);
        ASSERT_EQ(again, bytes);
    }
}

TEST(Budget, LeastBudgetIsTold) {
    burin_config c = test_config();
    c.budget_bytes = 1000;
    std::uint64_t bytes = 42, least = 0;
    EXPECT_EQ(burin_bytes(&c, &bytes), BURIN_INSUFFICIENT_MEMORY);
    EXPECT_EQ(bytes, 42u) << "set only on success";
    const std::string text = burin_last_error(burin_map{0, 0});
    const std::size_t at = text.find("at least ");
    ASSERT_NE(at, std::string::npos) << text;
    least = std::strtoull(text.c_str() + at + 9, nullptr, 10);
    c.budget_bytes = least;
    EXPECT_EQ(burin_bytes(&c, &bytes), BURIN_OK);
    EXPECT_EQ(bytes, least);
    const ApiMap map(c);
    EXPECT_EQ(map.stats().chunks_capacity, 64u);
    c.budget_bytes = least - 1;
    EXPECT_EQ(burin_bytes(&c, &bytes), BURIN_INSUFFICIENT_MEMORY);
}

TEST(Budget, FromEightToTwoHundredFiftySixMebibytes) {
    const AnalyticScene scene = ball_and_wall();
    const Camera camera = test_camera();
    std::uint64_t hash = 0;
    for (std::uint64_t mib = 8; mib <= 256; mib *= 2) {
        burin_config c = test_config(0.02f);
        c.budget_bytes = mib << 20;
        std::uint64_t bytes = 0;
        ASSERT_EQ(burin_bytes(&c, &bytes), BURIN_OK);
        burin_map map;
        // Not one byte less than was said, and none beside it touched.
        constexpr std::size_t kGuard = 4096;
        Memory memory = aligned_memory(bytes + 2 * kGuard);
        auto* raw = static_cast<unsigned char*>(memory.get());
        EXPECT_EQ(burin_create(&c, raw + kGuard, bytes - 1, &map), BURIN_INSUFFICIENT_MEMORY);
        ASSERT_EQ(burin_create(&c, raw + kGuard, bytes, &map), BURIN_OK);
        for (int i = 0; i < 6; ++i) {
            const Se3 T = arc_pose(i, 6);
            const Image<float> depth = scene.depth(camera, T);
            const burin_frame frame = c_frame(frame_of(depth, camera, T));
            burin_frame_result result;
            ASSERT_EQ(burin_integrate(map, &frame, &result), BURIN_OK);
            EXPECT_EQ(result.flags, 0u);
        }
        std::uint64_t vertices = 0, triangles = 0, got = 0;
        EXPECT_EQ(burin_mesh_size(map, nullptr, &vertices, &triangles), BURIN_OK);
        EXPECT_GT(triangles, 1000u);
        burin_statistics stats;
        EXPECT_EQ(burin_stats(map, &stats), BURIN_OK);
        EXPECT_EQ(stats.arena_bytes, bytes);
        EXPECT_GT(stats.chunks_capacity * std::uint64_t{4096}, bytes * 8 / 10 - (2u << 20))
            << "most of it is for voxels";
        EXPECT_EQ(burin_hash(map, &got), BURIN_OK);
        if (hash == 0) hash = got;
        EXPECT_EQ(got, hash) << mib << " MiB: the map depends on the budget";
        EXPECT_EQ(burin_destroy(&map), BURIN_OK);
        for (std::size_t i = 0; i < kGuard; ++i) {
            ASSERT_EQ(raw[i], 0xa5) << "before the arena";
            ASSERT_EQ(raw[kGuard + bytes + i], 0xa5) << "behind the arena";
        }
    }
}

}  // namespace
}  // namespace burin
