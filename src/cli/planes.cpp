// SPDX-License-Identifier: MIT
// burin planes: the planes of a saved map, and its mesh drawn to them.
#include <algorithm>
#include <cstdio>

#include "cli/common.h"
#include "export/mesh_file.h"

namespace burin::cli {
namespace {

constexpr const char* kLabels[] = {"none", "wall", "floor", "ceiling", "table", "seat", "window", "door"};

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

struct PlanesOptions {
    std::string map, output;
    MeshFlags mesh;
    unsigned threads = 1;
    bool json = false, quiet = false;
};

int run(const PlanesOptions& o) {
    if (!is_map_file(o.map)) return complain(kBadInput, o.map + ": not a map file (map.burin)");
    OwnedMap map;
    if (const Status status = map.open(o.map, o.threads, true); !status.ok()) return complain_input(status);
    if (const Status status = prepare_folder(o.output); !status.ok()) return complain_output(status);
    if (const Status status = status_of(burin_refresh_planes(map.get()), map.get()); !status.ok())
        return complain_output(status);
    burin_file_info info;
    burin_file_probe(o.map.c_str(), &info);
    TriangleMesh mesh;
    Status status = extract_mesh(map.get(), o.mesh, info.has_colour != 0, &mesh);
    if (status.ok()) status = label_faces(map.get(), &mesh);
    if (status.ok()) status = write_mesh(o.output + "/mesh.ply", mesh);
    if (status.ok()) status = write_planes(map.get(), o.output);
    if (!status.ok()) return complain_output(status);
    std::vector<burin_plane> planes;
    if (status = list_planes(map.get(), &planes); !status.ok()) return complain_output(status);
    if (!o.quiet) std::printf("%s: %zu planes\n", (o.output + "/planes.json").c_str(), planes.size());
    return kDone;
}

}  // namespace

Status label_faces(burin_map map, TriangleMesh* mesh) {
    if (mesh->triangles.empty()) return {};
    burin_mesh_buffers buffers = {};
    buffers.positions = &mesh->positions[0].x;
    buffers.triangles = mesh->triangles[0].data();
    buffers.vertex_count = mesh->positions.size();
    buffers.triangle_count = mesh->triangles.size();
    mesh->labels.resize(mesh->triangles.size());
    mesh->filled.resize(mesh->triangles.size());
    return status_of(burin_label_faces(map, &buffers, mesh->labels.data(), nullptr, mesh->filled.data()),
                     map);
}

Status write_planes(burin_map map, const std::string& folder) {
    std::vector<burin_plane> planes;
    BURIN_TRY(list_planes(map, &planes));
    nlohmann::json list = nlohmann::json::array();
    for (const burin_plane& p : planes) {
        nlohmann::json covariance = nlohmann::json::array();
        for (int r = 0; r < 4; ++r)
            covariance.push_back(std::vector<double>(p.covariance + 4 * r, p.covariance + 4 * r + 4));
        std::vector<double> points;
        std::vector<std::uint32_t> starts;
        BURIN_TRY(outline_of(map, p.id, &points, &starts));
        nlohmann::json rings = nlohmann::json::array();
        for (std::size_t r = 0; r + 1 < starts.size(); ++r) {
            nlohmann::json ring = nlohmann::json::array();
            for (std::size_t k = starts[r]; k < starts[r + 1]; ++k)
                ring.push_back({points[3 * k], points[3 * k + 1], points[3 * k + 2]});
            rings.push_back(ring);
        }
        list.push_back({{"polygon", largest_ring(points, starts, p.normal, rings)},
                        {"rings", rings},
                        {"id", p.id},
                        {"label", kLabels[std::min<std::uint32_t>(p.label, 7)]},
                        {"normal", p.normal},
                        {"offset", p.offset},
                        {"area_m2", p.area_m2},
                        {"rms_m", p.rms_m},
                        {"covariance", covariance},
                        {"support", p.support}});
    }
    return write_json(folder + "/planes.json", list);
}

void add_planes(CLI::App& app, int* exit) {
    auto* command = app.add_subcommand(
        "planes", "Find the planes of a saved map: planes.json, and mesh.ply drawn to them, with labels");
    auto o = std::make_shared<PlanesOptions>();
    command->add_option("map", o->map, "map.burin")->required();
    command->add_option("-o,--output", o->output, "folder for the results")->required();
    command->add_option("--threads", o->threads, "worker threads")->capture_default_str();
    command->add_flag("--quiet", o->quiet, "say nothing");
    o->mesh.add_to(*command);
    command->callback([o, exit] { *exit = run(*o); });
}

}  // namespace burin::cli
