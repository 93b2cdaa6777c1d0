// SPDX-License-Identifier: MIT
// Which of the finest level's points are worth their time: those that hold a motion that few others hold.
#pragma once

#include "core/arena.h"
#include "core/jobs.h"
#include "track/grey_image.h"
#include "track/track_points.h"

namespace burin {

// The points of a cell of the middle level are judged together, by the share of the information that the cell
// has: with J of its depth (normal and lever arm) and of its brightness (image gradient), J^T A^-1 J where A
// sums over all cells. A wall's thousand equal cells have little each; a lamp in front of it has much.
// (Statistical leverage; the idea of sampling for stability is Gelfand, Ikemoto, Rusinkiewicz, Levoy,
// "Geometrically stable sampling for the ICP algorithm", 3DIM 2003.)
class PointSelection {
  public:
    void place(Arena& arena);
    // Shortens the finest list to about half. brightness: null without colour. Reads the grids of levels 0
    // and 1.
    void select(TrackPoints& points, const PointBrightness* brightness, Jobs& jobs);

  private:
    float* leverage_ = nullptr;  // a cell of level 1
    float* rows_ = nullptr;      // 12 a cell: J of depth, J of brightness
};

}  // namespace burin
