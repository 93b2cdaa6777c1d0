// SPDX-License-Identifier: MIT
// Many chunks' meshes in one call: those of burin_chunk_mesh one by one, whatever the threads, the buffers
// and where the chunks are.
#include <gtest/gtest.h>

#include <cstdio>
#include <string>
#include <vector>

#include "api_checks.h"
#include "dataset_files.h"
#include "scene_helpers.h"

namespace burin {
namespace {

struct Part {
    std::vector<float> positions, normals;
    std::vector<std::uint8_t> colours;
    std::vector<std::uint32_t> triangles;
    bool operator==(const Part&) const = default;
};

// Buffers of a size, and what a call leaves in them.
struct Buffers {
    Buffers(std::uint64_t vertices, std::uint64_t triangles_)
        : positions(3 * vertices),
          normals(3 * vertices),
          colours(3 * vertices),
          triangles(3 * triangles_),
          mesh{vertices, triangles_, positions.data(), normals.data(), colours.data(), triangles.data(),
               0,        0} {}
    Part part(const burin_mesh_range& r) const {
        const auto cut = [](const auto& all, std::uint64_t first, std::uint64_t count) {
            return std::remove_cvref_t<decltype(all)>(
                all.begin() + static_cast<std::ptrdiff_t>(3 * first),
                all.begin() + static_cast<std::ptrdiff_t>(3 * (first + count)));
        };
        return {cut(positions, r.first_vertex, r.vertex_count), cut(normals, r.first_vertex, r.vertex_count),
                cut(colours, r.first_vertex, r.vertex_count),
                cut(triangles, r.first_triangle, r.triangle_count)};
    }
    std::vector<float> positions, normals;
    std::vector<std::uint8_t> colours;
    std::vector<std::uint32_t> triangles;
    burin_mesh_buffers mesh;
};

constexpr std::uint64_t kVertices = 1944, kTriangles = 2560;  // the largest chunk (burin.h)

class ManyChunks : public testing::Test {
  protected:
    void fuse(const ApiMap& map, int frames = 3) const {
        for (int i = 0; i < frames; ++i) {
            const Se3 T = arc_pose(i, frames);
            const Image<float> depth = ball_and_wall().depth(camera_, T);
            burin_frame frame = c_frame(frame_of(depth, camera_, T));
            frame.colour = colour_.pixels.data();
            frame.colour_stride_bytes = 480;
            frame.colour_camera = c_camera(camera_);
            ASSERT_EQ(burin_integrate(map.map, &frame, nullptr), BURIN_OK) << burin_last_error(map.map);
        }
    }
    static std::vector<burin_chunk_key> keys_of(const ApiMap& map) {
        std::vector<burin_chunk_key> keys(100000);
        std::uint64_t count = 0;
        EXPECT_EQ(burin_chunks(map.map, keys.data(), keys.size(), &count), BURIN_OK);
        keys.resize(count);
        return keys;
    }
    static std::vector<Part> one_by_one(const ApiMap& map, const std::vector<burin_chunk_key>& keys) {
        std::vector<Part> parts;
        Buffers buffers(kVertices, kTriangles);
        for (const burin_chunk_key key : keys) {
            EXPECT_EQ(burin_chunk_mesh(map.map, key, nullptr, &buffers.mesh), BURIN_OK)
                << burin_last_error(map.map);
            parts.push_back(buffers.part({0, buffers.mesh.vertex_count, 0, buffers.mesh.triangle_count}));
        }
        return parts;
    }
    // Through buffers of a size, in as many calls as it takes.
    static std::vector<Part> together(const ApiMap& map, const std::vector<burin_chunk_key>& keys,
                                      Buffers& buffers, int* calls = nullptr) {
        std::vector<Part> parts;
        std::vector<burin_mesh_range> ranges(keys.size());
        for (std::uint64_t first = 0, done = 0; first < keys.size(); first += done) {
            EXPECT_EQ(burin_chunk_meshes(map.map, keys.data() + first, keys.size() - first, nullptr,
                                         &buffers.mesh, ranges.data(), &done),
                      BURIN_OK)
                << burin_last_error(map.map);
            if (done == 0) return parts;
            std::uint64_t vertices = 0, triangles = 0;
            for (std::uint64_t i = 0; i < done; ++i) {
                EXPECT_EQ(ranges[i].first_vertex, vertices) << "one behind the other";
                EXPECT_EQ(ranges[i].first_triangle, triangles);
                vertices += ranges[i].vertex_count;
                triangles += ranges[i].triangle_count;
                parts.push_back(buffers.part(ranges[i]));
            }
            EXPECT_EQ(buffers.mesh.vertex_count, vertices);
            EXPECT_EQ(buffers.mesh.triangle_count, triangles);
            if (calls) ++*calls;
        }
        return parts;
    }

