// SPDX-License-Identifier: MIT
// Between which depths can a ray of a camera meet chunks? For squares of pixels, so that rays start where
// there is something and end where there is nothing left (as in Voxel Hashing, Niessner 2013, section 4.5).
#pragma once

#include <atomic>
#include <cstdint>

#include "core/camera.h"
#include "core/jobs.h"
#include "core/se3.h"
#include "map/volume.h"

namespace burin {

class SurfaceBounds {
  public:
    struct Depths {
        float nearest_m, farthest_m;  // z along the optical axis; nearest > farthest: no chunk
    };

    // Projects every chunk. The result does not depend on the number of threads: bounds are least and largest
    // values.
    SurfaceBounds(const Volume& volume, const Camera& camera, const Se3& T_world_camera, float max_depth_m,
                  Jobs& jobs);

    Depths at(int x, int y) const;

  private:
    void add(Vec3f centre, float radius, const Camera& camera, float max_depth_m);

    // Enough for 8 x 8 pixels of 640 x 480; larger images get larger squares. 24 KiB on the stack.
    static constexpr int kMostSquares = 6144;
    int side_ = 8, columns_ = 0, rows_ = 0;
    float unit_m_;
    std::atomic<std::uint16_t> nearest_[kMostSquares];  // in units, rounded down and up
    std::atomic<std::uint16_t> farthest_[kMostSquares];
};

}  // namespace burin
