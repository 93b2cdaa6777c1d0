// SPDX-License-Identifier: MIT
// What a component of a mesh covers of the plane it stands on, and its parts: things that nearly touch come
// out of a mesh as one, but seen from above a neck is left between them.
#pragma once

#include <cstdint>

#include "core/vec.h"
#include "planes/plane_extent.h"

namespace burin {

struct FootprintMemory {            // the caller's; its content is of no use before and after
    std::uint8_t* kinds = nullptr;  // `cells` bytes
    std::uint8_t* depths = nullptr;
    std::uint32_t* parents = nullptr;  // `cells` words
    std::uint64_t cells = 0;           // 0: nothing is ever split
};

class Footprint {
  public:
    static constexpr int kMostParts = 64;  // more are no things
    // On the level plane of `support`, cells of `cell_m` over low .. high along its two axes (metres from the
    // world's origin), or of 2, 4, ... times that where there is no room. False: it covers nothing.
    bool begin(const FootprintMemory& memory, const PlaneExtent& support, const double low[2],
               const double high[2], double cell_m);
    // Surface above the cell of x. low: so near to the plane that it stands on it there.
    void mark(Vec3d x, bool low);
    // Cuts the covered cells where they are narrow. Returns how many parts there are; 1: it is one thing.
    int split();
    // Of 0 .. parts - 1; x must be above a covered cell.
    int part_at(Vec3d x) const;

  private:
    static constexpr std::uint32_t kNone = 0xffffffffu;
    std::size_t cell_at(Vec3d x) const;
    std::uint32_t root_of(std::uint32_t cell);
    void fill_inside();
    void measure_depths();
    void flood();
    bool join_what_hangs();

    std::uint8_t* kinds_ = nullptr;
    std::uint8_t* depths_ = nullptr;
    std::uint32_t* parents_ = nullptr;
    int width_ = 0, height_ = 0;  // with a rim of one uncovered cell all around
    double cell_m_ = 0, low_[2] = {};
    Vec3d axis_[2];
    std::uint32_t root_[kMostParts] = {};
    int parts_ = 0;
};

}  // namespace burin
