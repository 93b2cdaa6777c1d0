// SPDX-License-Identifier: MIT
// What ICP aligns to: a surface as one camera sees it, points and normals on the grids of TrackPoints'
// levels.
#pragma once

#include "core/arena.h"
#include "core/jobs.h"
#include "map/volume.h"
#include "simd/associate.h"
#include "track/track_points.h"

namespace burin {

// Points on a grid, rows of `width`, in the coordinates of the camera that sees them; z = 0: none.
struct PointGrid {
    int width = 0, height = 0;
    const float *x = nullptr, *y = nullptr, *z = nullptr;
};
inline PointGrid grid_of(const TrackLevel& level) {
    return {level.width, level.height, level.grid_x, level.grid_y, level.grid_z};
}

// Unit normal of the surface at a cell, towards the camera: of the central differences, or of one side where
// the other neighbour is missing or the surface breaks. Zero where that leaves nothing.
Vec3f grid_normal(const PointGrid& grid, int cell);

class ReferenceView {
  public:
    void place(Arena& arena, int max_width, int max_height);

    // The map, cast from T_world_reference (KinectFusion 2011, section 3.3), at the grid of level `finest` of
    // a camera whose finest level has `camera`; coarser levels average four cells. Levels finer than `finest`
    // answer with it. From finest = 1 on with the brightness of the map's colours, where it has any.
    void look_from(const Volume& volume, const Camera& camera, const Se3& T_world_reference,
                   float max_depth_m, int finest, Jobs& jobs);
    // A frame's own points, all levels.
    void look_at_frame(const TrackPoints& points, const Se3& T_world_reference, Jobs& jobs);

    const Se3& T_world_reference() const { return T_world_reference_; }
    // What the points of a level are to be associated with. Cells without surface have NaN for a normal.
    simd::SurfaceGrid grid(int level) const;
    int finest() const { return finest_; }
    bool has_grey() const { return has_grey_; }
    // Brightness (see GreyImage) beside the cells, negative where there is none. Levels from finest() on.
    const float* grey(int level) const { return levels_[level].grey; }
    const Camera& camera(int level) const { return levels_[level].camera; }
    const float* depth(int level) const { return levels_[level].point[2]; }
    int cells(int level) const;  // with surface

  private:
    struct Level {
        Camera camera;
        float* point[3] = {};
        float* normal[3] = {};
        float* grey = nullptr;  // not of the finest
    };
    void cast(const Volume& volume, float max_depth_m, Level& to, Jobs& jobs);
    static void merge(const Level& from, Level& to);
    static void add_normals(Level& level, Jobs& jobs);

    Level levels_[TrackPoints::kLevels];
    int finest_ = 0;
    bool has_grey_ = false;
    std::uint8_t* rgb_ = nullptr;  // of a cast at level 1
    Se3 T_world_reference_;
};

}  // namespace burin
