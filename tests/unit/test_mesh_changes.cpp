// SPDX-License-Identifier: MIT
// Which chunks are listed to be meshed again, when, and for how long a mesh can be out of date.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "dataset_files.h"
#include "scene_helpers.h"

namespace burin {
namespace {

const Camera kCamera = test_camera();

// A camera that stands still before a wall; `noise` in metres.
class Stream {
  public:
    Stream(const ChangeRule& change_rule, double noise, std::uint32_t threads = 1)
        : rule(change_rule), noise_(noise), rng_(60) {
        burin_config config = test_config();
        config.threads = threads;
        test = std::make_unique<TestSession>(config);
    }
    void integrate(double wall_m = 1.5) {
        Image<float> depth = AnalyticScene{{{{0, 0, -1}, -wall_m}}, {}}.depth(kCamera, {});
        for (float& d : depth.pixels) d += static_cast<float>(noise_ * rng_.normal());
        test->integrate(frame_of(depth, kCamera, {}));
    }
    std::vector<ChunkKey> list() {
        std::vector<ChunkKey> keys;
        test->session.changed_chunks(
            rule, [&](std::uint64_t, Vec3i c) { keys.push_back(pack_key(c)); }, 1u << 30);
        return keys;
    }
    void mesh(const std::vector<ChunkKey>& keys) {
        for (const ChunkKey key : keys) kept[key] = test->chunk_mesh(unpack_key(key), {});
    }
    // What a chunk's mesh is behind by, as far as its own voxels tell.
    int behind(std::uint32_t slot) const {
        return add_saturated(test->volume().mesh_lag(slot), test->volume().moved(slot));
    }
    int threshold() const {
        const Volume& v = test->volume();
        return static_cast<int>(rule.threshold_voxels * v.voxel_m() / v.units_to_m());
    }

    ChangeRule rule;
    std::unique_ptr<TestSession> test;
    std::map<ChunkKey, TriangleMesh> kept;

  private:
    double noise_;
    Rng rng_;
};

TEST(MeshChanges, NewSurfaceIsListedAtOnce) {
    Stream s({0.05f, 1000}, 0);
    s.integrate();
    const std::vector<ChunkKey> listed = s.list();
    EXPECT_TRUE(std::is_sorted(listed.begin(), listed.end()));
    EXPECT_EQ(s.list(), listed) << "until they are meshed";
    EXPECT_LT(listed.size(), s.test->volume().live()) << "chunks of free space are not";
    s.mesh(listed);
    for (const ChunkKey key : s.test->keys()) {
        const bool surface = !s.test->chunk_mesh(unpack_key(key), {}).positions.empty();
        EXPECT_TRUE(!surface || s.kept.contains(key)) << "surface that was not listed";
    }
}

TEST(MeshChanges, AStillSurfaceKeepsItsMesh) {
    Stream s({0.05f, 2}, 0);
    std::size_t listed = 0;
    for (int i = 0; i < 40; ++i) {
        s.integrate();
        const auto keys = s.list();
        if (i > 0) listed += keys.size();
        s.mesh(keys);
    }
    // Every eighth turn, so every 16th frame; and once for what neighbours told when they were first meshed.
    EXPECT_GT(listed, 0u) << "what the measure does not see must come through";
    EXPECT_LT(listed, 5u * s.test->volume().live());
}

TEST(MeshChanges, NoMeshIsBehindForMoreThanAnInterval) {
    Stream s({0.05f, 6}, 0.02);
    std::map<ChunkKey, int> late;
    std::size_t listed = 0;
    int longest = 0;
    constexpr int kFrames = 40;
    for (int i = 0; i < kFrames; ++i) {
        s.integrate(i < 20 ? 1.5 : 1.51);
        const auto keys = s.list();
        if (i > 0) listed += keys.size();
        s.mesh(keys);
        for (std::uint32_t slot = 0; slot < s.test->volume().live(); ++slot) {
            int& frames = late[s.test->volume().key(slot)];
            // Chunks without surface do not hear from their neighbours, but they are listed for what is their
            // own.
            frames = s.behind(slot) > s.threshold() ? frames + 1 : 0;
            longest = std::max(longest, frames);
        }
    }
    EXPECT_LT(longest, 6);
    EXPECT_GT(longest, 2) << "nothing waited: the test shows nothing";
    EXPECT_LT(listed, kFrames * s.test->volume().live() / 4) << "a sixth of the chunks a frame";
}

TEST(MeshChanges, BelowTheThresholdNothingMoves) {
    // Until its turn comes, no vertex of a kept mesh is off by more than its chunk is said to be behind.
    Stream s({0.5f, 3}, 0.004);
    int compared = 0;
    for (int i = 0; i < 25; ++i) {
        s.integrate();
        s.mesh(s.list());
        const Volume& v = s.test->volume();
        for (std::uint32_t slot = 0; slot < v.live(); ++slot) {
            const auto old = s.kept.find(v.key(slot));
            if (old == s.kept.end()) continue;
            TriangleMesh now;
            now.positions.resize(kMaxChunkVertices);
            now.triangles.resize(kMaxChunkTriangles);
            const MeshCounts counts =
                mesh_chunk(v, Neighbourhood(v, unpack_key(v.key(slot))), {},
                           {&now.positions[0].x, nullptr, nullptr, now.triangles[0].data()});
            if (counts.vertices != old->second.positions.size()) continue;  // a crossing came or went
            // A frontal wall: depth is the distance, and a chunk beside may be behind as well.
            float allowed = 1e-6f;
            for (const std::uint32_t beside : Neighbourhood(v, unpack_key(v.key(slot))).slot)
                if (beside != kNoChunk)
                    allowed = std::max(
                        allowed, static_cast<float>(s.behind(beside) + s.behind(slot)) * v.units_to_m());
            for (std::size_t k = 0; k < counts.vertices; ++k) {
                ASSERT_LE(std::fabs(now.positions[k].z - old->second.positions[k].z), 1.5f * allowed) << i;
                ++compared;
            }
        }
    }
    EXPECT_GT(compared, 10000);
}

TEST(MeshChanges, DoNotDependOnThreads) {
    std::vector<std::vector<ChunkKey>> first;
    for (const std::uint32_t threads : {1u, 3u}) {
        Stream s({0.05f, 5}, 0.01, threads);
        std::vector<std::vector<ChunkKey>> all;
        for (int i = 0; i < 12; ++i) {
            s.integrate();
            all.push_back(s.list());
            s.mesh(all.back());
        }
        if (first.empty()) first = all;
        EXPECT_EQ(all, first);
    }
}

}  // namespace
}  // namespace burin
