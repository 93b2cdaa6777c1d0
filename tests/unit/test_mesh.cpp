// SPDX-License-Identifier: MIT
// Marching cubes over whole volumes: topology, accuracy, options, order, small components.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "eval/mesh_topology.h"
#include "mesh/mesher.h"
#include "scene_helpers.h"

namespace burin {
namespace {

TriangleMesh mesh_of(const Volume& volume, const MeshOptions& options, int threads = 1) {
    Jobs jobs(threads);
    Arena measure;
    Mesher().place(measure, volume.shape().capacity);
    const Memory memory = aligned_memory(measure.used());
    Arena arena(memory.get(), measure.used());
    Mesher mesher;
    mesher.place(arena, volume.shape().capacity);
    const MeshCounts counts = mesher.count(volume, options, jobs);
    TriangleMesh m;
    m.positions.resize(counts.vertices);
    m.normals.resize(counts.vertices);
    m.colours.resize(counts.vertices);
    m.triangles.resize(counts.triangles);
    if (counts.vertices > 0)
        mesher.extract(volume, options,
                       {&m.positions[0].x, &m.normals[0].x, m.colours[0].data(), m.triangles[0].data()},
                       jobs);
    return m;
}

MeshTopology topology_of(const TriangleMesh& mesh) {
    const auto t = check_topology(mesh);
    EXPECT_TRUE(t.ok()) << t.status().text();
    return t.ok() ? *t : MeshTopology{};
}

void expect_clean(const TriangleMesh& mesh) {
    const MeshTopology t = topology_of(mesh);
    EXPECT_EQ(t.duplicate_vertices, 0);
    EXPECT_EQ(t.unreferenced_vertices, 0);
    EXPECT_EQ(t.degenerate_triangles, 0);
    EXPECT_EQ(t.non_manifold_edges, 0);
    EXPECT_EQ(t.inconsistent_edges, 0);
}

// Six times the signed volume: positive when triangles run counter-clockwise seen from outside.
double volume_of(const TriangleMesh& mesh) {
    double sum = 0;
    for (const auto& t : mesh.triangles)
        sum += dot(to_double(mesh.positions[t[0]]),
                   cross(to_double(mesh.positions[t[1]]), to_double(mesh.positions[t[2]]))) /
               6;
    return sum;
}

constexpr VolumeShape kShape{800, true, 0.01f, 0.04f};
constexpr MeshOptions kAny{0.5f, 100.0f};  // noise is all jumps

TEST(Mesh, ASphere) {
    TestVolume t(kShape);
    const Vec3d centre{0.013, -0.021, 0.034};  // across chunk borders, off every symmetry
    const double radius = 0.2;
    t.fill({-4, -4, -4}, {3, 3, 3}, [&](Vec3d p) { return norm(p - centre) - radius; });
    const TriangleMesh mesh = mesh_of(t.volume, {});
    expect_clean(mesh);
    EXPECT_TRUE(topology_of(mesh).closed());
    EXPECT_EQ(topology_of(mesh).components, 1);
    EXPECT_NEAR(volume_of(mesh), 4.0 / 3 * M_PI * 0.008, 4.0 / 3 * M_PI * 0.008 * 0.005);
    double worst = 0, worst_cosine = 1;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        const Vec3d out = to_double(mesh.positions[i]) - centre;
        worst = std::max(worst, std::fabs(norm(out) - radius));
        worst_cosine = std::min(worst_cosine, dot(normalised(out), to_double(mesh.normals[i])));
        EXPECT_NEAR(norm(mesh.normals[i]), 1, 1e-5f);
    }
    EXPECT_LT(worst, 0.1 * 0.01);
    EXPECT_GT(worst_cosine, std::cos(2 * M_PI / 180)) << std::acos(worst_cosine) * 180 / M_PI << " degrees";
    for (const auto& c : mesh.colours)
        ASSERT_EQ(c, (std::array<std::uint8_t, 3>{255, 255, 255})) << "white where no colour was seen";
}

TEST(Mesh, NoiseIsStillClean) {
    for (int kind = 0; kind < 4; ++kind) {
        TestVolume t(kShape);
        Rng rng(static_cast<std::uint64_t>(40 + kind));
        for (int z = -1; z < 2; ++z)
            for (int y = -1; y < 2; ++y)
                for (int x = -1; x < 2; ++x) {
                    if (kind == 3 && rng.below(3) == 0) continue;  // chunks that are not there
                    ChunkGeometry& g = t.volume.geometry(t.chunk({x, y, z}));
                    for (int i = 0; i < kChunkVoxels; ++i) {
                        // kind 0: any value; 1: -1, 0 or 1, so zeros and equal ends; 2: only -0 and +max; 3:
                        // holes too
                        const int v = kind == 1   ? rng.below(3) - 1
                                      : kind == 2 ? (rng.below(2) ? 0 : -32767)
                                                  : rng.below(65535) - 32767;
                        g.sdf[i] = static_cast<std::int16_t>(v);
                        g.weight[i] = kind == 3 ? static_cast<std::uint16_t>(rng.below(8) * 16) : 64;
                    }
                }
        const TriangleMesh mesh = mesh_of(t.volume, kAny);
        EXPECT_GT(mesh.triangles.size(), kind == 3 ? 30u : 5000u) << kind;
        expect_clean(mesh);
        for (const Vec3f& n : mesh.normals) ASSERT_NEAR(norm(n), 1, 1e-5f) << "a normal of length 0";
    }
}

TEST(Mesh, PlanesThroughVoxelCentresAndChunkBorders) {
    // Distances that are exactly zero, on a chunk border and elsewhere, along every axis.
    for (int axis = 0; axis < 3; ++axis)
        for (const int at : {0, 1, 7, 8}) {
            TestVolume t(kShape);
            t.fill({-1, -1, -1}, {1, 1, 1}, [&](Vec3d p) { return p[axis] - (at + 0.5) * 0.01; });
            const TriangleMesh mesh = mesh_of(t.volume, {});
            expect_clean(mesh);
            EXPECT_EQ(topology_of(mesh).components, 1);
            EXPECT_NEAR(topology_of(mesh).area_m2, 0.23 * 0.23, 1e-6) << "23 cells of 1 cm each way";
            for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
                ASSERT_NEAR(mesh.positions[i][axis], (at + 0.5) * 0.01,
                            0.01 / 250);  // the vertices keep off the voxels by 1/256
                ASSERT_NEAR(mesh.normals[i][axis], 1, 1e-5);
            }
        }
}

