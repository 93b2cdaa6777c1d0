// SPDX-License-Identifier: MIT
// The points of a depth image that tracking measures with: averages of blocks of readings, in three levels.
#pragma once

#include "core/arena.h"
#include "core/jobs.h"
#include "depth/depth_image.h"

namespace burin {

// Points of one level on its grid of blocks, rows of `width`, and again the valid ones alone, in the grid's
// order.
struct TrackLevel {
    int width = 0, height = 0;
    Camera camera;  // of the grid: a block is a pixel
    // The grid: camera coordinates in metres, z = 0 where there is none.
    float *grid_x = nullptr, *grid_y = nullptr, *grid_z = nullptr;
    // The list, readable (not meaningful) up to the next multiple of 16.
    int count = 0;
    float *x = nullptr, *y = nullptr, *z = nullptr;
    float* inverse_sigma =
        nullptr;          // 1 / standard deviation of one reading there (axial_noise_m), 1 / metres
    int* cell = nullptr;  // place in the grid
};

class TrackPoints {
  public:
    static constexpr int kLevels = 3;  // 0 the finest
    // About 160 x 120 blocks: averages of 16 readings of a VGA image. What finer points add is the same noise
    // again, since a sensor's errors are alike over some pixels (notes of prototypes: 15,000 points suffice).
    static constexpr int kMostPoints = 19200;
    // Readings a block averages: block_side() squared.
    static int block_side(int width, int height);

    // max_depth_m: where the depth stage cuts. Of a surface near it only readings that err towards the camera
    // are left, so points within four standard deviations of it are left out.
    void place(Arena& arena, int max_width, int max_height, float max_depth_m);
    // Every level from the image. A block counts when at least a quarter of its readings are there and they
    // lie on one surface; a coarser one when at least two of its four do.
    void build(const DepthImage& depth, Jobs& jobs);

    const TrackLevel& level(int i) const { return levels_[i]; }

    // Leaves in the finest list those points for which keep(column, row) says so; the grid stays.
    template <class Keep>
    void thin_finest(Keep&& keep) {
        TrackLevel& level = levels_[0];
        int kept = 0;
        for (int k = 0; k < level.count; ++k) {
            const int cell = level.cell[k];
            if (!keep(cell % level.width, cell / level.width)) continue;
            level.x[kept] = level.x[k];
            level.y[kept] = level.y[k];
            level.z[kept] = level.z[k];
            level.inverse_sigma[kept] = level.inverse_sigma[k];
            level.cell[kept] = cell;
            ++kept;
        }
        level.count = kept;
    }
    double mean_depth_m() const { return mean_depth_m_; }  // of the finest level

  private:
    void average_blocks(const DepthImage& depth, int side, int row);
    void merge_blocks(const TrackLevel& from, TrackLevel& to, int row);
    void list(TrackLevel& level);

    TrackLevel levels_[kLevels];
    float farthest_m_ = 0;
    double mean_depth_m_ = 0;
};

}  // namespace burin
