// SPDX-License-Identifier: MIT
#include "datasets/synthetic/truth_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "core/marching_cubes_table.h"
#include "datasets/synthetic/portable_math.h"
#include "datasets/synthetic/render.h"

namespace burin {
namespace {

constexpr int kBlock = 16;           // cells along a block's side
constexpr int kSide = kBlock + 1;    // corners along it
constexpr double kFar = 1e3;         // stands for a distance that was not looked up, metres
constexpr double kMaxCorners = 1e6;  // along one axis; keeps keys inside 3 x 20 + 2 bits

// Edges are named by their lower corner and axis.
std::uint64_t edge_key(int x, int y, int z, int axis) {
    return static_cast<std::uint64_t>(x) << 42 | static_cast<std::uint64_t>(y) << 22 |
           static_cast<std::uint64_t>(z) << 2 | static_cast<std::uint64_t>(axis);
}

struct Block {
    int x, y, z;  // first cell
    std::vector<std::uint64_t> vertex_keys;
    std::vector<Vec3d> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;  // of vertices in this block
};

// Where the distance changes sign between a (outside) and b (inside): bisection and regula falsi in turn.
Vec3d crossing(const SyntheticScene& scene, Vec3d a, Vec3d b, double da, double db) {
    double low = 0, high = 1;
    const double length = norm(b - a);
    for (int i = 0; i < 60 && (high - low) * length > 1e-9; ++i) {
        double m = i % 3 == 2 ? 0.5 * (low + high) : low + (high - low) * da / (da - db);
        if (!(m > low && m < high)) m = 0.5 * (low + high);
        const double d = scene.distance(a + (b - a) * m);
        if (d >= 0)
            low = m, da = std::max(d, 1e-300), db *= 0.5;
        else
            high = m, db = d, da *= 0.5;
    }
    return a + (b - a) * low;
}

void mesh_block(const SyntheticScene& scene, Vec3d origin, double h, const int (&cells)[3], Block* block) {
    std::vector<double> d(static_cast<std::size_t>(kSide) * kSide * kSide, std::nan(""));
    const auto corner = [&](int x, int y, int z) {
        return origin + Vec3d{static_cast<double>(block->x + x), static_cast<double>(block->y + y),
                              static_cast<double>(block->z + z)} *
                            h;
    };
    const auto at = [&](int x, int y, int z) -> double& {
        return d[(static_cast<std::size_t>(z) * kSide + y) * kSide + x];
    };
    const int nx = std::min(kBlock, cells[0] - block->x), ny = std::min(kBlock, cells[1] - block->y),
              nz = std::min(kBlock, cells[2] - block->z);
    // In groups of 4^3 cells: where the surface is out of reach of the whole group, its corners share the
    // middle's sign.
    constexpr int kGroup = 4;
    const double reach = 0.5 * std::sqrt(3.0) * kGroup * h + 1e-6, half = 0.5 * kGroup * h;
    for (int gz = 0; gz < nz; gz += kGroup)
        for (int gy = 0; gy < ny; gy += kGroup)
            for (int gx = 0; gx < nx; gx += kGroup) {
                const double middle = scene.distance(corner(gx, gy, gz) + Vec3d{half, half, half});
                const bool near = std::fabs(middle) <= reach;
                for (int z = gz; z <= gz + kGroup; ++z)
                    for (int y = gy; y <= gy + kGroup; ++y)
                        for (int x = gx; x <= gx + kGroup; ++x) {
                            double& value = at(x, y, z);
                            if (!near && std::isnan(value)) value = std::copysign(kFar, middle);
                            if (near && !(std::fabs(value) < kFar)) value = scene.distance(corner(x, y, z));
                        }
            }
    std::unordered_map<std::uint64_t, std::uint32_t> known;
    for (int z = 0; z < nz; ++z)
        for (int y = 0; y < ny; ++y)
            for (int x = 0; x < nx; ++x) {
                int config = 0;
                for (int i = 0; i < 8; ++i)
                    config |= (at(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2 & 1)) < 0) << i;
                const CubeTriangles& cell = kMarchingCubes[static_cast<std::size_t>(config)];
                std::uint32_t vertex[12] = {};
                for (int e = 0; e < 12; ++e) {
                    if (!(cell.edges >> e & 1)) continue;
                    const int c = kCubeEdges[static_cast<std::size_t>(e)].corner,
                              axis = kCubeEdges[static_cast<std::size_t>(e)].axis;
                    const int ax = x + (c & 1), ay = y + (c >> 1 & 1), az = z + (c >> 2 & 1);
                    const int bx = ax + (axis == 0), by = ay + (axis == 1), bz = az + (axis == 2);
                    const std::uint64_t key = edge_key(block->x + ax, block->y + ay, block->z + az, axis);
                    const auto [entry, fresh] =
                        known.try_emplace(key, static_cast<std::uint32_t>(block->vertices.size()));
                    vertex[e] = entry->second;
                    if (!fresh) continue;
                    const double da = at(ax, ay, az), db = at(bx, by, bz);
                    const Vec3d a = corner(ax, ay, az), b = corner(bx, by, bz);
                    block->vertex_keys.push_back(key);
                    block->vertices.push_back(da >= 0 ? crossing(scene, a, b, da, db)
                                                      : crossing(scene, b, a, db, da));
                }
                for (int t = 0; t < cell.count; ++t)
                    block->triangles.push_back(
                        {vertex[cell.edge[t][0]], vertex[cell.edge[t][1]], vertex[cell.edge[t][2]]});
            }
}

// The blocks that hold surface: a block is empty when the distance at its centre exceeds its half diagonal.
std::vector<Block> surface_blocks(const SyntheticScene& scene, Vec3d origin, double h,
                                  const int (&cells)[3]) {
    std::vector<Block> blocks;
    const double reach = 0.5 * std::sqrt(3.0) * kBlock * h + 1e-6;
    for (int z = 0; z < cells[2]; z += kBlock)
        for (int y = 0; y < cells[1]; y += kBlock)
            for (int x = 0; x < cells[0]; x += kBlock) {
                const Vec3d centre = origin + Vec3d{x + 0.5 * kBlock, y + 0.5 * kBlock, z + 0.5 * kBlock} * h;
                if (std::fabs(scene.distance(centre)) <= reach) blocks.push_back({x, y, z, {}, {}, {}});
            }
    return blocks;
}

}  // namespace

