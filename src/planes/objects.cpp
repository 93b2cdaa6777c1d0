// SPDX-License-Identifier: MIT
#include "planes/objects.h"

namespace burin {
namespace {

// A face of an object's foot leans from its plane by more than 45 degrees; what is flatter is the plane's
// own.
constexpr double kFlat = 0.7071;
// Faces in the margin are taken ring by ring; twice the margin in edges of half a voxel.
constexpr int kRings = 8;
// Areas are summed as integers of 0.01 mm^2, so that a component of up to 42 m^2 needs one word; larger ones
// stay at that.
constexpr double kAreaUnit = 1e-8;
constexpr double kBeside = 0.5;    // of the margin: rounding; a foot further out is none
constexpr double kLegReach = 0.1;  // legs end this near below their top
constexpr double kOutside = 0.05;  // and stand out from under it by no more
constexpr double kNested = 0.5;    // of its box that lies in the box of the larger one
constexpr double kTouch = 0.01;    // metres: two voxels, the thinnest wall whose two sides are sure to join
constexpr int kProbes = 64;        // vertices of the smaller one, spread evenly, that look for the larger

// Metres above its table or floor: what comes down to there stands on it. Faces nearer than the margin are
// feet and count for nothing here, so that this is more than twice the margin.
constexpr double kStanding = 0.025;
constexpr double kFootprintCell = 0.5;  // of the margin: a voxel, so that no cell between faces stays bare

// What a face is in the work array, before it has the number of its object.
constexpr std::uint32_t kCore = kNoObject - 1;
// A foot, and the plane it stands on: 65533 planes at most count, as many objects are never asked for.
constexpr std::uint32_t kFirstFoot = 0xffff0000u;
constexpr int kMostPlanes = 0xfffd;

struct Face {
    Vec3d corner[3];
    Vec3d normal;  // unit
    double area = 0;
};

class Finder {
  public:
    Finder(const ObjectInput& mesh, const ObjectOptions& options, std::uint32_t* scratch)
        : mesh_(mesh),
          options_(options),
          parent_(scratch),
          weight_(scratch + mesh.vertices),
          face_(scratch + 2 * mesh.vertices) {}

    int run(ObjectBox* out, int capacity, int* needed, std::uint32_t* face_object);

  private:
    Face face(std::uint64_t t) const;
    std::uint32_t vertex(std::uint64_t t, int k) const {
        return mesh_.triangles[3 * t + static_cast<std::uint64_t>(k)];
    }
    Vec3d position(std::uint32_t v) const {
        const float* p = mesh_.positions + 3 * std::uint64_t{v};
        return {p[0], p[1], p[2]};
    }
    std::uint32_t kind(std::uint64_t t) const;
    std::uint32_t root_of(std::uint32_t v);
    void join();
    void sum_areas();
    int support_of(std::uint32_t root) const;
    void cut(std::uint32_t root);
    void cut_at_necks(double least);
    void grow_feet(const ObjectBox* cores);
    void add_to(ObjectBox* box, std::uint64_t t) const;
    bool stands_under(const ObjectBox& core, std::uint64_t t) const;
    bool holds_up_a_table(const ObjectBox& box) const;
    bool part_of(const ObjectBox* out, int small, int large) const;

