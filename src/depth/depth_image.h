// SPDX-License-Identifier: MIT
// The depth stage: from a frame's raw depth to what integration reads. Fixed memory, sized by the largest
// image.
#pragma once

#include <cstddef>
#include <cstdint>

#include "capture/frame.h"
#include "core/arena.h"
#include "core/jobs.h"
#include "simd/depth.h"

namespace burin {

// Depth with a border of one pixel of zeros. Pixel (x, y) of the image is at (y + 1) * stride + x + 1; 0 = no
// depth; metres = value * unit_m. `weights` (same layout, in units of simd::kWeightOne per observation) may
// be null.
struct DepthImage {
    int width = 0, height = 0, stride = 0;
    float unit_m = 0;
    const std::uint16_t* pixels = nullptr;
    const std::uint16_t* weights = nullptr;
    Camera camera;                        // undistorted
    std::uint32_t valid = 0;              // pixels with depth
    float nearest_m = 0, farthest_m = 0;  // over valid pixels

    std::ptrdiff_t offset(int x, int y) const { return static_cast<std::ptrdiff_t>(y + 1) * stride + x + 1; }
    std::uint16_t at(int x, int y) const { return pixels[offset(x, y)]; }
};

using simd::DepthRange;

// Ranges of depth over tiles of kTile x kTile pixels, packed rows of `width`.
struct DepthTiles {
    // Pixels; smaller tiles cost more boxes, larger ones mark more than the band.
    static constexpr int kTile = simd::kTileSide;
    int width = 0, height = 0;
    const DepthRange* ranges = nullptr;
    DepthRange all{0, 0};  // of the whole image
};

struct DepthOptions {
    float min_depth_m = 0.2f, max_depth_m = 4.0f;
    bool bilateral = false;
    bool edge_removal = false;
    bool inverse_z2_weight = false;
    bool angle_weight = false;
    int max_width = 640, max_height = 480;

    bool weighted() const { return inverse_z2_weight || angle_weight; }
};

class DepthStage {
  public:
    void place(Arena& arena, const DepthOptions& options);

    // Converts, clips to range, rectifies (when the depth camera is distorted), and filters as the options
    // say. The frame must have been checked: its cameras are valid and its depth is at most max_width x
    // max_height. `image` and `tiles` stay valid until the next call.
    void prepare(const FrameView& frame, Jobs& jobs);

    DepthImage image;
    DepthTiles tiles;

  private:
    void build_tiles(Jobs& jobs);

    DepthOptions options_;
    std::uint16_t* pixels_ = nullptr;
    std::uint16_t* scratch_ = nullptr;  // second image for filters
    std::uint16_t* weights_ = nullptr;
    DepthRange* ranges_ = nullptr;
};

}  // namespace burin
