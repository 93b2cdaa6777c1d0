// SPDX-License-Identifier: MIT
// What the kernels of integration see in a real frame: a 640 x 480 depth image of a wall that leans, with the
// noise of a structured-light sensor, and the chunks that its truncation band crosses.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "map/chunk.h"
#include "simd/tsdf.h"

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
    simd::ProjectiveOffsets offsets;
    std::vector<simd::ProjectiveBase> bases;
    simd::TruncationModel truncation{4 * kVoxel, false, 0, 0, 0, 4 * kVoxel};
    simd::FuseModel fuse{simd::Drop::none, 8192, 1.0f / (32767 - 8192), 255 * simd::kWeightOne};

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
        // A camera that is turned by 0.3 rad about y and then x, as none is aligned with the lattice.
        const double c = std::cos(0.3), s = std::sin(0.3);
        const double R[3][3] = {{c, 0, s}, {s * s, c, -s * c}, {-s * c, s, c * c}};
        for (int i = 0; i < simd::kChunkVoxels; ++i) {
            const double p[3] = {kVoxel * (i & 7), kVoxel * (i >> 3 & 7), kVoxel * (i >> 6)};
            double q[3];
            for (int r = 0; r < 3; ++r) q[r] = R[r][0] * p[0] + R[r][1] * p[1] + R[r][2] * p[2];
            offsets.u[i] = static_cast<float>(kFocal * q[0] + kCentreU * q[2]);
            offsets.v[i] = static_cast<float>(kFocal * q[1] + kCentreV * q[2]);
            offsets.z[i] = static_cast<float>(q[2]);
        }
        for (int i = 0; i < kChunks; ++i) {
            const float u = 20 + static_cast<float>(random() % (kWidth - 60)),
                        v = 20 + static_cast<float>(random() % (kHeight - 60));
            const float z = wall_m(u) - kVoxel * static_cast<float>(random() % 8);
            bases.push_back({u * z, v * z, z});
        }
    }

    simd::DepthWindow window() const { return {depth.data(), nullptr, kWidth, kHeight, kStride, kUnit}; }
};

}  // namespace burin::bench
