// SPDX-License-Identifier: MIT
// The C boundary of planes.
#include <algorithm>
#include <cmath>

#include "api/call.h"
#include "api/mesh_check.h"

using namespace burin;

namespace {

burin_plane c_plane(const GlobalPlane& p) {
    burin_plane out = {};
    out.id = p.id;
    out.label = p.label;
    for (int i = 0; i < 3; ++i) out.normal[i] = p.normal[i];
    out.offset = p.offset;
    p.covariance(out.covariance);
    out.area_m2 = p.seen_area_m2 > 0 ? p.seen_area_m2 : p.area_m2;
    out.rms_m = p.rms_m();
    out.support = p.patches;
    return out;
}

}  // namespace

extern "C" {

burin_status burin_refresh_planes(burin_map map) {
    return Call(map).run([&](MapState& state) -> Status {
        BURIN_TRY(require_planes(state));
        Watch watch(state, 4);
        state.session.refresh_planes(state.jobs);
        return watch.progress.finish();
    });
}

burin_status burin_planes(burin_map map, burin_plane* planes, uint64_t capacity, uint64_t* count) {
    return Call(map).run([&](MapState& state) -> Status {
        BURIN_TRY(require_planes(state));
        if (!count) return null_argument("count");
        if (!planes && capacity > 0) return null_argument("planes");
        const PlaneLayer& layer = state.session.planes();
        const PlaneSet& set = layer.set();
        std::uint64_t n = 0;
        for (std::uint32_t i = 0; i < set.used(); ++i) {
            if (!layer.told(set.at(i))) continue;
            if (n < capacity) planes[n] = c_plane(set.at(i));
            ++n;
        }
        *count = n;
        std::sort(planes, planes + std::min(n, capacity),
                  [](const burin_plane& a, const burin_plane& b) { return a.id < b.id; });
        if (n <= capacity) return {};
        return Status::error(Code::insufficient_memory, "room for %llu planes, %llu are needed",
                             static_cast<unsigned long long>(capacity), static_cast<unsigned long long>(n));
    });
}

burin_status burin_plane_events(burin_map map, burin_plane_event* events, uint64_t capacity, uint64_t* count,
                                uint64_t* lost) {
    return Call(map).run([&](MapState& state) -> Status {
        BURIN_TRY(require_planes(state));
        if (!count) return null_argument("count");
        if (!events && capacity > 0) return null_argument("events");
        *count = 0;
        PlaneEvent event;
        std::uint64_t missing = 0, all_missing = 0;
        while (*count < capacity && state.session.planes().set().take_events(&event, 1, &missing) == 1) {
            events[(*count)++] = {static_cast<std::uint32_t>(event.what), event.id, event.into};
            all_missing = std::max(all_missing, missing);
        }
        if (lost) *lost = all_missing;
        return {};
    });
}

burin_status burin_label_faces(burin_map map, const burin_mesh_buffers* mesh, uint8_t* labels,
                               uint32_t* plane_ids, uint8_t* filled) {
    return Call(map).run([&](MapState& state) -> Status {
        BURIN_TRY(require_planes(state));
        BURIN_TRY(check_mesh_arrays(mesh));
        if (mesh->triangle_count == 0) return {};
        BURIN_TRY(check_indices(*mesh));
        Watch watch(state, 1);
        state.session.planes().label_faces(mesh->positions, mesh->triangles, mesh->triangle_count, labels,
                                           plane_ids, filled, state.session.volume(), state.jobs);
        return watch.progress.finish();
    });
}

burin_status burin_plane_outline(burin_map map, uint32_t id, uint32_t completed, double* points,
                                 uint64_t capacity, uint64_t* count, uint32_t* ring_starts,
                                 uint64_t ring_capacity, uint64_t* rings) {
    return Call(map).run([&](MapState& state) -> Status {
        BURIN_TRY(require_planes(state));
        if (!count || !rings) return null_argument(count ? "rings" : "count");
        if (!points && capacity > 0) return null_argument("points");
        if (!ring_starts && ring_capacity > 0) return null_argument("ring_starts");
        PlaneLayer& layer = state.session.planes();
        std::uint32_t i = 0;
        while (i < layer.set().used() && (layer.set().at(i).id != id || id == 0)) ++i;
        if (i == layer.set().used())
            return Status::error(Code::invalid_argument, "plane %u: there is none of this id", id);
        ExtentGrid grid;
        OutlineCounts counts;
        const Outline outline = layer.outline(static_cast<std::uint16_t>(i), completed != 0, &grid, &counts);
        *count = counts.points;
        *rings = counts.rings;
        if (counts.points > capacity || counts.rings > ring_capacity)
            return Status::error(
                Code::insufficient_memory, "room for %llu points and %llu rings, %llu and %llu are needed",
                static_cast<unsigned long long>(capacity), static_cast<unsigned long long>(ring_capacity),
                static_cast<unsigned long long>(counts.points),
                static_cast<unsigned long long>(counts.rings));
        for (std::uint64_t r = 0; r < counts.rings; ++r) ring_starts[r] = outline.rings[r].first;
        for (std::uint64_t p = 0; p < counts.points; ++p) {
            const Vec3d x = grid.point(outline.points[p].u, outline.points[p].v);
            for (int k = 0; k < 3; ++k) points[3 * p + static_cast<std::uint64_t>(k)] = x[k];
        }
        return {};
    });
}

burin_status burin_plane_hit(burin_map map, const double origin[3], const double direction[3], double max_m,
                             uint32_t* id, double* distance_m) {
    return Call(map).run([&](MapState& state) -> Status {
        BURIN_TRY(require_planes(state));
        if (!origin || !direction || !id || !distance_m)
            return null_argument("origin, direction, id or distance_m");
        const Vec3d o{origin[0], origin[1], origin[2]}, d{direction[0], direction[1], direction[2]};
        if (!(std::fabs(norm(d) - 1) < 1e-3) || !(norm(o) < 1e9) || !(max_m >= 0))
            return Status::error(Code::invalid_argument,
                                 "ray: origin %g %g %g, direction %g %g %g, at most %g m; expected finite "
                                 "numbers, a unit direction and 0 m or more",
                                 o.x, o.y, o.z, d.x, d.y, d.z, max_m);
        const PlaneLayer& layer = state.session.planes();
        double distance = 0;
        const std::uint16_t plane = layer.hit(o, normalised(d), max_m, &distance);
        *id = plane == kNoPlane ? 0 : layer.set().at(plane).id;
        *distance_m = distance;
        return {};
    });
}

burin_status burin_set_up(burin_map map, const double up[3]) {
    return Call(map).run([&](MapState& state) -> Status {
        BURIN_TRY(require_planes(state));
        if (!up) return null_argument("up");
        const Vec3d u{up[0], up[1], up[2]};
        if (!(std::fabs(norm(u) - 1) < 1e-3))
            return Status::error(Code::invalid_argument, "up: %g %g %g, expected a unit vector", u.x, u.y,
                                 u.z);
        state.session.planes().set_up(normalised(u));
        return {};
    });
}

burin_status burin_planes_up(burin_map map, double up[3]) {
    return Call(map).run([&](MapState& state) -> Status {
        BURIN_TRY(require_planes(state));
        if (!up) return null_argument("up");
        const Vec3d u = state.session.planes().up();
        for (int k = 0; k < 3; ++k) up[k] = u[k];
        return {};
    });
}

}  // extern "C"
