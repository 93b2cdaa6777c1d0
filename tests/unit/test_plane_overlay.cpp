// SPDX-License-Identifier: MIT
// What lies over the volume: entries that come and go, completed chunks that the volume does not have, and
// events that found no room.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "dataset_files.h"
#include "map/map_file.h"
#include "map/overlay.h"
#include "plane_scene.h"
#include "planes/plane_set.h"
#include "scene_helpers.h"

namespace burin {
namespace {

TEST(Overlay, EntriesComeAndGo) {
    constexpr std::uint32_t kRoom = 60;
    Overlay overlay;
    Arena measure;
    overlay.place(measure, kRoom);
    const auto memory = aligned_memory(measure.used());
    Arena arena(memory.get(), measure.used());
    overlay.place(arena, kRoom);
    overlay.clear();
    Rng rng(5);
    std::map<ChunkKey, std::int16_t> expected;  // what its geometry holds
    std::set<ChunkKey> alone;
    for (int step = 0; step < 20000; ++step) {
        const ChunkKey key = pack_key({rng.below(5), rng.below(5), rng.below(5)});
        if (rng.below(2)) {
            const std::uint32_t entry = overlay.insert(key);
            ASSERT_EQ(entry == kNoChunk, expected.size() == kRoom && !expected.contains(key));
            if (entry == kNoChunk) continue;
            const auto value = static_cast<std::int16_t>(rng.below(30000));
            expected[key] = overlay.geometry(entry).sdf[77] = value;
            const bool on = rng.below(2) != 0;
            overlay.set_alone(entry, on);
            on ? (void)alone.insert(key) : (void)alone.erase(key);
        } else if (const std::uint32_t entry = overlay.find(key); entry != kNoChunk) {
            overlay.remove(entry);
            expected.erase(key);
            alone.erase(key);
        }
        ASSERT_EQ(overlay.count(), expected.size());
        ASSERT_EQ(overlay.alone_count(), alone.size());
        if (step % 64 != 0) continue;
        for (int i = 0; i < 125; ++i) {
            const ChunkKey k = pack_key({i % 5, i / 5 % 5, i / 25});
            const std::uint32_t entry = overlay.find(k);
            ASSERT_EQ(entry != kNoChunk, expected.contains(k)) << step;
            if (entry == kNoChunk) continue;
            ASSERT_EQ(overlay.key(entry), k);
            ASSERT_EQ(overlay.geometry(entry).sdf[77], expected[k]);
            ASSERT_EQ(overlay.alone(entry), alone.contains(k));
        }
    }
}

TEST(PlaneSet, LostEventsAreToldOnce) {
    PlaneSet set;
    Arena measure;
    set.place(measure, 8, 2);
    const auto memory = aligned_memory(measure.used());
    Arena arena(memory.get(), measure.used());
    set.place(arena, 8, 2);
    set.clear();
    Scatter sums;
    sums.n = 3;
    sums.pp[0] = sums.pp[3] = 1;
    for (int i = 0; i < 5; ++i) set.create(sums, {0, 0, 1});
    PlaneEvent event;
    std::uint64_t lost = 0;
    EXPECT_EQ(set.take_events(&event, 1, &lost), 1u);
    EXPECT_EQ(lost, 3u);
    EXPECT_EQ(set.take_events(&event, 1, &lost), 1u);
    EXPECT_EQ(lost, 0u);
}

// A blind part of the floor, wider than chunks and what is seen beside them.
TEST(PlaneLayer, CompletedChunksAreListedUntilMeshed) {
    PlaneScene scene;
    scene.blind = true;
    scene.hole_low = {-0.8, 0.2, 0};
    scene.hole_high = {-0.1, 0.9, 0};
    TestSession t(plane_config());
    for (int i = 0; i < 100; ++i) {
        const Image<float> depth = scene.depth(test_camera(), walk_pose(i), i);
        t.integrate(frame_of(depth, test_camera(), walk_pose(i)));
    }
    const auto listed = [&] {
        std::vector<ChunkKey> keys;
        const auto put = [&](std::uint64_t, Vec3i c) { keys.push_back(pack_key(c)); };
        const std::uint64_t count = t.session.changed_chunks({0, 1}, put, 1 << 20);
        EXPECT_EQ(count, keys.size());
        EXPECT_TRUE(std::is_sorted(keys.begin(), keys.end()));
        EXPECT_EQ(std::set<ChunkKey>(keys.begin(), keys.end()).size(), keys.size());
        return keys;
    };
    const auto mesh_all = [&] {
        std::size_t triangles = 0, alone = 0;
        for (const ChunkKey key : listed()) {
            const std::size_t own = t.chunk_mesh(unpack_key(key), {}).triangles.size();
            if (t.volume().find(key) != kNoChunk) continue;
            ++alone;
            triangles += own;
        }
        return std::pair{alone, triangles};
    };
    EXPECT_EQ(mesh_all().first, 0u) << "nothing is completed yet";
    t.session.refresh_planes(t.jobs);
    const auto completed = mesh_all();
    EXPECT_GT(completed.first, 10u);
    EXPECT_GT(completed.second, 100u);
    EXPECT_TRUE(listed().empty());
    t.session.refresh_planes(t.jobs);
    EXPECT_EQ(mesh_all().first, 0u) << "nothing has changed";
}

// A map file keeps the cameras, whether planes were wanted or not: labels need them.
TEST(PlaneLayer, AMapFileKeepsTheCameras) {
    burin_config off = plane_config();
    off.planes = 0;
    TestSession with(plane_config()), without(off), loaded(plane_config());
    PlaneScene scene;
    for (int i = 0; i < 40; ++i) {
        const Image<float> depth = scene.depth(test_camera(), walk_pose(i), i);
        with.integrate(frame_of(depth, test_camera(), walk_pose(i)));
        without.integrate(frame_of(depth, test_camera(), walk_pose(i)));
    }
    const auto same = [](const MapCameras& a, const MapCameras& b) {
        return std::memcmp(&a, &b, sizeof a) == 0;
    };
    EXPECT_EQ(with.session.cameras().count, 40);
    EXPECT_TRUE(same(with.session.cameras(), without.session.cameras()));
    const TempFolder folder;
    const std::string path = folder.path("map.burin");
    MapFileHead head = {};
    head.frames = without.session.frames();
    head.cameras = without.session.cameras();
    ASSERT_TRUE(without.session.save(path.c_str(), head).ok());
    ASSERT_TRUE(read_map_head(path.c_str(), &head).ok());
    ASSERT_TRUE(loaded.session.load(path.c_str(), head).ok());
    EXPECT_TRUE(same(loaded.session.cameras(), with.session.cameras()));
    // What was told of the way up is kept for sure.
    loaded.session.planes().set_up({0, 0.6, 0.8});
    head.cameras = loaded.session.cameras();
    EXPECT_EQ(head.cameras.up_is_sure, 1);
    ASSERT_TRUE(loaded.session.save(path.c_str(), head).ok());
    ASSERT_TRUE(read_map_head(path.c_str(), &head).ok());
    ASSERT_TRUE(with.session.load(path.c_str(), head).ok());
    with.session.refresh_planes(with.jobs);
    EXPECT_EQ(with.session.planes().up(), (Vec3d{0, 0.6, 0.8}));
    // Cameras that cannot be are refused.
    for (const double count : {-1.0, std::nan("")}) {
        head.cameras.count = count;
        ASSERT_TRUE(with.session.save(path.c_str(), head).ok());
        EXPECT_FALSE(read_map_head(path.c_str(), &head).ok());
    }
}

}  // namespace
}  // namespace burin