Result<TriangleMesh> truth_mesh(const SyntheticScene& scene, double resolution, Jobs& jobs) {
    const double h = resolution == 0 ? scene.data().mesh_resolution : resolution;
    const Vec3d origin = scene.data().mesh_bounds.low, extent = scene.data().mesh_bounds.high - origin;
    int cells[3];
    for (int i = 0; i < 3; ++i) {
        const double count = std::ceil(extent[i] / h);
        if (!(h > 0) || !(count < kMaxCorners))
            return Status::error(Code::invalid_argument,
                                 "mesh resolution %g m: expected a positive number above %g m", h,
                                 extent[i] / kMaxCorners);
        cells[i] = static_cast<int>(count);
    }
    std::vector<Block> blocks = surface_blocks(scene, origin, h, cells);
    jobs.run(static_cast<int>(blocks.size()),
             [&](int i, int) { mesh_block(scene, origin, h, cells, &blocks[static_cast<std::size_t>(i)]); });

    // Weld in the order of the blocks, so that the numbering does not depend on the threads.
    TriangleMesh mesh;
    std::vector<Vec3d> exact;
    std::unordered_map<std::uint64_t, std::uint32_t> index_of;
    for (Block& block : blocks) {
        std::vector<std::uint32_t> index(block.vertices.size());
        for (std::size_t i = 0; i < index.size(); ++i) {
            const auto [entry, fresh] =
                index_of.try_emplace(block.vertex_keys[i], static_cast<std::uint32_t>(exact.size()));
            index[i] = entry->second;
            if (fresh) exact.push_back(block.vertices[i]);
        }
        if (exact.size() > 0xF0000000u)
            return Status::error(Code::invalid_argument,
                                 "mesh resolution %g m: more than 4e9 vertices, expected a coarser one", h);
        for (const auto& t : block.triangles)
            mesh.triangles.push_back({index[t[0]], index[t[1]], index[t[2]]});
        block = {};
    }
    mesh.positions.resize(exact.size());
    mesh.normals.resize(exact.size());
    mesh.colours.resize(exact.size());
    mesh.labels.resize(mesh.triangles.size());
    constexpr int kBatch = 4096;
    jobs.run(static_cast<int>((exact.size() + kBatch - 1) / kBatch), [&](int batch, int) {
        const std::size_t end = std::min(exact.size(), (static_cast<std::size_t>(batch) + 1) * kBatch);
        for (std::size_t i = static_cast<std::size_t>(batch) * kBatch; i < end; ++i) {
            mesh.positions[i] = to_float(exact[i]);
            mesh.normals[i] = to_float(scene.normal(exact[i]));
            const Vec3f albedo = scene.albedo(exact[i]);
            mesh.colours[i] = {encode_srgb(albedo.x), encode_srgb(albedo.y), encode_srgb(albedo.z)};
        }
    });
    jobs.run(static_cast<int>((mesh.triangles.size() + kBatch - 1) / kBatch), [&](int batch, int) {
        const std::size_t end =
            std::min(mesh.triangles.size(), (static_cast<std::size_t>(batch) + 1) * kBatch);
        for (std::size_t i = static_cast<std::size_t>(batch) * kBatch; i < end; ++i) {
            const auto& t = mesh.triangles[i];
            mesh.labels[i] = scene.label((exact[t[0]] + exact[t[1]] + exact[t[2]]) * (1.0 / 3));
        }
    });
    return mesh;
}

