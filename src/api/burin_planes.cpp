// SPDX-License-Identifier: MIT
// The C boundary of planes.
#include <algorithm>

#include "api/call.h"

using namespace burin;

namespace {

Status check_enabled(const MapState& state) {
    if (state.session.planes().enabled()) return {};
    return Status::error(Code::state, "config.planes is 0: the map looks for no planes");
}

burin_plane c_plane(const GlobalPlane& p) {
    burin_plane out = {};
    out.id = p.id;
    out.label = p.label;
    for (int i = 0; i < 3; ++i) out.normal[i] = p.normal[i];
    out.offset = p.offset;
    p.covariance(out.covariance);
    out.area_m2 = p.area_m2;
    out.rms_m = p.rms_m();
    out.support = p.patches;
    return out;
}

}  // namespace

extern "C" {

burin_status burin_refresh_planes(burin_map map) {
    return Call(map).run([&](MapState& state) -> Status {
        BURIN_TRY(check_enabled(state));
        Watch watch(state, 4);
        state.session.refresh_planes(state.jobs);
        return watch.progress.finish();
    });
}

burin_status burin_planes(burin_map map, burin_plane* planes, uint64_t capacity, uint64_t* count) {
    return Call(map).run([&](MapState& state) -> Status {
        BURIN_TRY(check_enabled(state));
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
        BURIN_TRY(check_enabled(state));
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
                               uint32_t* plane_ids) {
    return Call(map).run([&](MapState& state) -> Status {
        BURIN_TRY(check_enabled(state));
        if (!mesh) return null_argument("mesh");
        if (mesh->triangle_count == 0) return {};
        if (!mesh->positions || !mesh->triangles)
            return null_argument(mesh->positions ? "mesh->triangles" : "mesh->positions");
        for (std::uint64_t i = 0; i < 3 * mesh->triangle_count; ++i)
            if (mesh->triangles[i] >= mesh->vertex_count)
                return Status::error(Code::invalid_argument, "mesh: index %u, expected below %llu",
                                     mesh->triangles[i], static_cast<unsigned long long>(mesh->vertex_count));
        Watch watch(state, 1);
        state.session.planes().label_faces(mesh->positions, mesh->triangles, mesh->triangle_count, labels,
                                           plane_ids, state.jobs);
        return watch.progress.finish();
    });
}

}  // extern "C"
