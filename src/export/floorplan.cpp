// SPDX-License-Identifier: MIT
#include "export/floorplan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/atomic_file.h"

namespace burin {
namespace {

enum : std::uint8_t { kNone, kWall, kFloor, kCeiling, kTable, kSeat, kWindow, kDoor };  // triangle_mesh.h

// Metres.
constexpr double kTiny = 1e-6;     // a wall that its corners have eaten up
constexpr double kGap = 0.1;       // pieces of one wall nearer than this are one: a pillar, a cable duct
constexpr double kShortest = 0.1;  // shorter pieces are left out
constexpr double kCorner = 0.25;   // walls that end this near to where they would meet do meet: corners are
                                   // the last that a scan sees, and stand behind furniture
constexpr double kOnWall = 0.2;    // doors and windows this near to a wall's line are drawn on it
constexpr double kStands = 0.3;    // objects whose foot is higher hang or stand on others
constexpr double kSmallest = 0.2;  // smaller objects are no furniture
constexpr double kNotParallel = 0.1;  // sine of the least angle at which walls are brought to meet

bool finite(Vec3d v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
bool unit(Vec3d v) { return finite(v) && std::fabs(norm(v) - 1) < 1e-3; }

Status check(const FloorPlanInput& input) {
    if (!unit(input.up_world))
        return Status::error(Code::invalid_argument, "floor plan: up (%g %g %g) is not of unit length",
                             input.up_world.x, input.up_world.y, input.up_world.z);
    for (const FloorPlanPlane& plane : input.planes) {
        if (!unit(plane.normal) || !std::isfinite(plane.offset))
            return Status::error(
                Code::invalid_argument,
                "floor plan: plane %d: normal (%g %g %g) and offset %g; expected a unit vector "
                "and a finite number",
                plane.id, plane.normal.x, plane.normal.y, plane.normal.z, plane.offset);
        for (const auto& ring : plane.rings)
            for (const Vec3d& p : ring)
                if (!finite(p))
                    return Status::error(Code::invalid_argument,
                                         "floor plan: plane %d: a corner at (%g %g %g) is not finite",
                                         plane.id, p.x, p.y, p.z);
    }
    for (std::size_t i = 0; i < input.objects.size(); ++i)
        if (!finite(input.objects[i].low) || !finite(input.objects[i].high))
            return Status::error(Code::invalid_argument, "floor plan: object %d: its box is not finite",
                                 static_cast<int>(i));
    return {};
}

double ring_area(const std::vector<PlanPoint>& ring) {
    double twice = 0;
    for (std::size_t i = 0; i < ring.size(); ++i) {
        const PlanPoint &a = ring[i], &b = ring[(i + 1) % ring.size()];
        twice += a.x * b.y - b.x * a.y;
    }
    return 0.5 * std::fabs(twice);
}

bool inside(const std::vector<PlanPoint>& ring, PlanPoint p) {
    bool in = false;
    for (std::size_t i = 0; i < ring.size(); ++i) {
        const PlanPoint &a = ring[i], &b = ring[(i + 1) % ring.size()];
        if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)) in = !in;
    }
    return in;
}

PlanPoint middle_of(const std::vector<PlanPoint>& ring) {
    PlanPoint m;
    for (const PlanPoint& p : ring) m = {m.x + p.x / double(ring.size()), m.y + p.y / double(ring.size())};
    return m;
}

// Andrew's monotone chain, counter-clockwise.
std::vector<PlanPoint> hull(std::vector<PlanPoint> points) {
    const auto turn = [](PlanPoint o, PlanPoint a, PlanPoint b) {
        return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
    };
    std::sort(points.begin(), points.end(),
              [](PlanPoint a, PlanPoint b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
    std::vector<PlanPoint> out;
    for (int pass = 0; pass < 2; ++pass) {
        const std::size_t base = out.size();
        for (const PlanPoint& p : points) {
            while (out.size() >= base + 2 && turn(out[out.size() - 2], out.back(), p) <= 1e-9) out.pop_back();
            out.push_back(p);
        }
        out.pop_back();
        std::reverse(points.begin(), points.end());
    }
    return out;
}

class Planner {
  public:
    explicit Planner(const FloorPlanInput& input) : input_(input), up_(normalised(input.up_world)) {}

    FloorPlan make() {
        place();
        for (const FloorPlanPlane& plane : input_.planes) {
            if (plane.label == kWall) add_segments(plane, kGap, &plan_.walls);
            // A door's leaf, its panels and its frame may be planes of their own.
            if (plane.label == kDoor) add_segments(plane, 1, &plan_.doors);
            if (plane.label == kWindow) add_segments(plane, 1, &plan_.windows);
        }
        close_corners();
        put_on_walls(&plan_.doors);
        put_on_walls(&plan_.windows);
        add_areas();
        return std::move(plan_);
    }

  private:
    Vec3d to_plan(Vec3d p) const { return plan_.T_plan_world * p; }
    Vec3d along(const FloorPlanPlane& plane) const { return normalised(cross(up_, plane.normal)); }
    void place();
    void add_segments(const FloorPlanPlane& plane, double gap, std::vector<PlanSegment>* out) const;
    void close_corners();
    void put_on_walls(std::vector<PlanSegment>* list) const;
    void add_areas();

    const FloorPlanInput& input_;
    Vec3d up_;
    FloorPlan plan_;
};

// The frame: the floor with the largest outline, the longest wall.
void Planner::place() {
    int least = 0;
    for (int i = 1; i < 3; ++i)
        if (std::fabs(up_[i]) < std::fabs(up_[least]) - 1e-9) least = i;
    Vec3d world_x;
    world_x[least] = 1;
    Vec3d x = normalised(world_x - up_ * dot(world_x, up_)), best = x;
    double longest = 0, widest = -1, floor = 0, lowest = 1e300;
    for (const FloorPlanPlane& plane : input_.planes) {
        double low = 1e300, high = -1e300, height = 0, count = 0;
        Vec3d box_low{1e300, 1e300, 1e300}, box_high{-1e300, -1e300, -1e300};
        for (const auto& ring : plane.rings)
            for (const Vec3d& p : ring) {
                low = std::min(low, dot(along(plane), p));
                high = std::max(high, dot(along(plane), p));
                height += dot(up_, p);
                ++count;
                lowest = std::min(lowest, dot(up_, p));
                for (int a = 0; a < 3; ++a) {
                    box_low[a] = std::min(box_low[a], p[a]);
                    box_high[a] = std::max(box_high[a], p[a]);
                }
            }
        if (count == 0) continue;
        if (plane.label == kWall && high - low > longest) {
            longest = high - low;
            best = along(plane);
        }
        if (plane.label == kFloor && norm(box_high - box_low) > widest) {
            widest = norm(box_high - box_low);
            floor = height / count;
        }
    }
    if (widest < 0 && lowest < 1e300) floor = lowest;
    for (int quarter = 0; quarter < 4; ++quarter, best = cross(up_, best))
        if (longest > 0 && dot(best, x) > 0.7071) {
            x = best;
            break;
        }
    const Vec3d y = cross(up_, x);
    plan_.T_plan_world = {{{x.x, x.y, x.z, y.x, y.y, y.z, up_.x, up_.y, up_.z}}, {0, 0, -floor}};
}

// One segment for each stretch of the plane's line that its rings cover.
void Planner::add_segments(const FloorPlanPlane& plane, double gap, std::vector<PlanSegment>* out) const {
    struct Piece {
        double low, high, foot, top;
    };
    const Vec3d u = along(plane), level = plane.normal - up_ * dot(up_, plane.normal);
    if (norm(level) < 0.5) return;  // called a wall, and lies flat: nothing that a plan can show
    std::vector<Piece> pieces;
    for (const auto& ring : plane.rings) {
        Piece piece{1e300, -1e300, 1e300, -1e300};
        for (const Vec3d& p : ring) {
            piece.low = std::min(piece.low, dot(u, p));
            piece.high = std::max(piece.high, dot(u, p));
            piece.foot = std::min(piece.foot, to_plan(p).z);
            piece.top = std::max(piece.top, to_plan(p).z);
        }
        if (!ring.empty()) pieces.push_back(piece);
    }
    std::sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) { return a.low < b.low; });
    std::vector<Piece> joined;
    for (const Piece& piece : pieces) {
        if (joined.empty() || piece.low > joined.back().high + gap) {
            joined.push_back(piece);
            continue;
        }
        Piece& last = joined.back();
        last = {last.low, std::max(last.high, piece.high), std::min(last.foot, piece.foot),
                std::max(last.top, piece.top)};
    }
    // The plane's line on the floor; a wall leans by its fit's error at most, taken half way up.
    for (const Piece& piece : joined) {
        if (piece.high - piece.low < kShortest) continue;
        const double height = 0.5 * (piece.foot + piece.top) - plan_.T_plan_world.t.z;  // along up, world
        const double off = -(plane.offset + dot(plane.normal, up_) * height) / dot(level, level);
        const Vec3d a = to_plan(u * piece.low + level * off), b = to_plan(u * piece.high + level * off);
        out->push_back({plane.id, {a.x, a.y}, {b.x, b.y}, piece.foot, piece.top - piece.foot});
    }
}

void Planner::close_corners() {
    const std::vector<PlanSegment> before = plan_.walls;
    for (PlanSegment& wall : plan_.walls)
        for (PlanPoint* end : {&wall.from, &wall.to}) {
            double nearest = kCorner;
            const PlanPoint from = *end;
            const double ax = wall.to.x - wall.from.x, ay = wall.to.y - wall.from.y;
            for (const PlanSegment& other : before) {
                const double bx = other.to.x - other.from.x, by = other.to.y - other.from.y;
                const double cross_ab = ax * by - ay * bx, length = std::hypot(bx, by);
                if (length < kTiny) continue;
                if (std::fabs(cross_ab) < kNotParallel * std::hypot(ax, ay) * length) continue;
                const double s = ((other.from.x - from.x) * by - (other.from.y - from.y) * bx) / cross_ab;
                const PlanPoint meet{from.x + s * ax, from.y + s * ay};
                // Where on the other wall, metres from its start.
                const double t = ((meet.x - other.from.x) * bx + (meet.y - other.from.y) * by) / length;
                const double move = std::hypot(meet.x - from.x, meet.y - from.y);
                if (t < -kCorner || t > length + kCorner || move >= nearest) continue;
                nearest = move;
                *end = meet;
            }
        }
}

void Planner::put_on_walls(std::vector<PlanSegment>* list) const {
    for (PlanSegment& s : *list) {
        double nearest = kOnWall;
        const PlanPoint m{0.5 * (s.from.x + s.to.x), 0.5 * (s.from.y + s.to.y)};
        PlanSegment moved = s;
        for (const PlanSegment& wall : plan_.walls) {
            const double length = std::hypot(wall.to.x - wall.from.x, wall.to.y - wall.from.y);
            if (length < kTiny) continue;
            const double ux = (wall.to.x - wall.from.x) / length, uy = (wall.to.y - wall.from.y) / length;
            const double t = (m.x - wall.from.x) * ux + (m.y - wall.from.y) * uy;
            const double off = (m.x - wall.from.x) * -uy + (m.y - wall.from.y) * ux;
            if (t < 0 || t > length || std::fabs(off) >= nearest) continue;
            if (ux * (s.to.x - s.from.x) + uy * (s.to.y - s.from.y) <= 0) continue;  // the wall's other side
            nearest = std::fabs(off);
            const auto on = [&](PlanPoint p) {
                const double along = (p.x - wall.from.x) * ux + (p.y - wall.from.y) * uy;
                return PlanPoint{wall.from.x + along * ux, wall.from.y + along * uy};
            };
            moved.from = on(s.from);
            moved.to = on(s.to);
        }
        s = moved;
    }
    // Those that lie upon each other are one: the longest stays.
    std::stable_sort(list->begin(), list->end(), [](const PlanSegment& a, const PlanSegment& b) {
        return std::hypot(a.to.x - a.from.x, a.to.y - a.from.y) >
               std::hypot(b.to.x - b.from.x, b.to.y - b.from.y);
    });
    std::vector<PlanSegment> kept;
    for (const PlanSegment& s : *list) {
        const PlanPoint m{0.5 * (s.from.x + s.to.x), 0.5 * (s.from.y + s.to.y)};
        const bool again = std::any_of(kept.begin(), kept.end(), [&](const PlanSegment& k) {
            const double length = std::hypot(k.to.x - k.from.x, k.to.y - k.from.y);
            const double ux = (k.to.x - k.from.x) / length, uy = (k.to.y - k.from.y) / length;
            const double t = (m.x - k.from.x) * ux + (m.y - k.from.y) * uy;
            const double off = (m.x - k.from.x) * -uy + (m.y - k.from.y) * ux;
            return t >= 0 && t <= length && std::fabs(off) < kOnWall;
        });
        if (!again) kept.push_back(s);
    }
    std::stable_sort(kept.begin(), kept.end(),
                     [](const PlanSegment& a, const PlanSegment& b) { return a.id < b.id; });
    *list = std::move(kept);
}

void Planner::add_areas() {
    for (const FloorPlanObject& object : input_.objects) {
        std::vector<PlanPoint> corners;
        double foot = 1e300;
        for (int i = 0; i < 8; ++i) {
            const Vec3d p =
                to_plan({i & 1 ? object.high.x : object.low.x, i & 2 ? object.high.y : object.low.y,
                         i & 4 ? object.high.z : object.low.z});
            corners.push_back({p.x, p.y});
            foot = std::min(foot, p.z);
        }
        PlanOutline outline{object.label == kSeat ? kSeat : kNone, hull(std::move(corners))};
        double reach = 0;
        for (const PlanPoint& p : outline.ring)
            for (const PlanPoint& q : outline.ring) reach = std::max(reach, std::hypot(p.x - q.x, p.y - q.y));
        if (foot <= kStands && reach >= kSmallest) plan_.furniture.push_back(std::move(outline));
    }
    const std::size_t objects = plan_.furniture.size();
    for (const FloorPlanPlane& plane : input_.planes) {
        std::vector<std::vector<PlanPoint>> rings;
        for (const auto& ring : plane.rings) {
            rings.emplace_back();
            for (const Vec3d& p : ring) rings.back().push_back({to_plan(p).x, to_plan(p).y});
            if (ring.size() < 3) rings.pop_back();
        }
        if (rings.empty()) continue;
        if (plane.label == kFloor) plan_.free_space.push_back(rings);
        if ((plane.label != kTable && plane.label != kSeat) || dot(plane.normal, up_) < 0.9) continue;
        const auto largest = std::max_element(rings.begin(), rings.end(), [](const auto& a, const auto& b) {
            return ring_area(a) < ring_area(b);
        });
        bool known = false;  // the object around a seat stands for it
        for (std::size_t i = 0; i < objects && plane.label == kSeat; ++i)
            known = known || inside(plan_.furniture[i].ring, middle_of(*largest));
        if (!known) plan_.furniture.push_back({plane.label, *largest});
    }
}

}  // namespace

Result<FloorPlan> make_floor_plan(const FloorPlanInput& input) {
    BURIN_TRY(check(input));
    return Planner(input).make();
}

Status write_floor_plan(const std::string& svg_path, const std::string& json_path,
                        const FloorPlanInput& input) {
    Result<FloorPlan> plan = make_floor_plan(input);
    if (!plan) return plan.status();
    const std::string svg = floor_plan_svg(*plan), json = floor_plan_json(*plan);
    BURIN_TRY(write_file_atomically(svg_path.c_str(), svg.data(), svg.size()));
    return write_file_atomically(json_path.c_str(), json.data(), json.size());
}

}  // namespace burin
