// SPDX-License-Identifier: MIT
// Where a plane was seen: its patches' columns of voxels on one grid. From it come outlines, areas, and which
// of the missing cells the plane completes.
#pragma once

#include <cstdint>

#include "core/arena.h"
#include "map/overlay.h"
#include "map/volume.h"
#include "planes/footprint.h"
#include "planes/grid_fill.h"
#include "planes/outline.h"
#include "planes/plane_set.h"

namespace burin {

struct ChunkPlanes;

// The grid of one plane: columns of voxels along its axis, `step` voxels wide. Cell (u, v) covers voxels
// (u0 + u) step .. of the first of the two other axes, and likewise v.
struct ExtentGrid {
    CellGrid grid;
    int axis = 0, across = 1, along = 2;  // across: of u; along: of v
    std::int32_t u0 = 0, v0 = 0;          // in cells
    int step = 1;                         // voxels
    double cell_m = 0;
    Vec3d normal;
    double offset = 0;
    // The point of the plane above corner (u, v) of the cells.
    Vec3d point(double u, double v) const;
    std::uint64_t seen_cells() const;
    // Square metres of the plane that a cell stands for.
    double cell_area() const;
};

class PlaneExtents {
  public:
    void place(Arena& arena, const VolumeShape& shape);

    // The cells where the plane was seen, small gaps closed. False: it has no patches.
    bool raster(const Overlay& overlay, const ChunkPlanes* chunks, const PlaneSet& set, std::uint16_t plane,
                ExtentGrid* out);
    // Of the grid as it is now; ring points are corners of cells. Valid until the next call here.
    Outline outline(const ExtentGrid& grid, CellMask mask, OutlineCounts* counts);
    // Blocks the cells that were seen empty, and where other planes cross, and fills what the plane
    // completes. Returns how many cells.
    std::uint64_t complete(const Volume& volume, const Overlay& overlay, const ChunkPlanes* chunks,
                           const PlaneSet& set, std::uint16_t plane, const ExtentGrid& grid);

    // Memory for others until the next call here.
    FootprintMemory lend();

  private:
    void block_empty(const Volume& volume, const ExtentGrid& grid) const;
    void block_crossing(const Overlay& overlay, const ChunkPlanes* chunks, const PlaneSet& set,
                        std::uint16_t plane, const ExtentGrid& grid) const;
    std::uint32_t meeting_points(const PlaneSet& set, std::uint16_t plane, const ExtentGrid& grid);
    void fill_hull(const PlaneSet& set, std::uint16_t plane, const ExtentGrid& grid,
                   std::uint64_t hull_cells);
    void drop_closed_in(const Volume& volume, const ExtentGrid& grid) const;

    static constexpr int kCells = 1 << 19;  // 13 m^2 at 5 mm; larger planes have cells of 2, 4, ... voxels
    static constexpr int kSide = 4096;      // cells; no longer side
    static constexpr std::uint32_t kRuns = 1 << 15, kPoints = 1 << 15, kRings = 1 << 10, kMeetings = 512;
    double voxel_m_ = 0;
    std::uint8_t* cells_ = nullptr;
    std::uint8_t* trace_ = nullptr;
    std::uint64_t* words_ = nullptr;
    CellRun* runs_ = nullptr;
    CellPoint* points_ = nullptr;
    OutlineRing* rings_ = nullptr;
    CellPoint* meetings_ = nullptr;
    std::int32_t* spans_ = nullptr;
    std::int32_t* chain_ = nullptr;
};

}  // namespace burin