TEST(Mesh, DoesNotDependOnOrderOrThreads) {
    std::vector<Vec3i> chunks;
    for (int z = -2; z < 2; ++z)
        for (int y = -2; y < 2; ++y)
            for (int x = -2; x < 2; ++x) chunks.push_back({x, y, z});
    TriangleMesh first;
    for (int round = 0; round < 3; ++round) {
        Rng rng(static_cast<std::uint64_t>(round));
        for (std::size_t i = chunks.size(); i > 1; --i)
            std::swap(chunks[i - 1], chunks[static_cast<std::size_t>(rng.below(static_cast<int>(i)))]);
        TestVolume t(kShape);
        for (const Vec3i c : chunks) t.fill(c, c, [](Vec3d p) { return std::fabs(norm(p) - 0.1) - 0.02; });
        for (std::uint32_t slot = 0; slot < t.volume.live(); ++slot)
            for (int i = 0; i < kChunkVoxels; ++i) {
                std::uint8_t* c = t.volume.colour(slot).rgbn[i];
                c[0] = static_cast<std::uint8_t>(unpack_key(t.volume.key(slot)).x * 50 + i % 50);
                c[3] = 1;
            }
        const TriangleMesh mesh = mesh_of(t.volume, {}, 1 + 2 * round);
        if (round == 0) first = mesh;
        EXPECT_EQ(mesh.positions, first.positions);
        EXPECT_EQ(mesh.normals, first.normals);
        EXPECT_EQ(mesh.colours, first.colours);
        EXPECT_EQ(mesh.triangles, first.triangles);
    }
    EXPECT_EQ(topology_of(first).components, 2) << "a shell has two sides";
}

TEST(Mesh, MinWeightDecidesWhatIsKnown) {
    TestVolume t(kShape);
    t.fill({-1, -1, -1}, {0, 0, 0}, [](Vec3d p) { return p.z - 0.003; });
    for (std::uint32_t slot = 0; slot < t.volume.live(); ++slot)
        for (int i = 0; i < kChunkVoxels; ++i)
            t.volume.geometry(slot).weight[i] =
                static_cast<std::uint16_t>(unpack_key(t.volume.key(slot)).x < 0 ? 32 : 128);
    const std::size_t both = mesh_of(t.volume, {0.5f, 6}).triangles.size(),
                      one = mesh_of(t.volume, {0.51f, 6}).triangles.size();
    EXPECT_EQ(both, 2u * 15 * 15);
    EXPECT_EQ(one, 2u * 7 * 15);
    EXPECT_EQ(mesh_of(t.volume, {2, 6}).triangles.size(), one);
    EXPECT_EQ(mesh_of(t.volume, {2.1f, 6}).triangles.size(), 0u);
    // Weight 0 is never known, whatever is asked for.
    for (std::uint32_t slot = 0; slot < t.volume.live(); ++slot)
        std::fill_n(t.volume.geometry(slot).weight, kChunkVoxels, std::uint16_t{0});
    EXPECT_EQ(mesh_of(t.volume, {0, 6}).triangles.size(), 0u);
}