    const ObjectInput& mesh_;
    const ObjectOptions& options_;
    std::uint32_t* parent_;  // per vertex: union-find, later its object + 1
    std::uint32_t* weight_;  // per vertex: area of the component at its root, later the object + 1 there
    std::uint32_t* face_;    // per triangle
};

bool is_structure(std::uint8_t label) { return label != kLabelNone && label != kLabelSeat; }

Face Finder::face(std::uint64_t t) const {
    Face f;
    for (int k = 0; k < 3; ++k) f.corner[k] = position(vertex(t, k));
    const Vec3d n = cross(f.corner[1] - f.corner[0], f.corner[2] - f.corner[0]);
    f.normal = normalised(n);
    f.area = 0.5 * norm(n);
    return f;
}

// Core, foot, or neither.
std::uint32_t Finder::kind(std::uint64_t t) const {
    const std::uint8_t label = mesh_.face_labels[t];
    if (is_structure(label)) return kNoObject;
    const Face f = face(t);
    const Vec3d middle = (f.corner[0] + f.corner[1] + f.corner[2]) * (1.0 / 3);
    std::uint32_t kind = kCore;
    for (int i = 0; i < mesh_.plane_count && i < kMostPlanes; ++i) {
        if (!is_structure(mesh_.plane_labels[i])) continue;
        const PlaneShape& plane = mesh_.planes[i];
        const PlaneExtent& e = mesh_.extents[i];
        const double d = dot(plane.normal, middle) + plane.offset;
        const bool table = mesh_.plane_labels[i] == kLabelTable && e.facing == Facing::up;
        if (d > options_.margin_m || d < -(table ? options_.edge_m : options_.margin_m)) continue;
        bool inside = e.facing != Facing::sloped;
        for (int a = 0; a < 3 && inside; ++a) {
            const double s = dot(a < 2 ? e.axis[a] : cross(e.axis[0], e.axis[1]), middle);
            const double pad = a == 2 && table ? options_.edge_m : options_.margin_m;
            inside = s >= e.low[a] - pad && s <= e.high[a] + options_.margin_m;
        }
        if (!inside) continue;
        // Behind the face of a table is its edge and its underside, never an object.
        if (d < -options_.margin_m || dot(f.normal, plane.normal) > kFlat) return kNoObject;
        kind = kFirstFoot + static_cast<std::uint32_t>(i);
    }
    return kind;
}

// Union-find with path halving; roots are the smallest vertex of their set, so the result has no order to
// depend on.
std::uint32_t Finder::root_of(std::uint32_t v) {
    while (parent_[v] != v) {
        parent_[v] = parent_[parent_[v]];
        v = parent_[v];
    }
    return v;
}

void Finder::join() {
    for (std::uint64_t v = 0; v < mesh_.vertices; ++v) {
        parent_[v] = static_cast<std::uint32_t>(v);
        weight_[v] = 0;
    }
    for (std::uint64_t t = 0; t < mesh_.triangle_count; ++t) {
        face_[t] = kind(t);
        for (int k = 1; k < 3 && face_[t] == kCore; ++k) {
            const std::uint32_t a = root_of(vertex(t, 0)), b = root_of(vertex(t, k));
            if (a < b) parent_[b] = a;
            if (b < a) parent_[a] = b;
        }
    }
    sum_areas();
}

void Finder::sum_areas() {
    for (std::uint64_t t = 0; t < mesh_.triangle_count; ++t) {
        if (face_[t] != kCore) continue;
        const double units = face(t).area / kAreaUnit;
        const std::uint32_t add = units < 4e9 ? static_cast<std::uint32_t>(units) : 4000000000u;
        std::uint32_t& sum = weight_[root_of(vertex(t, 0))];
        sum = sum > 0xffffffffu - add ? 0xffffffffu : sum + add;
    }
}

// The table or floor that a component stands on, -1 for none. parent_ holds roots.
int Finder::support_of(std::uint32_t root) const {
    Vec3d up, lowest;
    bool any = false;
    for (int i = 0; i < mesh_.plane_count && !any; ++i)
        if (mesh_.extents[i].facing == Facing::up) {
            up = cross(mesh_.extents[i].axis[0], mesh_.extents[i].axis[1]);
            any = true;
        }
    if (!any) return -1;
    double least = 1e300;
    for (std::uint32_t v = 0; v < mesh_.vertices; ++v)
        if (parent_[v] == root && dot(up, position(v)) < least) {
            lowest = position(v);
            least = dot(up, lowest);
        }
    for (int i = 0; i < mesh_.plane_count; ++i) {
        const PlaneExtent& e = mesh_.extents[i];
        const std::uint8_t label = mesh_.plane_labels[i];
        if (e.facing != Facing::up || (label != kLabelTable && label != kLabelFloor)) continue;
        const double d = dot(mesh_.planes[i].normal, lowest) + mesh_.planes[i].offset;
        bool stands = d >= -options_.margin_m && d <= kStanding;
        for (int a = 0; a < 2 && stands; ++a) {
            const double s = dot(e.axis[a], lowest);
            stands = s >= e.low[a] - options_.margin_m && s <= e.high[a] + options_.margin_m;
        }
        if (stands) return i;
    }
    return -1;
}

// Gives the parts of a component roots of their own.
void Finder::cut(std::uint32_t root) {
    const int support = support_of(root);
    if (support < 0) return;
    const PlaneExtent& e = mesh_.extents[support];
    const PlaneShape& plane = mesh_.planes[support];
    double low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};
    for (std::uint32_t v = 0; v < mesh_.vertices; ++v) {
        if (parent_[v] != root) continue;
        for (int a = 0; a < 2; ++a) {
            const double s = dot(e.axis[a], position(v));
            low[a] = s < low[a] ? s : low[a];
            high[a] = s > high[a] ? s : high[a];
        }
    }
    Footprint footprint;
    if (!footprint.begin(mesh_.footprint, e, low, high, kFootprintCell * options_.margin_m)) return;
    const auto mark = [&](Vec3d x) { footprint.mark(x, dot(plane.normal, x) + plane.offset < kStanding); };
    for (std::uint64_t t = 0; t < mesh_.triangle_count; ++t) {
        if (face_[t] != kCore || parent_[vertex(t, 0)] != root) continue;
        const Face f = face(t);
        for (const Vec3d& corner : f.corner) mark(corner);
        mark((f.corner[0] + f.corner[1] + f.corner[2]) * (1.0 / 3));
    }
    if (footprint.split() < 2) return;
    std::uint32_t first[Footprint::kMostParts];
    for (std::uint32_t& v : first) v = kNoObject;
    for (std::uint32_t v = root; v < mesh_.vertices; ++v) {
        if (parent_[v] != root) continue;
        std::uint32_t& own = first[footprint.part_at(position(v))];
        if (own == kNoObject) own = v;
        // Roots stay below what has to be looked at still, so that the test above holds for the rest.
        parent_[v] = own;
    }
}

// parent_ holds roots afterwards; areas are summed anew.
void Finder::cut_at_necks(double least) {
    for (std::uint32_t v = 0; v < mesh_.vertices; ++v) parent_[v] = root_of(v);
    for (std::uint32_t v = 0; v < mesh_.vertices; ++v)
        if (parent_[v] == v && weight_[v] > 0 && weight_[v] >= least) cut(v);
    for (std::uint64_t v = 0; v < mesh_.vertices; ++v) weight_[v] = 0;
    sum_areas();
}

// Legs: below a table's top, within its outline, and up to it.
bool Finder::holds_up_a_table(const ObjectBox& box) const {
    for (int i = 0; i < mesh_.plane_count; ++i) {
        const PlaneExtent& e = mesh_.extents[i];
        if (mesh_.plane_labels[i] != kLabelTable || e.facing != Facing::up) continue;
        bool inside = true;
        for (int a = 0; a < 3 && inside; ++a) {
            const Vec3d axis = a < 2 ? e.axis[a] : cross(e.axis[0], e.axis[1]);
            double low = 0, high = 0;  // of the box along the axis
            for (int c = 0; c < 3; ++c) {
                const double p = axis[c] * box.low[c], q = axis[c] * box.high[c];
                low += p < q ? p : q;
                high += p < q ? q : p;
            }
            inside = a < 2 ? low >= e.low[a] - kOutside && high <= e.high[a] + kOutside
                           : high <= e.low[2] + options_.margin_m && high >= e.low[2] - kLegReach;
        }
        if (inside) return true;
    }
    return false;
}

bool Finder::part_of(const ObjectBox* out, int small, int large) const {
    const ObjectBox &a = out[small], &b = out[large];
    double own = 1, both = 1;
    for (int i = 0; i < 3; ++i) {
        own *= double{a.high[i]} - a.low[i];
        both *= common({a.low[i], a.high[i]}, {b.low[i], b.high[i]});
    }
    if (!(both >= kNested * own)) return false;
    const auto mine = static_cast<std::uint32_t>(small) + 1, other = static_cast<std::uint32_t>(large) + 1;
    std::uint64_t vertices = 0;
    for (std::uint64_t v = 0; v < mesh_.vertices; ++v) vertices += parent_[v] == mine;
    Vec3d probe[kProbes];
    int probes = 0;
    const std::uint64_t step = vertices / kProbes + 1;
    std::uint64_t seen = 0;
    for (std::uint32_t v = 0; v < mesh_.vertices; ++v)
        if (parent_[v] == mine && seen++ % step == 0 && probes < kProbes) probe[probes++] = position(v);
    for (std::uint32_t v = 0; v < mesh_.vertices; ++v) {
        if (parent_[v] != other) continue;
        for (int i = 0; i < probes; ++i) {
            const Vec3d d = position(v) - probe[i];
            if (dot(d, d) <= kTouch * kTouch) return true;
        }
    }
    return false;
}

void Finder::add_to(ObjectBox* box, std::uint64_t t) const {
    const Face f = face(t);
    ++box->faces;
    box->area_m2 += f.area;
    if (mesh_.face_labels[t] == kLabelSeat) box->seat_area_m2 += f.area;
    for (const Vec3d& p : f.corner)
        for (int a = 0; a < 3; ++a) {
            const auto x = static_cast<float>(p[a]);
            if (x < box->low[a]) box->low[a] = x;
            if (x > box->high[a]) box->high[a] = x;
        }
}

// A foot is below what stands on it. Beside it lies the skirt that noise leaves where the view was blocked.
bool Finder::stands_under(const ObjectBox& core, std::uint64_t t) const {
    const Face f = face(t);
    const Vec3d middle = (f.corner[0] + f.corner[1] + f.corner[2]) * (1.0 / 3);
    Vec3d off;  // from the core's box
    for (int a = 0; a < 3; ++a)
        off[a] = middle[a] < core.low[a]    ? middle[a] - core.low[a]
                 : middle[a] > core.high[a] ? middle[a] - core.high[a]
                                            : 0;
    const Vec3d n = mesh_.planes[face_[t] - kFirstFoot].normal;
    const Vec3d beside = off - n * dot(n, off);
    return norm(beside) <= kBeside * options_.margin_m;
}

// Feet take the number of what they stand under, ring by ring, in the order of the triangles.
void Finder::grow_feet(const ObjectBox* cores) {
    const auto is_foot = [&](std::uint64_t t) { return face_[t] >= kFirstFoot && face_[t] < kCore; };
    for (int ring = 0; ring < kRings; ++ring) {
        bool any = false;
        for (std::uint64_t t = 0; t < mesh_.triangle_count; ++t) {
            if (!is_foot(t)) continue;
            std::uint32_t owner = 0;
            for (int k = 0; k < 3; ++k)
                if (const std::uint32_t o = parent_[vertex(t, k)]; o && (!owner || o < owner)) owner = o;
            if (!owner || !stands_under(cores[owner - 1], t)) continue;
            face_[t] = owner - 1;
            any = true;
        }
        if (!any) return;
        for (std::uint64_t t = 0; t < mesh_.triangle_count; ++t) {
            if (face_[t] >= kFirstFoot) continue;
            for (int k = 0; k < 3; ++k)
                if (std::uint32_t& o = parent_[vertex(t, k)]; !o) o = face_[t] + 1;
        }
    }
}

int Finder::run(ObjectBox* out, int capacity, int* needed, std::uint32_t* face_object) {
    join();
    // The largest, by insertion into a sorted list; equal ones by their first vertex.
    int count = 0;
    *needed = 0;
    const double least = options_.min_area_m2 / kAreaUnit;
    if (mesh_.footprint.cells > 0) cut_at_necks(least);
    for (std::uint32_t v = 0; v < mesh_.vertices; ++v) {
        if (weight_[v] == 0 || parent_[v] != v || weight_[v] < least) continue;
        ++*needed;
        int at = count;
        while (at > 0 && weight_[out[at - 1].first_vertex] < weight_[v]) --at;
        if (at >= capacity) continue;
        if (count < capacity) ++count;
        for (int i = count - 1; i > at; --i) out[i] = out[i - 1];
        out[at] = {};
        out[at].first_vertex = v;
    }
    // weight_ and parent_ turn from roots to objects.
    for (std::uint64_t v = 0; v < mesh_.vertices; ++v) weight_[v] = 0;
    for (int i = 0; i < count; ++i) weight_[out[i].first_vertex] = static_cast<std::uint32_t>(i) + 1;
    for (std::uint32_t v = 0; v < mesh_.vertices; ++v) parent_[v] = root_of(v);
    for (std::uint64_t v = 0; v < mesh_.vertices; ++v) parent_[v] = weight_[parent_[v]];
    for (int i = 0; i < count; ++i) {
        constexpr float kFar = 3e38f;
        out[i].low = {kFar, kFar, kFar};
        out[i].high = {-kFar, -kFar, -kFar};
    }
    for (std::uint64_t t = 0; t < mesh_.triangle_count; ++t) {
        if (face_[t] != kCore) continue;
        const std::uint32_t owner = parent_[vertex(t, 0)];
        face_[t] = owner ? owner - 1 : kNoObject;
        if (owner) add_to(&out[owner - 1], t);
    }
    grow_feet(out);
    for (std::uint64_t t = 0; t < mesh_.triangle_count; ++t)
        if (face_[t] >= kFirstFoot) face_[t] = kNoObject;
    // The boxes held the cores alone, for the feet to be told by; now everything is counted.
    for (int i = 0; i < count; ++i) {
        out[i].faces = 0;
        out[i].area_m2 = out[i].seat_area_m2 = 0;
    }
    for (std::uint64_t t = 0; t < mesh_.triangle_count; ++t)
        if (face_[t] != kNoObject) add_to(&out[face_[t]], t);
    // What turns out to be legs goes, parts join their whole, the others move up. From the smallest, so that
    // a part's own parts are with it; weight_ holds what each goes to, itself when it stays.
    for (int i = count - 1; i >= 0; --i) {
        weight_[i] = holds_up_a_table(out[i]) ? kNoObject : static_cast<std::uint32_t>(i);
        for (int k = 0; k < i && weight_[i] == static_cast<std::uint32_t>(i); ++k)
            if (part_of(out, i, k)) weight_[i] = static_cast<std::uint32_t>(k);
    }
    int kept = 0;
    for (int i = 0; i < count; ++i) {
        if (weight_[i] == static_cast<std::uint32_t>(i)) {
            weight_[i] = static_cast<std::uint32_t>(kept);
            out[kept++] = out[i];
        } else if (weight_[i] != kNoObject) {
            // Its whole is larger, so it comes earlier and has its final number by now.
            weight_[i] = weight_[weight_[i]];
            if (weight_[i] == kNoObject) continue;
            ObjectBox& whole = out[weight_[i]];
            for (int a = 0; a < 3; ++a) {
                if (out[i].low[a] < whole.low[a]) whole.low[a] = out[i].low[a];
                if (out[i].high[a] > whole.high[a]) whole.high[a] = out[i].high[a];
            }
            whole.area_m2 += out[i].area_m2;
            whole.seat_area_m2 += out[i].seat_area_m2;
            whole.faces += out[i].faces;
        }
    }
    *needed -= count - kept;
    // Feet and parts move the order a little: sorted again, stable, with the numbers in parent_.
    std::uint32_t* rank = parent_;
    for (int i = 0; i < kept; ++i) {
        const ObjectBox box = out[i];
        int at = i;
        for (; at > 0 && out[at - 1].area_m2 < box.area_m2; --at) {
            out[at] = out[at - 1];
            rank[at] = rank[at - 1];
        }
        out[at] = box;
        rank[at] = static_cast<std::uint32_t>(i);
    }
    std::uint32_t* place = parent_ + kept;  // of the i-th before sorting; 2 kept words, fewer than vertices
    for (int i = 0; i < kept; ++i) place[rank[i]] = static_cast<std::uint32_t>(i);
    for (int i = 0; i < count; ++i)
        if (weight_[i] != kNoObject) weight_[i] = place[weight_[i]];
    for (std::uint64_t t = 0; face_object && t < mesh_.triangle_count; ++t)
        face_object[t] = face_[t] == kNoObject ? kNoObject : weight_[face_[t]];
    return kept;
}

}  // namespace

int find_objects(const ObjectInput& mesh, const ObjectOptions& options, std::uint32_t* scratch,
                 ObjectBox* out, int capacity, int* needed, std::uint32_t* face_object) {
    return Finder(mesh, options, scratch).run(out, capacity, needed, face_object);
}

}  // namespace burin
