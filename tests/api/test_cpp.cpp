// SPDX-License-Identifier: MIT
// burin.hpp against what the C interface gives for the same frames.
#include <gtest/gtest.h>
#include <burin/burin.hpp>

#include <cstring>
#include <type_traits>
#include <vector>

#include "api_checks.h"
#include "scene_helpers.h"

burin_status in_cpp17(const burin_config& config, const burin_frame& frame, std::uint64_t* triangles);

namespace burin {
namespace {

static_assert(!std::is_copy_constructible_v<Map> && !std::is_copy_assignable_v<Map>);
static_assert(std::is_nothrow_move_constructible_v<Map> && std::is_nothrow_move_assignable_v<Map>);

class Cpp : public testing::Test {
  protected:
    const Camera camera_ = test_camera();
    Image<float> depth_ = ball_and_wall().depth(camera_, arc_pose(0, 3));
    burin_frame frame_ = c_frame(frame_of(depth_, camera_, arc_pose(0, 3)));
};

TEST_F(Cpp, TheSameAsInC) {
    const ApiMap c(test_config());
    ASSERT_EQ(burin_integrate(c.map, &frame_, nullptr), BURIN_OK);
    Map map;
    EXPECT_FALSE(map);
    ASSERT_EQ(map.create(test_config()), BURIN_OK) << map.last_error();
    burin_frame_result result;
    ASSERT_EQ(map.integrate(frame_, &result), BURIN_OK) << map.last_error();
    std::uint64_t hash = 0;
    ASSERT_EQ(map.hash(hash), BURIN_OK);
    EXPECT_EQ(hash, c.hash());

    std::uint64_t vertices = 0, triangles = 0, in_17 = 0;
    ASSERT_EQ(burin_mesh_size(c.map, nullptr, &vertices, &triangles), BURIN_OK);
    Mesh mesh;
    ASSERT_EQ(map.mesh(mesh), BURIN_OK);
    EXPECT_EQ(mesh.vertex_count(), vertices);
    EXPECT_EQ(mesh.triangle_count(), triangles);
    ASSERT_EQ(in_cpp17(test_config(), frame_, &in_17), BURIN_OK);
    EXPECT_EQ(in_17, triangles);

    Array<burin_chunk_key> keys;
    burin_change_options every = burin_change_options_default();
    every.threshold_voxels = 0;
    every.interval = 1;
    ASSERT_EQ(map.changed_chunks(keys), BURIN_OK);
    EXPECT_GT(keys.size(), 0u);
    EXPECT_LE(keys.size(), result.chunks_new);
    ASSERT_EQ(map.changed_chunks(keys, every), BURIN_OK);
    EXPECT_EQ(keys.size(), result.chunks_new);
    std::uint64_t sum = 0;
    Mesh part;
    for (const burin_chunk_key& key : keys) {
        ASSERT_EQ(map.chunk_mesh(key, part), BURIN_OK);
        sum += part.triangle_count();
    }
    EXPECT_EQ(sum, triangles);
    std::uint64_t done = 0;
    Array<burin_mesh_range> ranges;
    ASSERT_EQ(part.resize(3 * triangles, triangles), BURIN_OK);
    burin_mesh_buffers all = part.buffers(3 * triangles, triangles);
    ASSERT_EQ(map.chunk_meshes(keys, all, ranges, done), BURIN_OK);
    EXPECT_EQ(done, keys.size());
    EXPECT_EQ(all.triangle_count, triangles);
    ASSERT_EQ(map.changed_chunks(keys, every), BURIN_OK);
    EXPECT_TRUE(keys.empty());

    ASSERT_EQ(mesh.remove_small(triangles + 1), BURIN_OK);
    EXPECT_EQ(mesh.triangle_count(), 0u);

    std::vector<float> depth(160 * 120), distance(1);
    ASSERT_EQ(map.raycast(frame_.depth_camera, frame_.T_world_camera, depth.data()), BURIN_OK);
    EXPECT_GT(depth[60 * 160 + 80], 0.5f);
    const double point[3] = {9, 9, 9};
    ASSERT_EQ(map.sample(point, 1, distance.data()), BURIN_OK);
    EXPECT_TRUE(std::isnan(distance[0]));
}

TEST_F(Cpp, MovesAndSaves) {
    Map first;
    ASSERT_EQ(first.create(test_config()), BURIN_OK);
    ASSERT_EQ(first.integrate(frame_), BURIN_OK);
    std::uint64_t hash = 0, loaded = 0;
    ASSERT_EQ(first.hash(hash), BURIN_OK);
    const burin_map handle = first.handle();
    Map second = std::move(first);
    EXPECT_FALSE(first);  // NOLINT: what a moved-from map is, is stated
    EXPECT_EQ(second.handle().index, handle.index);
    EXPECT_EQ(first.hash(loaded), BURIN_STATE);

    std::vector<char> bytes;
    std::size_t at = 0;
    ASSERT_EQ(second.save_to([&](const void* data, std::uint64_t n) {
        bytes.insert(bytes.end(), static_cast<const char*>(data), static_cast<const char*>(data) + n);
        return 0;
    }),
              BURIN_OK);
    const auto read = [&](void* data, std::uint64_t n) {
        if (at + n > bytes.size()) return 1;
        std::memcpy(data, bytes.data() + at, n);
        at += n;
        return 0;
    };
    ASSERT_EQ(first.create(test_config()), BURIN_OK);
    ASSERT_EQ(first.load_from(read), BURIN_OK) << first.last_error();
    ASSERT_EQ(first.hash(loaded), BURIN_OK);
    EXPECT_EQ(loaded, hash);
    EXPECT_EQ(first.load_from(read), BURIN_IO) << "there are no more";

    second = std::move(first);  // destroys the one that was there
    std::uint64_t stale = 0;
    EXPECT_EQ(burin_hash(handle, &stale), BURIN_STATE);
    ASSERT_EQ(second.create(test_config()), BURIN_OK);  // again, in place
    burin_statistics stats;
    ASSERT_EQ(second.stats(stats), BURIN_OK);
    EXPECT_EQ(stats.chunks_live, 0u);
}

TEST_F(Cpp, StatusesAreThoseOfC) {
    const burin_config config = test_config();
    std::uint64_t bytes = 0;
    ASSERT_EQ(burin_bytes(&config, &bytes), BURIN_OK);
    const Memory memory = aligned_memory(bytes);  // outlives the map
    Map map;
    burin_config bad = test_config();
    bad.voxel_m = 0;
    EXPECT_EQ(map.create(bad), BURIN_INVALID_ARGUMENT);
    EXPECT_NE(std::strstr(map.last_error(), "voxel_m"), nullptr);
    EXPECT_FALSE(map);
    EXPECT_EQ(map.destroy(), BURIN_OK);
    EXPECT_EQ(map.reset(), BURIN_STATE);
    Mesh mesh;
    EXPECT_EQ(map.mesh(mesh), BURIN_STATE);
    EXPECT_EQ(map.load("there is none"), BURIN_STATE);

    EXPECT_EQ(map.create(config, memory.get(), bytes - 1), BURIN_INSUFFICIENT_MEMORY);
    ASSERT_EQ(map.create(config, memory.get(), bytes), BURIN_OK);
    EXPECT_EQ(map.load("there is none"), BURIN_IO);
    burin_frame frame = frame_;
    frame.depth = nullptr;
    EXPECT_EQ(map.integrate(frame), BURIN_INVALID_ARGUMENT);
    EXPECT_NE(std::strstr(map.last_error(), "depth is null"), nullptr);

    // From within its own callback a map stays.
    burin_hooks hooks = burin_hooks_default();
    hooks.user = &map;
    hooks.progress = [](void* user, double) -> int {
        return static_cast<Map*>(user)->destroy() == BURIN_STATE ? 0 : 1;
    };
    ASSERT_EQ(map.set_hooks(hooks), BURIN_OK);
    ASSERT_EQ(map.integrate(frame_), BURIN_OK);
    EXPECT_EQ(map.mesh(mesh), BURIN_OK);
    EXPECT_GT(mesh.triangle_count(), 100u);
}

}  // namespace
}  // namespace burin
