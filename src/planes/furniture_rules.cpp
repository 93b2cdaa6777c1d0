// SPDX-License-Identifier: MIT
#include "planes/label_rules.h"

namespace burin {
namespace {

constexpr double kTableNarrow = 0.45;    // least depth of a table; shelves and benches have 0.2 to 0.4
constexpr double kSeatHigh = 0.5;        // EN 1335: 0.38 to 0.5
constexpr double kSeatDeep = 0.8;        // no seat is deeper
constexpr double kSeatArea = 0.08;       // m^2; a stool of 0.32 across
constexpr double kChairWide = 0.6;       // no seat for one is wider, hardly a table is that short
constexpr double kBedNarrow = 1.25;      // a low surface wider than this both ways is a bed or a platform
constexpr double kBedHigh = 0.7;         //
constexpr double kBackRise = 0.15;       // a back rest ends at least this far above its seat,
constexpr double kBackGap = 0.12;        // and stands at most this far behind it: rounded edges leave a gap
constexpr double kHeadroom = 0.7;        // nobody sits with less above; boards of a shelf have 0.2 to 0.5
constexpr double kCabinetNarrow = 0.55;  // sideboards are no deeper, worktops have 0.6
constexpr double kPlinth = 0.15;         // a closed front begins this near to the floor,
constexpr double kHiddenLeg = 0.25;      // a top hides as much of its legs from who looks down on it
constexpr double kTopThick = 0.1;        // and ends this near below its top

}  // namespace

// Boards of a shelf lie above each other with the same outline; a chair under its table has another.
bool LabelRules::under_board(int i) const {
    const double own = at(i).reach(0) * at(i).reach(1);
    for (int k = 0; k < count; ++k) {
        const double gap = at(k).middle(2) - at(i).middle(2);
        if ((!is(k, Facing::up) && !is(k, Facing::down)) || gap < kTopThick || gap > kHeadroom) continue;
        const double other = at(k).reach(0) * at(k).reach(1), both = common_area(at(i), at(k));
        if (both >= kHalf * (own + other - both)) return true;
    }
    return false;
}

int LabelRules::back_of(int i) const {
    const double height_of_back = height(i) + kBackRise;
    for (int k = 0; k < count; ++k) {
        if (!is(k, Facing::sideways) || labels[k] == kLabelWall) continue;
        if (top(k) < height_of_back || foot(k) > height_of_back) continue;
        const Interval d = depth(i, k);
        if (std::fabs(d.low) <= kBackGap && d.high >= kSeatLow && along(i, k) >= kHalf * at(i).narrow())
            return k;
    }
    return -1;
}

bool LabelRules::over_closed_front(int i) const {
    for (int k = 0; k < count; ++k) {
        if (!is(k, Facing::sideways) || foot(k) > kPlinth || top(k) > height(i) + kOverhang) continue;
        if (top(k) >= height(i) - kTopThick && std::fabs(depth(i, k).high) <= kOverhang &&
            along(i, k) >= kFrontShare * at(i).wide())
            return true;
    }
    return false;
}

void LabelRules::label_top(int i) {
    const double h = height(i), narrow = at(i).narrow(), wide = at(i).wide();
    if (!is(i, Facing::up) || labels[i] != kLabelNone || h < kSeatLow || h > kTableHigh) return;
    if (area(i) < kSeatArea || under_board(i)) return;
    if (h <= kSeatHigh && narrow >= kSeatLow && narrow <= kSeatDeep) {
        if (const int back = back_of(i); back >= 0) {
            labels[i] = labels[back] = kLabelSeat;
            return;
        }
    }
    if (narrow < kCabinetNarrow && over_closed_front(i)) return;
    const bool bench_or_stool = narrow >= kSeatLow && (narrow < kTableNarrow || wide < kChairWide);
    if (h <= kSeatHigh && bench_or_stool)
        labels[i] = kLabelSeat;
    else if (narrow >= kTableNarrow && (h > kBedHigh || narrow < kBedNarrow))
        labels[i] = kLabelTable;
}

// Undersides and legs go with their top: what lies below, within its outline, and reaches up to it.
void LabelRules::label_part(int i) {
    if (labels[i] != kLabelNone || is(i, Facing::up) || is(i, Facing::sloped)) return;
    for (int k = 0; k < count; ++k) {
        if (!is(k, Facing::up) || (labels[k] != kLabelTable && labels[k] != kLabelSeat)) continue;
        const double gap = at(k).middle(2) - at(i).high[2];
        bool inside = gap >= -kOverhang && gap <= (is(i, Facing::sideways) ? kHiddenLeg : kTopThick);
        for (int a = 0; a < 2; ++a) {
            const Interval c = cover(at(i), at(k).axis[a]);
            inside = inside && c.low >= at(k).low[a] - kOverhang && c.high <= at(k).high[a] + kOverhang;
        }
        if (!inside) continue;
        labels[i] = labels[k];
        return;
    }
}

// Without a floor in view heights mean nothing; what the camera looks down on from near is a table.
void LabelRules::label_tables_without_floor() {
    for (int i = 0; i < count; ++i) {
        if (!is(i, Facing::up) || area(i) < kLeastArea || at(i).narrow() < kTableNarrow) continue;
        const double drop = camera ? camera_height() - at(i).middle(2) : 0;
        if (drop >= 0 && drop < kTableHigh && !under_board(i)) labels[i] = kLabelTable;
    }
}

void LabelRules::label_furniture() {
    if (!has_floor) label_tables_without_floor();
    for (int i = 0; has_floor && i < count; ++i) label_top(i);
    for (int i = 0; i < count; ++i) label_part(i);
}

}  // namespace burin
