// SPDX-License-Identifier: MIT
// What the kernels of integration see in a real frame: a 640 x 480 depth image of a wall that leans, with the
// noise of a structured-light sensor, and the chunks that its truncation band crosses.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "map/projector.h"

namespace burin::bench {

// As the pool lays them out: the kernels load whole vectors.
struct alignas(64) PoolGeometry : ChunkGeometry {};
struct alignas(64) PoolColour : ChunkColour {};

struct KernelScene {
    static constexpr int kWidth = 640, kHeight = 480, kStride = kWidth + 2;
    static constexpr int kChunks =
        256;  // 512 KiB of geometry: in the second-level cache, as the prefetch leaves it
    static constexpr float kFocal = 525, kCentreU = 320, kCentreV = 240, kUnit = 0.0002f, kVoxel = 0.005f;

    std::vector<std::uint16_t> depth = std::vector<std::uint16_t>(kStride * (kHeight + 2), 0);
    std::vector<std::uint8_t> rgb = std::vector<std::uint8_t>(kWidth * kHeight * 3 + 16);
    std::unique_ptr<simd::DepthProjection> frame = std::make_unique<simd::DepthProjection>();
    simd::ColourFrame colour{};
    std::vector<simd::ProjectedChunk> chunks;
    std::vector<simd::ProjectiveBase> colour_bases;
    static constexpr std::uint16_t kMaxWeight = 255 * simd::kWeightOne;

    KernelScene() {
        std::uint32_t seed = 1;
        const auto random = [&] { return seed = seed * 1664525u + 1013904223u, seed >> 8; };
        const auto wall_m = [](float u) { return 1.5f + 1.5f * u / kWidth; };
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const float noise = 0.003f * (static_cast<float>(random() & 255) / 128 - 1);
                // One pixel in 32 has no depth.
                depth[static_cast<std::size_t>(y + 1) * kStride + static_cast<std::size_t>(x + 1)] =
                    (random() & 31) == 0
                        ? 0
                        : static_cast<std::uint16_t>((wall_m(static_cast<float>(x)) + noise) / kUnit);
            }
        for (auto& value : rgb) value = static_cast<std::uint8_t>(random());
        frame->pixels = depth.data();
        frame->width = kWidth;
        frame->height = kHeight;
        frame->stride = kStride;
        frame->unit_m = kUnit;
        frame->truncation = {4 * kVoxel, false, 0, 0, 0, 4 * kVoxel};
        // A camera that is turned by 0.3 rad about y and then x, as none is aligned with the lattice.
        const double c = std::cos(0.3), s = std::sin(0.3);
        Se3 T_camera_world;
        T_camera_world.R = {{c, 0, s, s * s, c, -s * c, -s * c, s, c * c}};
        const Camera camera{kWidth, kHeight, kFocal, kFocal, kCentreU, kCentreV};
        const Projector projector(camera, T_camera_world, 1.0, frame->truncation.units_per_m(), kVoxel);
        const Projector colour_projector(camera, T_camera_world, 0.0, 1.0, kVoxel);
        projector.fill(&frame->offsets);
        projector.fill(&frame->groups);
        colour_projector.fill(&colour);
        colour.rgb = rgb.data();
        colour.width = kWidth;
        colour.height = kHeight;
        colour.stride = 3 * kWidth;
        colour.fx = colour.fy = kFocal;
        colour.cx = kCentreU;
        colour.cy = kCentreV;
        for (int i = 0; i < kChunks; ++i) {
            const double u = 30.0 + random() % (kWidth - 60), v = 30.0 + random() % (kHeight - 60);
            const double z =
                static_cast<double>(wall_m(static_cast<float>(u))) + kVoxel * (random() % 8 - 4.0);
            const Vec3d p =
                T_camera_world.inverse() * Vec3d{(u - kCentreU) / kFocal * z, (v - kCentreV) / kFocal * z, z};
            const double side = kChunkSide * static_cast<double>(kVoxel);
            const Vec3i chunk = {static_cast<std::int32_t>(std::floor(p.x / side)),
                                 static_cast<std::int32_t>(std::floor(p.y / side)),
                                 static_cast<std::int32_t>(std::floor(p.z / side))};
            const simd::ProjectiveBase base = projector.base(chunk);
            chunks.push_back({base.u, base.v, base.z, true, true, simd::Pixels::narrow, 1.0f});
            colour_bases.push_back(colour_projector.base(chunk));
        }
    }
};

}  // namespace burin::bench
