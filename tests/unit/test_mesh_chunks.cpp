// SPDX-License-Identifier: MIT
// Meshing chunk by chunk, as a renderer that follows along does, against the mesh of the whole map.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>

#include "scene_helpers.h"

namespace burin {
namespace {

using Corner = std::array<float, 3>;
using Triangle = std::array<Corner, 3>;

Corner corner(Vec3f p) { return {p.x, p.y, p.z}; }

// Triangles by the bits of their corners, rotated so that the least corner comes first: winding is kept.
std::vector<Triangle> sorted_triangles(const TriangleMesh& mesh) {
    std::vector<Triangle> all;
    for (const auto& t : mesh.triangles) {
        Triangle corners = {corner(mesh.positions[t[0]]), corner(mesh.positions[t[1]]),
                            corner(mesh.positions[t[2]])};
        std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
        all.push_back(corners);
    }
    std::sort(all.begin(), all.end());
    return all;
}

const Camera kCamera = test_camera();
constexpr ChangeRule kEvery{0, 1};

FrameView noisy_frame(int i, int n, Rng& rng, Image<float>* depth) {
    *depth = ball_and_wall().depth(kCamera, arc_pose(i, n));
    for (float& d : depth->pixels) d += static_cast<float>(0.01 * rng.normal());
    return frame_of(*depth, kCamera, arc_pose(i, n));
}

// As TestSession::chunk_mesh, but the chunk's mark stays.
TriangleMesh unmarked_mesh(const Volume& volume, ChunkKey key, const MeshOptions& options) {
    TriangleMesh m;
    m.positions.resize(kMaxChunkVertices);
    m.normals.resize(kMaxChunkVertices);
    m.triangles.resize(kMaxChunkTriangles);
    const MeshCounts counts =
        mesh_chunk(volume, Neighbourhood(volume, unpack_key(key)), options,
                   {&m.positions[0].x, &m.normals[0].x, nullptr, m.triangles[0].data()});
    m.positions.resize(counts.vertices);
    m.normals.resize(counts.vertices);
    m.triangles.resize(counts.triangles);
    return m;
}

TEST(ChunkMeshes, TogetherAreTheWholeMesh) {
    TestSession session(test_config());
    Rng rng(50);
    Image<float> depth;
    for (int i = 0; i < 5; ++i) session.integrate(noisy_frame(i, 5, rng, &depth));
    const MeshOptions options;
    const TriangleMesh whole = session.mesh(options);
    TriangleMesh all;
    std::map<Corner, Vec3f> normals;
    for (std::size_t i = 0; i < whole.positions.size(); ++i)
        normals[corner(whole.positions[i])] = whole.normals[i];
    std::size_t differing = 0;
    for (const ChunkKey key : session.keys()) {
        const TriangleMesh part = session.chunk_mesh(unpack_key(key), options);
        const auto first = static_cast<std::uint32_t>(all.positions.size());
        for (std::size_t i = 0; i < part.positions.size(); ++i) {
            const auto found = normals.find(corner(part.positions[i]));
            ASSERT_NE(found, normals.end()) << "a vertex that the whole mesh does not have, bit for bit";
            differing += !(found->second == part.normals[i]);
            all.positions.push_back(part.positions[i]);
        }
        for (const auto& t : part.triangles)
            all.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
    EXPECT_GT(whole.triangles.size(), 5000u);
    EXPECT_EQ(sorted_triangles(all), sorted_triangles(whole));
    EXPECT_EQ(differing, 0u) << "normals on chunk borders";
}

TEST(ChunkMeshes, DirtyChunksAreEnough) {
    TestSession session(test_config());
    Rng rng(51);
    const MeshOptions options;
    std::map<ChunkKey, TriangleMesh> kept;
    std::size_t redone = 0, in_all = 0;
    for (int i = 0; i < 8; ++i) {
        Image<float> depth;
        session.integrate(noisy_frame(i, 8, rng, &depth));
        std::vector<Vec3i> dirty;
        session.session.changed_chunks(
            kEvery, [&](std::uint64_t, Vec3i c) { dirty.push_back(c); }, 1u << 30);
        for (const Vec3i c : dirty) kept[pack_key(c)] = session.chunk_mesh(c, options);
        redone += dirty.size();
        in_all += session.volume().live();
        // What a renderer now has must be what it would have if it had asked for everything.
        for (const ChunkKey key : session.keys()) {
            const TriangleMesh now = session.chunk_mesh(unpack_key(key), options);
            ASSERT_EQ(kept[key].positions, now.positions) << "frame " << i;
            ASSERT_EQ(kept[key].triangles, now.triangles);
            ASSERT_EQ(kept[key].colours, now.colours);
            ASSERT_EQ(kept[key].normals, now.normals) << "frame " << i << ": normals are stale";
        }
        ASSERT_EQ(session.session.changed_chunks(
                      kEvery, [](std::uint64_t, Vec3i) {}, 0),
                  0u)
            << "nothing changed since";
    }
    EXPECT_LT(redone, in_all) << "everything is always dirty";
}

TEST(ChunkMeshes, DirtOfAFrameBetweenListAndMeshIsNotLost) {
    // The list is asked for, another frame comes in, then the listed chunks are meshed: what that frame
    // changed beside them must still be dirty. Both frames are patches of a wall, the second one shifted.
    const AnalyticScene wall{{{{0, 0, -1}, -1.5}}, {}};
    const MeshOptions options;
    std::size_t outdated = 0;
    for (int shift = -40; shift <= 40; shift += 4) {
        TestSession session(test_config());
        Rng rng(52);
        const auto integrate_patch = [&](int left, int right) {
            Image<float> depth = wall.depth(kCamera, {});
            for (int y = 0; y < 120; ++y)
                for (int x = 0; x < 160; ++x) {
                    float& d = depth.view().at(x, y);
                    d = x < left || x >= right ? 0 : d + static_cast<float>(0.01 * rng.normal());
                }
            session.integrate(frame_of(depth, kCamera, {}));
        };
        std::map<ChunkKey, TriangleMesh> kept;
        std::vector<Vec3i> dirty;
        const auto list = [&] {
            dirty.clear();
            session.session.changed_chunks(
                kEvery, [&](std::uint64_t, Vec3i c) { dirty.push_back(c); }, 1u << 30);
        };
        const auto mesh_listed = [&] {
            for (const Vec3i c : dirty) kept[pack_key(c)] = session.chunk_mesh(c, options);
        };
        integrate_patch(0, 160);
        list();
        mesh_listed();
        integrate_patch(60, 100);
        list();
        integrate_patch(60 + shift, 100 + shift);
        mesh_listed();
        list();
        std::set<ChunkKey> marked;
        for (const Vec3i c : dirty) marked.insert(pack_key(c));
        for (const ChunkKey key : session.keys()) {
            const TriangleMesh now = unmarked_mesh(session.volume(), key, options);
            if (kept[key].positions == now.positions && kept[key].normals == now.normals) continue;
            ASSERT_TRUE(marked.contains(key))
                << "shift " << shift << ": a mesh is out of date and not marked";
            ++outdated;
        }
    }
    EXPECT_GT(outdated, 100u);
}

TEST(ChunkMeshes, MarkOfOneChunkOnly) {
    TestSession session(test_config());
    Rng rng(53);
    Image<float> depth;
    session.integrate(noisy_frame(0, 3, rng, &depth));
    std::vector<Vec3i> dirty;
    EXPECT_EQ(session.session.changed_chunks(
                  kEvery, [&](std::uint64_t, Vec3i c) { dirty.push_back(c); }, 1u << 30),
              session.volume().live());
    EXPECT_TRUE(std::is_sorted(dirty.begin(), dirty.end(),
                               [](Vec3i a, Vec3i b) { return pack_key(a) < pack_key(b); }));
    session.chunk_mesh(dirty[5], {});
    std::vector<Vec3i> left;
    session.session.changed_chunks(
        kEvery, [&](std::uint64_t, Vec3i c) { left.push_back(c); }, 1u << 30);
    dirty.erase(dirty.begin() + 5);
    EXPECT_EQ(left, dirty);
    // One that is not there is an empty mesh, not an error.
    EXPECT_TRUE(session.chunk_mesh({9999, 0, 0}, {}).positions.empty());
}

TEST(ChunkMeshes, TheWorstChunkFitsTheStatedSize) {
    // Corners alternate: every edge crosses. And random ones, in search of more triangles.
    std::size_t most_vertices = 0, most_triangles = 0;
    for (int round = 0; round < 30; ++round) {
        TestVolume t({27, false, 0.01f, 0.04f});
        Rng rng(static_cast<std::uint64_t>(round));
        for (int z = 0; z < 2; ++z)
            for (int y = 0; y < 2; ++y)
                for (int x = 0; x < 2; ++x) {
                    ChunkGeometry& g = t.volume.geometry(t.chunk({x, y, z}));
                    for (int i = 0; i < kChunkVoxels; ++i) {
                        const int parity = ((i & 7) + (i >> 3 & 7) + (i >> 6)) & 1;
                        g.sdf[i] =
                            static_cast<std::int16_t>((round == 0 ? parity : rng.below(2)) ? 100 : -100);
                        g.weight[i] = 64;
                    }
                }
        std::vector<float> positions(3 * kMaxChunkVertices + 3, -7);
        std::vector<std::uint32_t> triangles(3 * kMaxChunkTriangles + 3, 77);
        const MeshCounts counts = mesh_chunk(t.volume, Neighbourhood(t.volume, {0, 0, 0}), {0.5f, 100},
                                             {positions.data(), nullptr, nullptr, triangles.data()});
        most_vertices = std::max(most_vertices, static_cast<std::size_t>(counts.vertices));
        most_triangles = std::max(most_triangles, static_cast<std::size_t>(counts.triangles));
        ASSERT_LE(counts.vertices, static_cast<std::uint64_t>(kMaxChunkVertices));
        ASSERT_LE(counts.triangles, static_cast<std::uint64_t>(kMaxChunkTriangles));
        for (std::uint64_t i = 0; i < 3 * counts.triangles; ++i) ASSERT_LT(triangles[i], counts.vertices);
        EXPECT_EQ(positions.back(), -7);
        EXPECT_EQ(triangles.back(), 77u);
    }
    EXPECT_EQ(most_vertices, static_cast<std::size_t>(kMaxChunkVertices))
        << "the bound is the checkerboard's";
    EXPECT_GT(most_triangles, 1000u);
}

}  // namespace
}  // namespace burin