TEST(Mesh, MaxJumpDropsTheBackOfASilhouette) {
    // +3.9 voxels beside -3.9: no surface passes there.
    TestVolume t({100, false, 0.01f, 0.04f});
    t.fill({0, 0, 0}, {0, 0, 0}, [](Vec3d p) { return p.x < 0.04 ? 0.039 : -0.039; });
    EXPECT_EQ(mesh_of(t.volume, {0.5f, 7.7f}).triangles.size(), 0u);
    EXPECT_EQ(mesh_of(t.volume, {0.5f, 7.9f}).triangles.size(), 2u * 7 * 7);
    expect_clean(mesh_of(t.volume, {0.5f, 7.9f}));
}

TEST(Mesh, ColoursComeFromTheEndsOfTheEdge) {
    TestVolume t({8, true, 0.01f, 0.04f});
    t.fill({0, 0, 0}, {0, 0, 0},
           [](Vec3d p) { return p.z - 0.0375; });  // voxel 3 is at 0.035: a quarter of the edge
    ChunkColour& c = t.volume.colour(0);
    for (int i = 0; i < kChunkVoxels; ++i) {
        const std::uint8_t value[4] = {static_cast<std::uint8_t>(i >> 6 == 3 ? 100 : 200), 0,
                                       static_cast<std::uint8_t>((i & 7) * 10), 1};
        std::memcpy(c.rgbn[i], value, 4);
    }
    const TriangleMesh mesh = mesh_of(t.volume, {});
    ASSERT_EQ(mesh.positions.size(), 64u);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        EXPECT_NEAR(mesh.colours[i][0], 125, 1);
        EXPECT_EQ(mesh.colours[i][2], 10 * static_cast<int>(mesh.positions[i].x * 100));
    }
    for (int i = 0; i < kChunkVoxels; ++i)
        if (i >> 6 == 4) c.rgbn[i][3] = 0;
    for (const auto& colour : mesh_of(t.volume, {}).colours)
        EXPECT_EQ(colour[0], 100) << "the end without colour counts";
}

TEST(Mesh, ColourIsLentByTheNearestVoxelWithinTwo) {
    TestVolume t({8, true, 0.01f, 0.04f});
    t.fill({0, 0, 0}, {1, 0, 0},
           [](Vec3d p) { return p.z - 0.0375; });  // between voxels 3 and 4, a quarter on
    const auto paint = [&](int x, int y, int z, std::uint8_t red) {
        const std::uint8_t value[4] = {red, 7, 9, 1};
        std::memcpy(t.volume.colour(t.volume.find(pack_key({x >> 3, y >> 3, z >> 3})))
                        .rgbn[(z & 7) << 6 | (y & 7) << 3 | (x & 7)],
                    value, 4);
    };
    const auto red_at = [&](const TriangleMesh& mesh, int x, int y) {
        for (std::size_t i = 0; i < mesh.positions.size(); ++i)
            if (std::fabs(mesh.positions[i].x - static_cast<float>(x) * 0.01f - 0.005f) < 1e-4f &&
                std::fabs(mesh.positions[i].y - static_cast<float>(y) * 0.01f - 0.005f) < 1e-4f)
                return static_cast<int>(mesh.colours[i][0]);
        return -1;
    };
    paint(4, 4, 6, 60);  // 2.75 voxels above the vertex: too far
    EXPECT_EQ(red_at(mesh_of(t.volume, {}), 4, 4), 255) << "white when there is none within two voxels";
    paint(4, 4, 5, 50);  // 1.75
    EXPECT_EQ(red_at(mesh_of(t.volume, {}), 4, 4), 50);
    paint(5, 4, 4, 40);  // 1.25, and 1.03 for voxel (5, 4, 3)
    EXPECT_EQ(red_at(mesh_of(t.volume, {}), 4, 4), 40);
    paint(4, 3, 3, 30);  // as near as the next one: the lower comes first
    paint(4, 5, 3, 31);
    EXPECT_EQ(red_at(mesh_of(t.volume, {}), 4, 4), 30);
    EXPECT_EQ(red_at(mesh_of(t.volume, {}), 4, 3), 30) << "its own colour";
    // Across chunk borders, and where there is no chunk.
    EXPECT_EQ(red_at(mesh_of(t.volume, {}), 7, 1), 255);
    paint(8, 1, 3, 20);
    EXPECT_EQ(red_at(mesh_of(t.volume, {}), 7, 1), 20);
    EXPECT_EQ(red_at(mesh_of(t.volume, {}), 0, 0), 255);
}

