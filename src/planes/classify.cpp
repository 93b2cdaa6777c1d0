// SPDX-License-Identifier: MIT
#include "planes/classify.h"

#include "planes/label_rules.h"

namespace burin {
namespace {

constexpr double kFloorShare = 0.1;      // of the largest level plane: what noise puts below a floor is less
constexpr double kSameLevel = 0.03;      // carpets and thresholds: walked over as the floor is
constexpr double kEyeAboveTable = 1.0;   // a table is looked at from 0.3 to 0.9 above it, a floor from more
constexpr double kTableArea = 2.0;       // m^2; a table for six has 1.8 x 1.0
constexpr double kBelow = 0.3;           // what has something this far below itself is no floor
constexpr double kRoomHeight = 2.1;      // no ceiling is lower; shelves end below it
constexpr double kCeilingArea = 1.0;     // m^2; lamps are smaller and hang lower than the ceiling
constexpr double kGravityGood = 0.9962;  // cos 5 degrees: no direction of gravity is given worse than that

}  // namespace

void LabelRules::label_floor_and_ceiling() {
    double largest = 0;
    for (int i = 0; i < count; ++i)
        if (is(i, Facing::up) && area(i) > largest) largest = area(i);
    int lowest = -1;
    for (int i = 0; i < count; ++i) {
        if (!is(i, Facing::up) || area(i) < kLeastArea || area(i) < kFloorShare * largest) continue;
        if (camera && at(i).middle(2) > camera_height()) continue;
        if (lowest < 0 || at(i).middle(2) < at(lowest).middle(2)) lowest = i;
    }
    if (lowest >= 0) {
        const double height = at(lowest).middle(2);
        bool below = false, above = false;
        for (int i = 0; i < count; ++i) {
            if (is(i, Facing::sloped) || area(i) < kLeastArea) continue;
            below = below || at(i).low[2] < height - kBelow;
            above = above || (is(i, Facing::up) && at(i).middle(2) > height + kSeatLow &&
                              at(i).middle(2) < height + kTableHigh);
        }
        const bool far_below = camera && camera_height() - height >= kEyeAboveTable;
        // Too large for a table it is a floor, whatever goes on below (stairs, a gallery).
        has_floor = area(lowest) >= kTableArea || (!below && (far_below || above));
        if (has_floor) floor = height;
    }
    int highest = -1;
    const auto overhead = [&](int i) {
        if (!is(i, Facing::down)) return false;
        return has_floor ? height(i) >= kRoomHeight : camera && at(i).middle(2) >= camera_height() + kBelow;
    };
    for (int i = 0; i < count; ++i) {
        if (has_floor && is(i, Facing::up) && std::fabs(height(i)) <= kSameLevel) labels[i] = kLabelFloor;
        if (overhead(i) && (highest < 0 || area(i) > area(highest))) highest = i;
    }
    if (highest < 0) return;
    has_ceiling = true;
    ceiling = height(highest);
    for (int i = 0; i < count; ++i)
        if (overhead(i) && (area(i) >= kCeilingArea || std::fabs(height(i) - ceiling) <= kSameLevel))
            labels[i] = kLabelCeiling;
}

void classify_planes(const PlaneShape* planes, int count, Vec3d up_world, const Vec3d* mean_camera_position,
                     PlaneExtent* scratch, std::uint8_t* labels) {
    // Along a corridor of 20 m a direction that is 1 degree off is 0.35 m off in height: the floor and the
    // walls know it better.
    Vec3d up = estimate_up(planes, count, up_world);
    if (!(dot(up, up_world) >= kGravityGood)) up = up_world;
    for (int i = 0; i < count; ++i) {
        scratch[i] = extent_of(planes[i], up);
        labels[i] = kLabelNone;
    }
    LabelRules rules{planes, count, up, mean_camera_position, scratch, labels};
    rules.label_floor_and_ceiling();
    rules.label_walls();
    rules.label_furniture();
    rules.label_doors_and_windows();
}

}  // namespace burin
