// SPDX-License-Identifier: MIT
// Meshes with known properties for the tests of export/ and eval/.
#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <utility>

#include "core/triangle_mesh.h"

namespace burin::testing_meshes {

// Uniform numbers that are the same with every standard library (its distributions are not).
class Random {
  public:
    explicit Random(unsigned seed) : engine_(seed) {}
    double between(double low, double high) { return low + (high - low) * (engine_() * 0x1p-32); }
    int below(int n) { return static_cast<int>(engine_() % static_cast<unsigned>(n)); }
    Vec3d point(double half_side) {
        const double x = between(-half_side, half_side), y = between(-half_side, half_side);
        return {x, y, between(-half_side, half_side)};
    }
    Vec3d direction() {
        for (;;) {
            const Vec3d d = point(1);
            if (norm(d) > 0.1 && norm(d) < 1) return normalised(d);
        }
    }

  private:
    std::mt19937 engine_;
};

// An octahedron split `rounds` times, vertices on the sphere: 8 * 4^rounds triangles, closed, welded, facing
// outwards.
inline TriangleMesh make_sphere(double radius, int rounds, Vec3d centre = {}) {
    TriangleMesh mesh;
    mesh.normals = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int round = 0; round < rounds; ++round) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [found, inserted] = middles.try_emplace(
                {std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(mesh.normals.size()));
            if (inserted) mesh.normals.push_back(normalised(mesh.normals[a] + mesh.normals[b]));
            return found->second;
        };
        std::vector<std::array<std::uint32_t, 3>> finer;
        for (const auto& t : mesh.triangles) {
            const std::uint32_t ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
            finer.push_back({t[0], ab, ca});
            finer.push_back({t[1], bc, ab});
            finer.push_back({t[2], ca, bc});
            finer.push_back({ab, bc, ca});
        }
        mesh.triangles = std::move(finer);
    }
    for (const Vec3f& n : mesh.normals) mesh.positions.push_back(to_float(centre + to_double(n) * radius));
    return mesh;
}

// A rectangle [0, width] x [0, depth] at height z, facing up, of n x n cells.
inline TriangleMesh make_rectangle(double width, double depth, double z, int n) {
    TriangleMesh mesh;
    for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i) mesh.positions.push_back(to_float({width * i / n, depth * j / n, z}));
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            const auto v = static_cast<std::uint32_t>(j * (n + 1) + i),
                       row = static_cast<std::uint32_t>(n + 1);
            mesh.triangles.push_back({v, v + 1, v + row + 1});
            mesh.triangles.push_back({v, v + row + 1, v + row});
        }
    return mesh;
}

// Unconnected triangles in a cube. `size` is the reach of a triangle about its centre.
inline TriangleMesh make_soup(Random& random, int count, double half_side, double size) {
    TriangleMesh mesh;
    for (int i = 0; i < count; ++i) {
        const Vec3d centre = random.point(half_side);
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        for (int k = 0; k < 3; ++k) mesh.positions.push_back(to_float(centre + random.point(size)));
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

inline void flip(TriangleMesh* mesh) {
    for (auto& t : mesh->triangles) std::swap(t[1], t[2]);
    for (Vec3f& n : mesh->normals) n = -n;
}

// Every attribute filled with something that tells the elements apart.
inline void paint(TriangleMesh* mesh) {
    mesh->colours.clear();
    mesh->labels.clear();
    for (std::size_t i = 0; i < mesh->positions.size(); ++i)
        mesh->colours.push_back({static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i >> 8 ^ 37 * i),
                                 static_cast<std::uint8_t>(255 - i % 251)});
    for (std::size_t i = 0; i < mesh->triangles.size(); ++i)
        mesh->labels.push_back(static_cast<std::uint8_t>(i % 8));
}

}  // namespace burin::testing_meshes