    const Camera camera_ = test_camera();
    const Image<std::uint8_t> colour_{160, 120, 3, 90};
};

TEST_F(ManyChunks, AreThoseOfTheChunksOneByOne) {
    for (const std::uint32_t threads : {1u, 3u}) {
        burin_config config = test_config();
        config.threads = threads;
        const ApiMap map(config);
        fuse(map);
        std::vector<burin_chunk_key> keys = keys_of(map);
        ASSERT_GT(keys.size(), 300u) << "more than are meshed at once";
        keys.insert(keys.begin() + 7, {9999, 0, 0});  // not there
        keys.push_back(keys[3]);                      // a second time
        const std::vector<Part> expected = one_by_one(map, keys);
        Buffers whole(200000, 400000), small(2 * kVertices, 2 * kTriangles);
        int calls = 0;
        EXPECT_TRUE(together(map, keys, whole, &calls) == expected);
        EXPECT_EQ(calls, 1);
        calls = 0;
        EXPECT_TRUE(together(map, keys, small, &calls) == expected);
        EXPECT_GT(calls, 5);
    }
}

TEST_F(ManyChunks, ThoseThatFittedLeaveTheList) {
    const ApiMap map(test_config());
    fuse(map, 1);
    std::vector<burin_chunk_key> listed(100000);
    std::uint64_t count = 0, left = 0, done = 0;
    ASSERT_EQ(burin_dirty_chunks(map.map, listed.data(), listed.size(), &count), BURIN_OK);
    std::vector<burin_mesh_range> ranges(count);
    Buffers buffers(2 * kVertices, 2 * kTriangles);
    ASSERT_EQ(burin_chunk_meshes(map.map, listed.data(), count, nullptr, &buffers.mesh, ranges.data(), &done),
              BURIN_OK);
    ASSERT_GT(done, 1u);
    ASSERT_LT(done, count);
    std::vector<burin_chunk_key> later(100000);
    ASSERT_EQ(burin_dirty_chunks(map.map, later.data(), later.size(), &left), BURIN_OK);
    EXPECT_EQ(left, count - done);
    EXPECT_EQ(later[0].x, listed[done].x);
    EXPECT_EQ(later[0].y, listed[done].y);
    EXPECT_EQ(later[0].z, listed[done].z);
}

TEST_F(ManyChunks, ComeBackFromTheStore) {
    const TempFolder folder;
    burin_config config = test_config(0.02f);
    const ApiMap large(config);
    fuse(large, 6);
    config.store_chunks = 5000;
    config.budget_bytes = 4u << 20;
    const ApiMap small(config);
    ASSERT_EQ(burin_store_open(small.map, folder.path("store").c_str(), BURIN_STORE_NEW), BURIN_OK);
    fuse(small, 6);
    ASSERT_GT(small.stats().chunks_stored, 0u);
    const std::vector<burin_chunk_key> keys = keys_of(large);
    const std::vector<Part> expected = one_by_one(large, keys);
    Buffers whole(400000, 800000), little(3 * kVertices, 3 * kTriangles);
    EXPECT_TRUE(together(small, keys, whole) == expected);
    EXPECT_TRUE(together(small, keys, little) == expected);
    EXPECT_EQ(small.hash(), large.hash());
}

TEST_F(ManyChunks, BadUseChangesNothing) {
    const ApiMap map(test_config());
    fuse(map, 1);
    const std::vector<burin_chunk_key> keys = keys_of(map);
    std::vector<burin_mesh_range> ranges(keys.size());
    Buffers buffers(kVertices, kTriangles), none(3, 1);
    std::uint64_t done = 5, listed = 0, again = 0;
    std::vector<burin_chunk_key> list(100000);
    ASSERT_EQ(burin_dirty_chunks(map.map, list.data(), list.size(), &listed), BURIN_OK);
    const auto call = [&](const burin_chunk_key* k, std::uint64_t n, burin_mesh_buffers* m,
                          burin_mesh_range* r,
                          std::uint64_t* d) { return burin_chunk_meshes(map.map, k, n, nullptr, m, r, d); };
    EXPECT_EQ(call(nullptr, 1, &buffers.mesh, ranges.data(), &done), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(call(keys.data(), 1, nullptr, ranges.data(), &done), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(call(keys.data(), 1, &buffers.mesh, nullptr, &done), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(call(keys.data(), 1, &buffers.mesh, ranges.data(), nullptr), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(burin_chunk_meshes(kNull, keys.data(), 1, nullptr, &buffers.mesh, ranges.data(), &done),
              BURIN_STATE);
    std::vector<burin_chunk_key> bad = keys;
    bad.back() = {1 << 20, 0, 0};
    EXPECT_EQ(call(bad.data(), bad.size(), &buffers.mesh, ranges.data(), &done), BURIN_INVALID_ARGUMENT);
    EXPECT_EQ(call(nullptr, 0, &buffers.mesh, nullptr, &done), BURIN_OK);
    EXPECT_EQ(done, 0u);
    // The first chunk with surface, into buffers that are too small for any.
    std::uint64_t first = 0;
    while (one_by_one(map, {keys[first]})[0].triangles.empty()) ++first;
    EXPECT_EQ(call(keys.data() + first, 1, &none.mesh, ranges.data(), &done), BURIN_INSUFFICIENT_MEMORY);
    EXPECT_EQ(done, 0u);
    EXPECT_GT(none.mesh.vertex_count, 3u);
    EXPECT_NE(std::string(burin_last_error(map.map)).find("are needed"), std::string::npos);
    ASSERT_EQ(burin_dirty_chunks(map.map, list.data(), list.size(), &again), BURIN_OK);
    EXPECT_LE(again, listed);
}

}  // namespace
}  // namespace burin
