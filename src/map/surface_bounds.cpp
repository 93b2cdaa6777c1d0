// SPDX-License-Identifier: MIT
#include "map/surface_bounds.h"

#include <algorithm>
#include <cmath>

namespace burin {
namespace {

constexpr int kChunksPerItem = 1024;  // some 20 ns each

void lower_to(std::atomic<std::uint16_t>& at, std::uint16_t value) {
    std::uint16_t old = at.load(std::memory_order_relaxed);
    while (value < old && !at.compare_exchange_weak(old, value, std::memory_order_relaxed)) {
    }
}
void raise_to(std::atomic<std::uint16_t>& at, std::uint16_t value) {
    std::uint16_t old = at.load(std::memory_order_relaxed);
    while (value > old && !at.compare_exchange_weak(old, value, std::memory_order_relaxed)) {
    }
}

}  // namespace

SurfaceBounds::SurfaceBounds(const Volume& volume, const Camera& camera, const Se3& T_world_camera,
                             float max_depth_m, Jobs& jobs)
    : unit_m_(max_depth_m / 65534.0f) {
    const auto squares = [](int pixels, int side) { return (pixels + side - 1) / side; };
    while (squares(camera.width, side_) * squares(camera.height, side_) > kMostSquares) side_ += 8;
    columns_ = squares(camera.width, side_);
    rows_ = squares(camera.height, side_);
    for (int i = 0; i < columns_ * rows_; ++i) {
        nearest_[i].store(65535, std::memory_order_relaxed);
        farthest_[i].store(0, std::memory_order_relaxed);
    }
    // Half the diagonal of the chunk, and of one voxel more on each side: cells reach half a voxel out of it,
    // and the crossing must be seen from in front of it.
    const double voxel_m = volume.voxel_m();
    const float radius = static_cast<float>(voxel_m * (0.5 * kChunkSide + 1) * 1.7321);
    const Se3 T_camera_world = T_world_camera.inverse();
    const int items = static_cast<int>((volume.live() + kChunksPerItem - 1) / kChunksPerItem);
    jobs.run(items, [&](int item, int) {
        const auto first = static_cast<std::uint32_t>(item) * kChunksPerItem;
        for (std::uint32_t slot = first; slot < std::min(volume.live(), first + kChunksPerItem); ++slot) {
            const Vec3i c = unpack_key(volume.key(slot));
            const Vec3d centre{(c.x + 0.5) * kChunkSide * voxel_m, (c.y + 0.5) * kChunkSide * voxel_m,
                               (c.z + 0.5) * kChunkSide * voxel_m};
            add(to_float(T_camera_world * centre), radius, camera, max_depth_m);
        }
    });
}

void SurfaceBounds::add(Vec3f c, float radius, const Camera& camera, float max_depth_m) {
    const float near_z = c.z - radius;
    if (!(c.z + radius > 0.0f && near_z < max_depth_m)) return;
    int x0 = 0, y0 = 0, x1 = columns_ - 1, y1 = rows_ - 1;
    if (near_z > 0.2f * radius) {  // else it is around the camera
        // A ball lies within these pixels: |x/z - X/Z| <= (radius + |X/Z| radius) / near_z.
        const float u = c.x / c.z, v = c.y / c.z;
        const float grow = radius / near_z;
        const float fx = static_cast<float>(camera.fx), fy = static_cast<float>(camera.fy);
        const float du = fx * grow * (1.0f + std::fabs(u)) + 1.0f,
                    dv = fy * grow * (1.0f + std::fabs(v)) + 1.0f;
        const float at_u = fx * u + static_cast<float>(camera.cx),
                    at_v = fy * v + static_cast<float>(camera.cy);
        if (at_u + du < 0.0f || at_v + dv < 0.0f || at_u - du > static_cast<float>(camera.width) ||
            at_v - dv > static_cast<float>(camera.height))
            return;
        x0 = static_cast<int>(std::max(at_u - du, 0.0f)) / side_;
        y0 = static_cast<int>(std::max(at_v - dv, 0.0f)) / side_;
        x1 = std::min(static_cast<int>(std::min(at_u + du, 1e6f)) / side_, columns_ - 1);
        y1 = std::min(static_cast<int>(std::min(at_v + dv, 1e6f)) / side_, rows_ - 1);
    }
    const auto units = [&](float z) { return std::clamp(z / unit_m_, 0.0f, 65533.0f); };
    const auto low = static_cast<std::uint16_t>(units(near_z)),
               high = static_cast<std::uint16_t>(units(c.z + radius) + 1.0f);
    for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x) {
            lower_to(nearest_[y * columns_ + x], low);
            raise_to(farthest_[y * columns_ + x], high);
        }
}

SurfaceBounds::Depths SurfaceBounds::at(int x, int y) const {
    const int i = y / side_ * columns_ + x / side_;
    return {static_cast<float>(nearest_[i].load(std::memory_order_relaxed)) * unit_m_,
            static_cast<float>(farthest_[i].load(std::memory_order_relaxed)) * unit_m_};
}

}  // namespace burin
