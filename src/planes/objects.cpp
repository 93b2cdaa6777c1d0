// SPDX-License-Identifier: MIT
// Components to objects: their feet, what is part of what, and in which order they are told.
#include "planes/objects.h"

#include "planes/object_finder.h"

namespace burin {
namespace objects {

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

}  // namespace objects

int find_objects(const ObjectInput& mesh, const ObjectOptions& options, std::uint32_t* scratch,
                 ObjectBox* out, int capacity, int* needed, std::uint32_t* face_object) {
    return objects::Finder(mesh, options, scratch).run(out, capacity, needed, face_object);
}

}  // namespace burin
