// SPDX-License-Identifier: MIT
// Faces to components: which of them are joined, and where they are cut.
#include "planes/object_finder.h"

namespace burin::objects {
namespace {

bool is_structure(std::uint8_t label) { return label != kLabelNone && label != kLabelSeat; }

}  // namespace

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

}  // namespace burin::objects
