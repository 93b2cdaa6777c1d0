// SPDX-License-Identifier: MIT
// The rules of classify_planes with their limits, shared by its files. All lengths in metres, heights above
// the floor where there is one. Where a source is named it gives the size of the thing itself; the limits
// leave room for what a scan does not see of it.
#pragma once

#include "planes/classify.h"

namespace burin {

struct LabelRules {
    const PlaneShape* planes;
    int count;
    Vec3d up;
    const Vec3d* camera;  // mean position, or null
    const PlaneExtent* extents;
    std::uint8_t* labels;
    bool has_floor = false;
    double floor = 0;  // along up, world
    bool has_ceiling = false;
    double ceiling = 0;  // above the floor

    const PlaneExtent& at(int i) const { return extents[i]; }
    bool is(int i, Facing facing) const { return extents[i].facing == facing; }
    double area(int i) const { return planes[i].area_m2; }
    double camera_height() const { return dot(*camera, up); }
    double height(int i) const { return at(i).middle(2) - floor; }
    double top(int i) const { return at(i).high[2] - floor; }
    double foot(int i) const { return at(i).low[2] - floor; }
    // How far thing i stands before the upright plane q: its nearest point and its farthest.
    Interval depth(int i, int q) const {
        const Interval c = cover(at(i), planes[q].normal);
        const double rise = dot(planes[q].normal, up) * at(i).middle(2) + planes[q].offset;
        return {c.low + rise, c.high + rise};
    }
    // Metres of the width of the upright plane q that thing i covers.
    double along(int i, int q) const {
        return common({at(q).low[0], at(q).high[0]}, cover(at(i), at(q).axis[0]));
    }

    // In this order; each leaves alone what has a label.
    void label_floor_and_ceiling();  // classify.cpp
    void label_walls();              // wall_rules.cpp
    void label_furniture();          // furniture_rules.cpp
    void label_doors_and_windows();  // wall_rules.cpp

  private:
    bool under_board(int i) const;
    int back_of(int i) const;
    bool over_closed_front(int i) const;
    void label_top(int i);
    void label_part(int i);
    void label_tables_without_floor();
    bool can_be_wall(int i) const;
    bool backed(int i) const;
    bool built_onto(int i) const;
    void label_fixture(int i);
};

// More than noise, so that it may decide about other planes, m^2.
constexpr double kLeastArea = 0.25;
// What stands before or behind something counts when it covers half of it.
constexpr double kHalf = 0.5;
// Of legs beyond their top, of a fitted edge beyond the true one.
constexpr double kOverhang = 0.05;
// Seats are higher, what lies lower is a step or a plinth (EN 1335: 0.38 to 0.5).
constexpr double kSeatLow = 0.3;
// Desks 0.62 to 0.85 (EN 527), bar tables 1.1.
constexpr double kTableHigh = 1.15;
// Of a thing's width or height: it closes its front, it fills its side.
constexpr double kFrontShare = 0.6;

}  // namespace burin