// ------------------------------------------------------------------------------------------------ small
// components

TEST(SmallComponents, GoAndTheRestKeepsItsOrder) {
    TestVolume t(kShape);
    const Vec3d big{0.1, 0.1, 0.1}, small{-0.15, -0.15, -0.15};
    t.fill({-4, -4, -4}, {3, 3, 3},
           [&](Vec3d p) { return std::min(norm(p - big) - 0.08, norm(p - small) - 0.02); });
    const TriangleMesh whole = mesh_of(t.volume, {});
    ASSERT_EQ(topology_of(whole).components, 2);
    const auto beside_small = [&](const std::array<std::uint32_t, 3>& tri) {
        return norm(to_double(whole.positions[tri[0]]) - small) < 0.05;
    };
    const auto in_small =
        static_cast<std::size_t>(std::count_if(whole.triangles.begin(), whole.triangles.end(), beside_small));
    ASSERT_GT(in_small, 10u);
    for (const std::size_t least : {std::size_t{0}, in_small, in_small + 1, whole.triangles.size()}) {
        TriangleMesh m = whole;
        std::vector<std::uint32_t> scratch(2 * m.positions.size());
        const MeshCounts kept = remove_small_components(
            {&m.positions[0].x, &m.normals[0].x, m.colours[0].data(), m.triangles[0].data()},
            {m.positions.size(), m.triangles.size()}, least, scratch.data());
        const bool goes = least > in_small;
        const std::size_t expected =
            least == whole.triangles.size() ? 0 : whole.triangles.size() - (goes ? in_small : 0);
        ASSERT_EQ(kept.triangles, expected);
        m.positions.resize(kept.vertices);
        m.triangles.resize(kept.triangles);
        std::size_t at = 0;
        for (const auto& tri : whole.triangles) {
            if (expected == 0 || (goes && beside_small(tri))) continue;
            for (std::size_t k = 0; k < 3; ++k) {
                ASSERT_EQ(m.positions[m.triangles[at][k]], whole.positions[tri[k]]);
                ASSERT_EQ(m.normals[m.triangles[at][k]], whole.normals[tri[k]]);
            }
            ++at;
        }
        EXPECT_EQ(topology_of({m.positions, {}, {}, m.triangles, {}, {}}).unreferenced_vertices, 0);
    }
}

TEST(SmallComponents, AgainstAPlainSearch) {
    Rng rng(9);
    for (int round = 0; round < 200; ++round) {
        const int vertices = 3 + rng.below(60), triangles = rng.below(40);
        std::vector<Vec3f> positions;
        for (int i = 0; i < vertices; ++i) positions.push_back({static_cast<float>(i), 0, 0});
        std::vector<std::array<std::uint32_t, 3>> all;
        for (int i = 0; i < triangles; ++i)
            all.push_back({static_cast<std::uint32_t>(rng.below(vertices)),
                           static_cast<std::uint32_t>(rng.below(vertices)),
                           static_cast<std::uint32_t>(rng.below(vertices))});
        // Plain labels, relaxed until nothing changes.
        std::vector<int> label(static_cast<std::size_t>(vertices));
        std::iota(label.begin(), label.end(), 0);
        for (bool changed = true; changed;) {
            changed = false;
            for (const auto& t : all)
                for (const auto v : t) {
                    const int least = std::min({label[t[0]], label[t[1]], label[t[2]]});
                    changed |= label[v] != least;
                    label[v] = least;
                }
        }
        std::vector<int> size(static_cast<std::size_t>(vertices), 0);
        for (const auto& t : all) ++size[static_cast<std::size_t>(label[t[0]])];
        const int least = rng.below(8);
        std::vector<float> expected;  // x of every corner: the vertex it was
        for (const auto& t : all)
            if (size[static_cast<std::size_t>(label[t[0]])] >= least)
                for (const auto v : t) expected.push_back(static_cast<float>(v));
        auto triangle_data = all;
        triangle_data.push_back({});  // data() of an empty vector may be null
        std::vector<std::uint32_t> scratch(2 * static_cast<std::size_t>(vertices));
        const MeshCounts kept =
            remove_small_components({&positions[0].x, nullptr, nullptr, triangle_data[0].data()},
                                    {static_cast<std::uint64_t>(vertices), all.size()},
                                    static_cast<std::uint64_t>(least), scratch.data());
        ASSERT_EQ(3 * kept.triangles, expected.size());
        for (std::size_t i = 0; i < expected.size(); ++i) {
            ASSERT_LT(triangle_data[i / 3][i % 3], kept.vertices);
            ASSERT_EQ(positions[triangle_data[i / 3][i % 3]].x, expected[i]);
        }
    }
}

}  // namespace
}  // namespace burin
