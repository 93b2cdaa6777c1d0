// SPDX-License-Identifier: MIT
#include "planes/label_rules.h"

namespace burin {
namespace {

constexpr double kWallArea = 0.5;      // m^2 seen,
constexpr double kWallReach = 2.0;     // m^2; or of its rectangle, behind furniture or far away
constexpr double kWallNarrow = 0.5;    // pillars, sides of shelves and skirting boards are less
constexpr double kWallTop = 1.2;       // what ends lower (a sofa's back, a desk's front) is furniture,
constexpr double kWallSure = 2.0;      // m^2; unless it is this large: a wall of which the foot was seen
constexpr double kSideWide = 1.0;      // narrower than this it may be a wardrobe's side (0.6 deep, 2.0 high),
constexpr double kWardrobeTop = 2.25;  // but then it ends lower than this
constexpr double kCeilingGap = 0.1;    // chimney breasts and steps in a wall end this near to the ceiling
constexpr double kNoDepth = 0.008;     // two fits of one plane; a pane or a picture is off by more
constexpr double kBackingDepth = 0.6;  // furniture that stands before a wall is no deeper
constexpr double kFlush = 0.12;        // doors and windows lie this near to their wall's plane
constexpr double kFixtureArea = 2.8;   // m^2; a door of 1.3 x 2.1, a large window; more is a wall of its own
constexpr double kParallel = 0.9848;   // cos 10 degrees
constexpr double kPerpendicular = 0.26;  // sin 15 degrees

// Doors (DIN 18101: leaves 0.61 to 1.24 wide, 1.99 and 2.1 high; the raised panels of a leaf are less).
constexpr double kDoorNarrow = 0.5, kDoorWide = 1.3;
constexpr double kDoorFoot = 0.25, kDoorLow = 1.7, kDoorHigh = 2.4;
constexpr double kDoorFilled = 0.18;    // of its rectangle: a leaf seen between its panels fills 0.2 to 0.46,
                                        // a frame of 0.07 around it 0.16, with noise 0.19
constexpr double kWindowFilled = 0.15;  // glass is seen in patches; its frame alone fills 0.09
constexpr double kStandOut = 0.15;      // boards of a shelf stand out further from its back, handles do not
// Windows: sills are at 0.8 to 1.0. A pane flush with the wall must be larger than pictures are.
constexpr double kSill = 0.5;
constexpr double kWindowNarrow = 0.8, kWindowArea = 1.0;  // m, m^2 of its rectangle
constexpr double kRecess = -0.03, kRecessNarrow = 0.4;    // no picture lies behind its wall

}  // namespace

// Large and upright, high enough, and not of a shape that furniture has.
bool LabelRules::can_be_wall(int i) const {
    if (!is(i, Facing::sideways) || area(i) < kLeastArea) return false;
    if (area(i) < kWallArea && at(i).reach(0) * at(i).reach(2) < kWallReach) return false;
    if (at(i).reach(0) < kWallNarrow || at(i).reach(2) < kWallNarrow) return false;
    if (!has_floor) return true;
    if (at(i).reach(0) < kSideWide && top(i) < kWardrobeTop) return false;
    return top(i) >= kWallTop || area(i) >= kWallSure;
}

// A larger plane that looks the same way lies close behind, or a little before: this is what hangs on a wall,
// stands at it, or is let into it.
bool LabelRules::backed(int i) const {
    if (has_ceiling && top(i) >= ceiling - kCeilingGap && at(i).reach(0) >= kSideWide) return false;
    for (int k = 0; k < count; ++k) {
        if (!is(k, Facing::sideways) || !(area(k) > area(i))) continue;
        if (dot(planes[k].normal, planes[i].normal) < kParallel) continue;
        const Interval d = depth(i, k);
        const double gap = 0.5 * (d.low + d.high);
        if (std::fabs(gap) <= kNoDepth || gap < -kFlush || gap > kBackingDepth) continue;
        if (along(i, k) < kHalf * at(i).reach(0)) continue;
        if (gap > kFlush || area(i) < kFixtureArea) return true;
    }
    return false;
}

void LabelRules::label_walls() {
    for (int i = 0; i < count; ++i)
        if (labels[i] == kLabelNone && can_be_wall(i) && !backed(i)) labels[i] = kLabelWall;
}

// Boards or sides that stand out from it and take most of its width or height: a shelf, or what would not
// let a door open.
bool LabelRules::built_onto(int i) const {
    for (int k = 0; k < count; ++k) {
        if (is(k, Facing::sloped) || labels[k] == kLabelFloor || labels[k] == kLabelCeiling ||
            labels[k] == kLabelWall)
            continue;
        if (std::fabs(dot(planes[k].normal, planes[i].normal)) > kPerpendicular) continue;
        const Interval d = depth(k, i);
        if (d.low > kOverhang || d.high < kStandOut) continue;
        const Interval own{at(i).low[0], at(i).high[0]}, other = cover(at(k), at(i).axis[0]);
        if (is(k, Facing::sideways)) {
            if (other.high < own.low - kOverhang || other.low > own.high + kOverhang) continue;
            const double height_both = common({at(i).low[2], at(i).high[2]}, {at(k).low[2], at(k).high[2]});
            if (height_both >= kFrontShare * at(i).reach(2)) return true;
        } else if (at(k).middle(2) > at(i).low[2] + kDoorFoot &&
                   at(k).middle(2) < at(i).high[2] - kDoorFoot &&
                   common(own, other) >= kFrontShare * at(i).reach(0)) {
            return true;
        }
    }
    return false;
}

void LabelRules::label_fixture(int i) {
    const double width = at(i).reach(0), height_m = at(i).reach(2);
    for (int q = 0; q < count; ++q) {
        if (labels[q] != kLabelWall || !is(q, Facing::sideways)) continue;
        if (dot(planes[q].normal, planes[i].normal) < kParallel) continue;
        const Interval d = depth(i, q);
        const double gap = 0.5 * (d.low + d.high);
        if (std::fabs(gap) <= kNoDepth) {  // a piece of the wall that something parts from the rest
            labels[i] = kLabelWall;
            return;
        }
        if (!has_floor || std::fabs(gap) > kFlush || along(i, q) < kHalf * width) continue;
        const bool door = foot(i) <= kDoorFoot && top(i) >= kDoorLow && top(i) <= kDoorHigh &&
                          width >= kDoorNarrow && width <= kDoorWide;
        if (door && area(i) >= kDoorFilled * width * height_m && !built_onto(i)) {
            labels[i] = kLabelDoor;
            return;
        }
        const double narrow = width < height_m ? width : height_m;
        const bool large = narrow >= kWindowNarrow && width * height_m >= kWindowArea;
        if (foot(i) >= kSill && (large || (gap <= kRecess && narrow >= kRecessNarrow)) &&
            area(i) >= kWindowFilled * width * height_m) {
            labels[i] = kLabelWindow;
            return;
        }
    }
}

void LabelRules::label_doors_and_windows() {
    for (int i = 0; i < count; ++i)
        if (labels[i] == kLabelNone && is(i, Facing::sideways)) label_fixture(i);
}

}  // namespace burin