Result<std::vector<SurfacePoint>> sample_surface(const SyntheticScene& scene, int count, std::uint64_t seed,
                                                 double resolution, Jobs& jobs) {
    const Result<TriangleMesh> mesh = truth_mesh(scene, resolution, jobs);
    if (!mesh.ok()) return mesh.status();
    std::vector<double> cumulative;
    double area = 0;
    const auto corner = [&](std::size_t triangle, int i) {
        return to_double(mesh->positions[mesh->triangles[triangle][static_cast<std::size_t>(i)]]);
    };
    for (std::size_t t = 0; t < mesh->triangles.size(); ++t) {
        const Vec3d a = corner(t, 0);
        area += 0.5 * norm(cross(corner(t, 1) - a, corner(t, 2) - a));
        cumulative.push_back(area);
    }
    // One point in each of `count` equal shares of the area.
    std::vector<SurfacePoint> drawn(static_cast<std::size_t>(std::max(count, 0)));
    std::vector<std::uint8_t> good(drawn.size(), 0);
    constexpr int kBatch = 1024;
    jobs.run(static_cast<int>((drawn.size() + kBatch - 1) / kBatch), [&](int batch, int) {
        const std::size_t end = std::min(drawn.size(), (static_cast<std::size_t>(batch) + 1) * kBatch);
        for (std::size_t i = static_cast<std::size_t>(batch) * kBatch; i < end; ++i) {
            const double share =
                (static_cast<double>(i) + synthetic::to_unit(synthetic::hash_bits(seed, i, 0))) /
                static_cast<double>(drawn.size());
            const auto found = std::lower_bound(cumulative.begin(), cumulative.end(), share * area);
            const auto t = static_cast<std::size_t>(
                std::min(found - cumulative.begin(), static_cast<std::ptrdiff_t>(cumulative.size()) - 1));
            const double root = std::sqrt(synthetic::to_unit(synthetic::hash_bits(seed, i, 1)));
            const double v = synthetic::to_unit(synthetic::hash_bits(seed, i, 2)) * root;
            Vec3d p = corner(t, 0) * (1 - root) + corner(t, 1) * (root - v) + corner(t, 2) * v;
            // Newton along the gradient; at a concave edge the foot may swing between two surfaces, such
            // points go.
            for (int round = 0; round < 20; ++round) {
                const double d = scene.distance(p);
                if (std::fabs(d) < 1e-9) break;
                p = p - scene.normal(p) * d;
            }
            if (std::fabs(scene.distance(p)) > 1e-7) continue;
            good[i] = 1;
            drawn[i] = {p, scene.normal(p), scene.label(p)};
        }
    });
    std::vector<SurfacePoint> points;
    for (std::size_t i = 0; i < drawn.size(); ++i)
        if (good[i]) points.push_back(drawn[i]);
    return points;
}

}  // namespace burin
