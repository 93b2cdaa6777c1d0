// SPDX-License-Identifier: MIT
// Which chunks may the truncation band of a depth image cross? Marks them on a grid of bits over the camera's
// view, so that no hash is touched until the answer is read. The answer is a superset: integration tests each
// chunk exactly.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/arena.h"
#include "core/jobs.h"
#include "core/se3.h"
#include "depth/depth_image.h"
#include "map/chunk.h"
#include "simd/band_boxes.h"

namespace burin {

class BandMarker {
  public:
    // Bits of the grid: 160^3 chunks at once, 512 KiB. A view that is larger is marked slab by slab.
    static constexpr std::size_t kGridBits = std::size_t{1} << 22;

    // max_width, max_height: of the largest depth image that will come.
    void place(Arena& arena, int max_width, int max_height);

    // Starts on a frame. The image and the tiles must stay as they are until the last slab,
    // and the jobs be there.
    void begin(const DepthImage& image, const DepthTiles& tiles, const Se3& T_world_camera,
               const simd::TruncationModel& truncation, float voxel_m, Jobs& jobs);

    // Marks the next slab of the view; false when there is none left.
    bool next_slab();

    // The next marked chunks of this slab in (z, y, x) order, relative to origin(), at most `capacity`; 0
    // when the slab is read. Chunks that no key can name are left out.
    int collect(std::int32_t* x, std::int32_t* y, std::int32_t* z, int capacity);
    Vec3i origin() const { return origin_; }

  private:
    void place_window(const Se3& T_world_camera, float voxel_m);
    void box_tiles(Jobs& jobs);
    void mark(const simd::ChunkBox& box);
    void set_bits(std::uint64_t* word, std::uint64_t bits) const;
    void mark_row(int tile_y);
    void mark_deep(int tile_x, int tile_y);
    void mark_pixels(int tile_x, int tile_y);

    std::uint64_t* words_ = nullptr;
    simd::ChunkBox* boxes_ = nullptr;       // a tile each, rows of box_stride_
    simd::ChunkBox* row_bounds_ = nullptr;  // of the boxes of a row of tiles
    float* tile_u_ = nullptr;               // middles of the tiles of a row

    Jobs* jobs_ = nullptr;
    const DepthImage* image_ = nullptr;
    const DepthTiles* tiles_ = nullptr;
    simd::BandView tile_view_{}, pixel_view_{};
    int box_stride_ = 0;
    Vec3i origin_;                              // chunk at grid position 0 of the whole window
    int size_[3] = {};                          // of the whole window, chunks; x a multiple of 64
    int slab_low_[3] = {}, slab_size_[3] = {};  // of the current slab within the window; x whole
    int step_[3] = {};                          // size of a full slab
    bool started_ = false;
    std::size_t cursor_ = 0;  // word being read
};

}  // namespace burin
