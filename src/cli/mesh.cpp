// SPDX-License-Identifier: MIT
// burin mesh: the surface of a saved map.
#include <cstdio>
#include <thread>

#include "cli/common.h"
#include "export/mesh_file.h"

namespace burin::cli {
namespace {

struct Options {
    std::string map, output;
    unsigned threads = std::max(1u, std::thread::hardware_concurrency());
    MeshFlags mesh;
    bool json = false, quiet = false;
};

int run(const Options& o) {
    OwnedMap map;
    if (const Status status = map.open(o.map, o.threads); !status.ok()) return complain_input(status);
    TriangleMesh mesh;
    const double start = now_ms();
    if (const Status status = extract_mesh(map.get(), o.mesh, true, &mesh); !status.ok())
        return complain_output(status);
    const double ms = now_ms() - start;
    burin_statistics stats;
    burin_stats(map.get(), &stats);
    if (const Status status = write_mesh(o.output, mesh); !status.ok()) return complain_output(status);
    if (o.json)
        std::printf("%s\n", nlohmann::json({{"vertices", mesh.positions.size()},
                                            {"triangles", mesh.triangles.size()},
                                            {"mesh_ms", ms},
                                            {"chunks", stats.chunks_live}})
                                .dump()
                                .c_str());
    else if (!o.quiet)
        std::printf("%s: %zu vertices, %zu triangles\n", o.output.c_str(), mesh.positions.size(),
                    mesh.triangles.size());
    return kDone;
}

}  // namespace

void add_mesh(CLI::App& app, int* exit) {
    auto* command = app.add_subcommand("mesh", "Write the surface of a saved map as a mesh");
    auto o = std::make_shared<Options>();
    command->add_option("map", o->map, "a map.burin")->required();
    command->add_option("-o,--output", o->output, "mesh file: .ply .obj .glb .stl")->required();
    command->add_option("--threads", o->threads, "worker threads")->capture_default_str();
    command->add_flag("--json", o->json, "print counts as JSON");
    command->add_flag("--quiet", o->quiet, "print nothing");
    o->mesh.add_to(*command);
    command->callback([o, exit] { *exit = run(*o); });
}

}  // namespace burin::cli
