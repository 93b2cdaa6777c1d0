// SPDX-License-Identifier: MIT
// The C boundary of objects. find_objects writes boxes of its own form, so the answer is made in place: each
// box becomes an entry of the caller's list, in the room that this entry has.
#include <algorithm>
#include <new>

#include "api/call.h"
#include "api/mesh_check.h"
#include "planes/objects.h"

using namespace burin;

namespace {

constexpr double kSeatArea = 0.05;  // m^2: a stool of 0.25 m by 0.25 m, less what noise takes of its rim
// find_objects counts objects up to this; more than a mesh of a building has.
constexpr std::uint64_t kMostObjects = 65533;

static_assert(sizeof(burin_object) == sizeof(ObjectBox) && alignof(burin_object) == alignof(ObjectBox));

burin_object c_object(const ObjectBox& box) {
    burin_object out = {};
    for (int i = 0; i < 3; ++i) {
        out.min[i] = box.low[i];
        out.max[i] = box.high[i];
    }
    out.area_m2 = box.area_m2;
    out.faces = box.faces;
    out.label = box.seat_area_m2 >= kSeatArea ? BURIN_LABEL_SEAT : BURIN_LABEL_NONE;
    out.first_vertex = box.first_vertex;
    return out;
}

Status check_mesh(const burin_mesh_buffers* mesh, const uint8_t* face_labels, const uint32_t* scratch) {
    BURIN_TRY(check_mesh_arrays(mesh));
    if (mesh->triangle_count == 0) return {};
    if (!face_labels || !scratch) return null_argument(face_labels ? "scratch" : "face_labels");
    if (mesh->vertex_count > 0xffffffffu || mesh->triangle_count > 0xffffffffu)
        return Status::error(Code::invalid_argument,
                             "mesh: %llu vertices and %llu triangles, expected below 2^32",
                             static_cast<unsigned long long>(mesh->vertex_count),
                             static_cast<unsigned long long>(mesh->triangle_count));
    return check_indices(*mesh);
}

}  // namespace

extern "C" {

burin_status burin_mesh_objects(burin_map map, const burin_mesh_buffers* mesh, const uint8_t* face_labels,
                                uint32_t* scratch, burin_object* objects, uint64_t capacity, uint64_t* count,
                                uint32_t* face_objects) {
    return Call(map).run([&](MapState& state) -> Status {
        BURIN_TRY(require_planes(state));
        PlaneLayer& layer = state.session.planes();
        if (!count) return null_argument("count");
        if (!objects && capacity > 0) return null_argument("objects");
        *count = 0;
        BURIN_TRY(check_mesh(mesh, face_labels, scratch));
        if (mesh->triangle_count == 0) return {};
        const DescribedPlanes planes = layer.described();
        ObjectInput in;
        in.positions = mesh->positions;
        in.vertices = mesh->vertex_count;
        in.triangles = mesh->triangles;
        in.triangle_count = mesh->triangle_count;
        in.face_labels = face_labels;
        in.planes = planes.shapes;
        in.extents = planes.extents;
        in.plane_labels = planes.labels;
        in.plane_count = planes.count;
        in.footprint = layer.lend();
        const auto room = static_cast<int>(std::min(capacity, kMostObjects));
        auto* boxes = reinterpret_cast<ObjectBox*>(objects);
        for (int i = 0; i < room; ++i) new (boxes + i) ObjectBox;
        int needed = 0;
        const int found = find_objects(in, {}, scratch, boxes, room, &needed, face_objects);
        for (int i = 0; i < found; ++i) {
            const ObjectBox box = boxes[i];
            new (objects + i) burin_object(c_object(box));
        }
        *count = static_cast<std::uint64_t>(found);
        if (needed <= found) return {};
        // What the smaller ones belong to was not asked, so that as many more are to be looked at.
        *count = static_cast<std::uint64_t>(needed + room - found);
        return Status::error(Code::insufficient_memory, "room for %llu objects, %llu are needed",
                             static_cast<unsigned long long>(capacity),
                             static_cast<unsigned long long>(*count));
    });
}

}  // extern "C"
