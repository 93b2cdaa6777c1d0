// SPDX-License-Identifier: MIT
// Which chunks may the truncation band of a depth image cross? Marks them on a grid of bits over the camera's
// view, so that no hash is touched until the answer is read. The answer is a superset: integration tests each
// chunk exactly.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/arena.h"
#include "core/se3.h"
#include "depth/depth_image.h"
#include "map/chunk.h"
#include "simd/tsdf.h"

namespace burin {

class BandMarker {
  public:
    // Bits of the grid: 160^3 chunks at once, 512 KiB. A view that is larger is marked slab by slab.
    static constexpr std::size_t kGridBits = std::size_t{1} << 22;

    void place(Arena& arena);

    // Starts on a frame. The image and the tiles must stay as they are until the last slab.
    void begin(const DepthImage& image, const DepthTiles& tiles, const Se3& T_world_camera,
               const simd::TruncationModel& truncation, float voxel_m);

    // Marks the next slab of the view; false when there is none left.
    bool next_slab();

    // The next marked chunks of this slab in (z, y, x) order, relative to origin(), at most `capacity`; 0 when
    // the slab is read. Chunks that no key can name are left out.
    int collect(std::int32_t* x, std::int32_t* y, std::int32_t* z, int capacity);
    Vec3i origin() const { return origin_; }

  private:
    struct Box {
        int low[3], high[3];  // chunks relative to origin_, inclusive
        bool operator==(const Box&) const = default;
    };
    Box box_of(float u_centre, float v_centre, const float half_slope[3], float z_low, float z_high) const;
    void mark(const Box& box);
    void mark_tiles();
    float truncation_at(float depth_m) const;

    std::uint64_t* words_ = nullptr;

    const DepthImage* image_ = nullptr;
    const DepthTiles* tiles_ = nullptr;
    simd::TruncationModel truncation_{};
    float voxel_m_ = 0;
    float slope_u_[3] = {}, slope_v_[3] = {},
          slope_1_[3] = {};                     // world direction = u, v, 1 times these (z = 1)
    float start_[3] = {};                       // camera relative to the origin chunk, in voxels
    Vec3i origin_;                              // chunk at grid position 0 of the whole window
    int size_[3] = {};                          // of the whole window, chunks; x a multiple of 64
    int slab_low_[3] = {}, slab_size_[3] = {};  // of the current slab within the window; x whole
    int step_[3] = {};                          // size of a full slab
    bool started_ = false;
    std::size_t cursor_ = 0;  // word being read
};

}  // namespace burin
