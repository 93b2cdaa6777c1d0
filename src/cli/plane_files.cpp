// SPDX-License-Identifier: MIT
// What the planes of a map leave behind: planes.json, objects.json, floorplan.svg and floorplan.json.
#include <algorithm>
#include <array>
#include <cmath>

#include "cli/common.h"
#include "export/floorplan.h"

namespace burin::cli {
namespace {

Status list_planes(burin_map map, std::vector<burin_plane>* planes) {
    std::uint64_t count = 0;
    burin_planes(map, nullptr, 0, &count);
    planes->resize(count);
    return status_of(burin_planes(map, planes->data(), count, &count), map);
}

// The rings of what was seen of a plane; starts has one more entry than there are rings.
Status outline_of(burin_map map, std::uint32_t id, std::vector<double>* points,
                  std::vector<std::uint32_t>* starts) {
    std::uint64_t count = 0, rings = 0;
    burin_plane_outline(map, id, 0, nullptr, 0, &count, nullptr, 0, &rings);
    points->resize(3 * count);
    starts->resize(rings);
    BURIN_TRY(status_of(
        burin_plane_outline(map, id, 0, points->data(), count, &count, starts->data(), rings, &rings), map));
    starts->push_back(static_cast<std::uint32_t>(count));
    return {};
}

// The island of the largest area: what a reader that knows of one ring gets.
nlohmann::json largest_ring(const std::vector<double>& points, const std::vector<std::uint32_t>& starts,
                            const double normal[3], const nlohmann::json& rings) {
    double most = 0;
    std::size_t largest = 0;
    for (std::size_t r = 0; r + 1 < starts.size(); ++r) {
        const auto at = [&](std::size_t k) {
            return Vec3d{points[3 * k], points[3 * k + 1], points[3 * k + 2]};
        };
        Vec3d twice;
        for (std::size_t k = starts[r]; k < starts[r + 1]; ++k)
            twice = twice + cross(at(k) - at(starts[r]),
                                  at(k + 1 < starts[r + 1] ? k + 1 : starts[r]) - at(starts[r]));
        const double area = dot(twice, Vec3d{normal[0], normal[1], normal[2]});
        if (area > most) most = area, largest = r;
    }
    return rings.empty() ? nlohmann::json::array() : rings[largest];
}

// For calls that only read.
burin_mesh_buffers buffers_of(const TriangleMesh& mesh) {
    burin_mesh_buffers buffers = {};
    if (mesh.triangles.empty()) return buffers;
    buffers.positions = const_cast<float*>(&mesh.positions[0].x);
    buffers.triangles = const_cast<std::uint32_t*>(mesh.triangles[0].data());
    buffers.vertex_count = mesh.positions.size();
    buffers.triangle_count = mesh.triangles.size();
    return buffers;
}

}  // namespace

Status label_faces(burin_map map, TriangleMesh* mesh) {
    if (mesh->triangles.empty()) return {};
    const burin_mesh_buffers buffers = buffers_of(*mesh);
    mesh->labels.resize(mesh->triangles.size());
    mesh->filled.resize(mesh->triangles.size());
    return status_of(burin_label_faces(map, &buffers, mesh->labels.data(), nullptr, mesh->filled.data()),
                     map);
}

namespace {

Status write_planes(burin_map map, const std::vector<burin_plane>& planes, const std::string& folder,
                    FloorPlanInput* plan) {
    nlohmann::json list = nlohmann::json::array();
    for (const burin_plane& p : planes) {
        nlohmann::json covariance = nlohmann::json::array();
        for (int r = 0; r < 4; ++r)
            covariance.push_back(std::vector<double>(p.covariance + 4 * r, p.covariance + 4 * r + 4));
        std::vector<double> points;
        std::vector<std::uint32_t> starts;
        BURIN_TRY(outline_of(map, p.id, &points, &starts));
        nlohmann::json rings = nlohmann::json::array();
        FloorPlanPlane seen{static_cast<int>(p.id),
                            static_cast<std::uint8_t>(p.label),
                            {p.normal[0], p.normal[1], p.normal[2]},
                            p.offset,
                            {}};
        for (std::size_t r = 0; r + 1 < starts.size(); ++r) {
            nlohmann::json ring = nlohmann::json::array();
            seen.rings.emplace_back();
            for (std::size_t k = starts[r]; k < starts[r + 1]; ++k) {
                const Vec3d x{points[3 * k], points[3 * k + 1], points[3 * k + 2]};
                ring.push_back({x.x, x.y, x.z});
                seen.rings.back().push_back(x);
            }
            rings.push_back(ring);
        }
        plan->planes.push_back(seen);
        list.push_back({{"polygon", largest_ring(points, starts, p.normal, rings)},
                        {"rings", rings},
                        {"id", p.id},
                        {"label", label_name(static_cast<std::uint8_t>(p.label))},
                        {"normal", p.normal},
                        {"offset", p.offset},
                        {"area_m2", p.area_m2},
                        {"rms_m", p.rms_m},
                        {"covariance", covariance},
                        {"support", p.support}});
    }
    return write_json(folder + "/planes.json", list);
}

Status write_objects(burin_map map, const TriangleMesh& mesh, const std::string& folder, FloorPlanInput* plan,
                     std::uint64_t* written) {
    const burin_mesh_buffers buffers = buffers_of(mesh);
    std::vector<std::uint32_t> scratch(2 * mesh.positions.size() + mesh.triangles.size());
    std::vector<burin_object> objects(256);
    std::uint64_t count = 0;
    for (burin_status status = BURIN_INSUFFICIENT_MEMORY; status != BURIN_OK;) {
        status = burin_mesh_objects(map, &buffers, mesh.labels.data(), scratch.data(), objects.data(),
                                    objects.size(), &count, nullptr);
        if (status == BURIN_OK) break;
        if (status != BURIN_INSUFFICIENT_MEMORY || count <= objects.size()) return status_of(status, map);
        objects.resize(count);
    }
    nlohmann::json list = nlohmann::json::array();
    for (std::uint64_t i = 0; i < count; ++i) {
        const burin_object& o = objects[i];
        list.push_back({{"id", i + 1},
                        {"min", o.min},
                        {"max", o.max},
                        {"faces", o.faces},
                        {"area_m2", o.area_m2},
                        {"label", label_name(static_cast<std::uint8_t>(o.label))}});
        // What has less surface than a third of the ground it would cover is a skirting around a room, no
        // furniture.
        int up = 0;
        for (int r = 1; r < 3; ++r)
            if (std::fabs(plan->up_world[r]) > std::fabs(plan->up_world[up])) up = r;
        const auto wide = [&o](int r) { return static_cast<double>(o.max[r] - o.min[r]); };
        const double ground = wide((up + 1) % 3) * wide((up + 2) % 3);
        if (3 * o.area_m2 < ground) continue;
        plan->objects.push_back({static_cast<std::uint8_t>(o.label),
                                 {o.min[0], o.min[1], o.min[2]},
                                 {o.max[0], o.max[1], o.max[2]}});
    }
    *written = count;
    return write_json(folder + "/objects.json", list);
}

}  // namespace

Status write_plane_files(burin_map map, const TriangleMesh& mesh, const std::string& folder,
                         nlohmann::json* counts) {
    std::vector<burin_plane> planes;
    BURIN_TRY(list_planes(map, &planes));
    FloorPlanInput plan;
    double up[3];
    BURIN_TRY(status_of(burin_planes_up(map, up), map));
    plan.up_world = {up[0], up[1], up[2]};
    BURIN_TRY(write_planes(map, planes, folder, &plan));
    std::uint64_t objects = 0;
    BURIN_TRY(write_objects(map, mesh, folder, &plan, &objects));
    BURIN_TRY(write_floor_plan(folder + "/floorplan.svg", folder + "/floorplan.json", plan));
    nlohmann::json by_label;
    for (std::uint8_t label = 0; label < kLabelCount; ++label) by_label[label_name(label)] = 0;
    for (const burin_plane& p : planes) {
        nlohmann::json& n = by_label[label_name(static_cast<std::uint8_t>(p.label))];
        n = n.get<int>() + 1;
    }
    *counts = {{"planes", planes.size()}, {"objects", objects}, {"labels", by_label}};
    return {};
}

void paint_labels(TriangleMesh* mesh) {
    // Okabe and Ito's palette (2008), which people who see fewer colours tell apart too; grey for none.
    constexpr std::array<std::uint8_t, 3> kColours[] = {{160, 160, 160}, {230, 159, 0}, {0, 158, 115},
                                                        {86, 180, 233},  {213, 94, 0},  {204, 121, 167},
                                                        {0, 114, 178},   {240, 228, 66}};
    std::vector<std::uint8_t> of(mesh->positions.size(), 0);
    // Between two labels a vertex takes the larger number, whatever the order of its faces.
    for (std::size_t t = 0; t < mesh->labels.size(); ++t)
        for (const std::uint32_t v : mesh->triangles[t]) of[v] = std::max(of[v], mesh->labels[t]);
    mesh->colours.resize(of.size());
    for (std::size_t v = 0; v < of.size(); ++v) mesh->colours[v] = kColours[std::min<int>(of[v], 7)];
}

}  // namespace burin::cli
