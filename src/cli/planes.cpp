// SPDX-License-Identifier: MIT
// burin planes: the planes of a saved map, and its mesh drawn to them.
#include <cmath>
#include <cstdio>

#include "cli/common.h"
#include "export/mesh_file.h"

namespace burin::cli {
namespace {

struct PlanesOptions {
    std::string map, output;
    std::vector<double> up;
    MeshFlags mesh;
    unsigned threads = 1;
    bool label_colours = false, raw = false, json = false, quiet = false;
};

Status set_up(burin_map map, const std::vector<double>& up) {
    if (up.empty()) return {};
    const Vec3d u{up[0], up[1], up[2]};
    if (!(norm(u) > 1e-6 && norm(u) < 1e9))
        return Status::error(Code::invalid_argument, "--up: %g,%g,%g, expected a direction", u.x, u.y, u.z);
    const Vec3d unit = normalised(u);
    const double direction[3] = {unit.x, unit.y, unit.z};
    return status_of(burin_set_up(map, direction), map);
}

// The mesh of the same map without planes, for burin eval planes to compare with.
Status write_raw(const PlanesOptions& o, bool colour) {
    OwnedMap map;
    BURIN_TRY(map.open(o.map, o.threads, PlanesWanted::off));
    TriangleMesh mesh;
    BURIN_TRY(extract_mesh(map.get(), o.mesh, colour, &mesh));
    return write_mesh(o.output + "/raw.ply", mesh);
}

int run(const PlanesOptions& o) {
    if (!is_map_file(o.map)) return complain(kBadInput, o.map + ": not a map file (map.burin)");
    OwnedMap map;
    Status status = map.open(o.map, o.threads, PlanesWanted::on);
    if (status.ok()) status = set_up(map.get(), o.up);
    if (!status.ok()) return complain_input(status);
    if (status = prepare_folder(o.output); !status.ok()) return complain_output(status);
    if (status = status_of(burin_refresh_planes(map.get()), map.get()); !status.ok())
        return complain_output(status);
    burin_file_info info;
    burin_file_probe(o.map.c_str(), &info);
    const bool colour = info.has_colour != 0;
    TriangleMesh mesh;
    nlohmann::json counts;
    status = extract_mesh(map.get(), o.mesh, colour, &mesh);
    if (status.ok()) status = label_faces(map.get(), &mesh);
    if (status.ok()) status = write_plane_files(map.get(), mesh, o.output, &counts);
    if (status.ok() && o.label_colours) paint_labels(&mesh);
    if (status.ok()) status = write_mesh(o.output + "/mesh.ply", mesh);
    if (status.ok() && o.raw) status = write_raw(o, colour);
    if (!status.ok()) return complain_output(status);
    if (o.json) {
        std::size_t filled = 0;
        for (const std::uint8_t f : mesh.filled) filled += f;
        counts["vertices"] = mesh.positions.size();
        counts["triangles"] = mesh.triangles.size();
        counts["filled_triangles"] = filled;
        std::printf("%s\n", counts.dump().c_str());
    } else if (!o.quiet) {
        std::printf("%s: %zu planes, %zu objects\n", (o.output + "/planes.json").c_str(),
                    counts["planes"].get<std::size_t>(), counts["objects"].get<std::size_t>());
    }
    return kDone;
}

}  // namespace

void add_planes(CLI::App& app, int* exit) {
    auto* command = app.add_subcommand("planes",
                                       "Find the planes of a saved map: planes.json, objects.json, "
                                       "floorplan.svg, and mesh.ply drawn to them, with labels");
    auto o = std::make_shared<PlanesOptions>();
    command->add_option("map", o->map, "map.burin")->required();
    command->add_option("-o,--output", o->output, "folder for the results")->required();
    command->add_option("--up", o->up, "x,y,z: against gravity, where the map does not know")
        ->delimiter(',')
        ->expected(3);
    command->add_flag(
        "--label-colours", o->label_colours,
        "colours of mesh.ply by label: wall orange, floor green, ceiling light blue, table red, "
        "seat pink, window blue, door yellow, none grey");
    command->add_flag("--raw", o->raw, "also raw.ply, the mesh without planes");
    command->add_option("--threads", o->threads, "worker threads")->capture_default_str();
    command->add_flag("--json", o->json, "print the counts on stdout");
    command->add_flag("--quiet", o->quiet, "say nothing");
    o->mesh.add_to(*command);
    command->callback([o, exit] { *exit = run(*o); });
}

}  // namespace burin::cli
