// SPDX-License-Identifier: MIT
// Burin over the frames of a data set, through the C interface, one JSON object with a time for every frame
// and stage. Frames are decoded into memory first, so that what is timed is the runtime alone; with --stream
// they are decoded one by one, so that the peak of resident memory is the runtime's and not that of the
// frames.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "api/c_frame.h"
#include "core/arena.h"
#include "core/triangle_mesh.h"
#include "datasets/open.h"
#include "export/ply.h"
#include "mesh/mesher.h"
#include "pipeline/mesh_runs.h"
#include "support/frames.h"

namespace {

using burin::Frame;
using burin::Status;
using burin::bench::cpu_ms;
using burin::bench::now_ms;
using Json = nlohmann::ordered_json;

struct Options {
    burin::bench::FrameRange range;
    std::string frames, mesh_file, map_file;
    burin_config config = burin_config_default();
    std::uint64_t budget_mib = 1024;
    int passes = 1;
    bool no_carve = false, stream = false, mesh_each = false, mesh = false, like_open3d = false;
};

// One pass over the frames from an empty map.
struct Pass {
    std::vector<double> decode_ms, depth_ms, integrate_ms, frame_ms, frame_cpu_ms, mesh_ms, mesh_cpu_ms;
    std::vector<std::uint32_t> fused, added, carved;
    std::uint64_t dropped = 0;
};

Status fuse(const Frame& frame, burin_map map, Pass* pass) {
    const burin_frame in = burin::c_frame(frame);
    burin_frame_result result;
    const double start = now_ms(), cpu_start = cpu_ms();
    const burin_status status = burin_integrate(map, &in, &result);
    pass->frame_cpu_ms.push_back(cpu_ms() - cpu_start);
    pass->frame_ms.push_back(now_ms() - start);
    if (status != BURIN_OK)
        return Status::error(static_cast<burin::Code>(status), "%s", burin_last_error(map));
    pass->depth_ms.push_back(result.depth_ms);
    pass->integrate_ms.push_back(result.integrate_ms);
    pass->fused.push_back(result.chunks_fused);
    pass->added.push_back(result.chunks_new);
    pass->carved.push_back(result.chunks_carved);
    pass->dropped += result.chunks_dropped;
    return {};
}

// Hands every frame with a pose to `body`: from memory, or decoded one at a time.
template <class Body>
Status for_each_frame(const Options& o, const std::vector<Frame>& loaded, Pass* pass, Body&& body) {
    for (const Frame& frame : loaded) BURIN_TRY(body(frame));
    if (!o.stream) return {};
    const auto dataset = burin::open_dataset(o.range.dataset, o.range.format);
    if (!dataset) return dataset.status();
    Frame frame;
    for (int i = o.range.first; i < std::min(o.range.last, (*dataset)->frame_count()); ++i) {
        const double start = now_ms();
        BURIN_TRY((*dataset)->load(i, &frame));
        if (!frame.has_pose) continue;
        pass->decode_ms.push_back(now_ms() - start);
        if (!o.range.colour) frame.colour = {};
        BURIN_TRY(body(frame));
    }
    return {};
}

Json to_json(const Pass& p) {
    return {{"decode_ms", p.decode_ms},    {"depth_ms", p.depth_ms},         {"integrate_ms", p.integrate_ms},
            {"frame_ms", p.frame_ms},      {"frame_cpu_ms", p.frame_cpu_ms}, {"mesh_ms", p.mesh_ms},
            {"mesh_cpu_ms", p.mesh_cpu_ms}};
}

double area_m2(const burin::TriangleMesh& mesh) {
    double sum = 0;
    for (const auto& t : mesh.triangles) {
        const auto a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
        const double u[3] = {b.x - a.x, b.y - a.y, b.z - a.z}, v[3] = {c.x - a.x, c.y - a.y, c.z - a.z};
        sum +=
            0.5 * std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
    }
    return sum;
}

// What full meshing needs beside its output: the mesher's share of the arena for the chunks that are live.
double mesh_scratch_bytes(std::uint32_t chunks) {
    burin::Mesher mesher;
    burin::Arena arena;
    mesher.place(arena, chunks);
    return static_cast<double>(arena.used());
}

Json memory_of(const burin_statistics& s, std::uint64_t rss_fused, const burin::TriangleMesh& mesh) {
    // The share of the budget that the live chunks take, with their part of all tables.
    const double used =
        static_cast<double>(s.arena_bytes) * static_cast<double>(s.chunks_live) / s.chunks_capacity;
    Json memory = {{"rss_fused_bytes", rss_fused},
                   {"arena_bytes", s.arena_bytes},
                   {"chunks_live", s.chunks_live},
                   {"chunks_capacity", s.chunks_capacity},
                   {"map_bytes", used}};
    if (mesh.triangles.empty()) return memory;
    const double area = area_m2(mesh);
    memory["surface_m2"] = area;
    memory["map_bytes_per_m2"] = used / area;
    memory["mesh_scratch_bytes_per_vertex"] =
        mesh_scratch_bytes(s.chunks_live) / static_cast<double>(mesh.positions.size());
    return memory;
}

Status run(Options& o, Json* report) {
    Pass first;
    std::vector<Frame> frames;
    Frame probe;
    if (o.stream) {
        auto one = o.range;
        one.last = std::min(o.range.last, o.range.first + 10);  // TUM's first few frames may have no pose
        auto got = burin::bench::load_frames(one, nullptr);
        if (!got) return got.status();
        probe = std::move((*got)[0]);
    } else {
        auto got = burin::bench::load_frames(o.range, &first.decode_ms);
        if (!got) return got.status();
        frames = std::move(*got);
        probe.depth_camera = frames[0].depth_camera;
    }
    o.config.budget_bytes = o.budget_mib << 20;
    o.config.colour = o.range.colour;
    o.config.carve = !o.no_carve;
    o.config.max_width = static_cast<std::uint32_t>(probe.depth_camera.width);
    o.config.max_height = static_cast<std::uint32_t>(probe.depth_camera.height);
    burin_mesh_options options = burin_mesh_options_default();
    if (o.like_open3d) options.min_weight = 1, options.max_jump_voxels = 100;

    Json passes = Json::array(), mesh_full = Json::array(), mesh_full_cpu = Json::array();
    burin::TriangleMesh mesh;
    for (int i = 0; i < o.passes; ++i) {
        Pass pass = i == 0 ? std::move(first) : Pass{};
        burin::bench::BenchMap map;
        BURIN_TRY(map.create(o.config));
        burin::bench::IncrementalMesh incremental(o.range.colour);
        const auto step = [&](const Frame& frame) -> Status {
            BURIN_TRY(fuse(frame, map.get(), &pass));
            if (!o.mesh_each) return {};
            const double start = now_ms(), cpu_start = cpu_ms();
            BURIN_TRY(incremental.update(map.get(), options));
            pass.mesh_cpu_ms.push_back(cpu_ms() - cpu_start);
            pass.mesh_ms.push_back(now_ms() - start);
            return {};
        };
        BURIN_TRY(for_each_frame(o, frames, &pass, step));
        if (pass.frame_ms.empty())
            return Status::error(burin::Code::invalid_argument, "no frame of the range has a pose");
        passes.push_back(to_json(pass));
        const std::uint64_t rss_fused = burin::bench::peak_rss_bytes();
        if (o.mesh) {
            double ms = 0, cpu = 0;
            BURIN_TRY(burin::bench::full_mesh(map.get(), options, o.range.colour, &mesh, &ms, &cpu));
            mesh_full.push_back(ms), mesh_full_cpu.push_back(cpu);
        }
        if (i + 1 < o.passes) continue;
        burin_statistics s;
        burin_stats(map.get(), &s);
        (*report)["frames"] = pass.frame_ms.size();
        (*report)["chunks"] = {
            {"fused", pass.fused}, {"new", pass.added}, {"carved", pass.carved}, {"dropped", pass.dropped}};
        (*report)["memory"] = memory_of(s, rss_fused, mesh);
        (*report)["mesh"] = {{"vertices", mesh.positions.size()}, {"triangles", mesh.triangles.size()}};
        if (!o.map_file.empty()) {
            const double start = now_ms();
            if (burin_save(map.get(), o.map_file.c_str()) != BURIN_OK)
                return Status::error(burin::Code::io, "%s", burin_last_error(map.get()));
            (*report)["save_ms"] = now_ms() - start;
        }
    }
    (*report)["passes"] = passes;
    (*report)["mesh_full_ms"] = mesh_full;
    (*report)["mesh_full_cpu_ms"] = mesh_full_cpu;
    if (!o.mesh_file.empty()) BURIN_TRY(burin::write_ply(o.mesh_file, mesh));
    (*report)["memory"]["peak_rss_bytes"] = burin::bench::peak_rss_bytes();
    return {};
}

}  // namespace

int main(int argc, char** argv) {
    Options o;
    CLI::App app{"Times Burin over the frames of a data set and prints one JSON object"};
    app.add_option("dataset", o.range.dataset, "folder of the data set")->required();
    app.add_option("--format", o.range.format, "format of the data set, recognised by default");
    app.add_option("--frames", o.frames, "A:B, half open");
    app.add_option("--voxel", o.config.voxel_m, "metres");
    app.add_option("--truncation", o.config.truncation_voxels, "in voxels");
    app.add_option("--max-depth", o.config.max_depth_m, "metres");
    app.add_option("--threads", o.config.threads);
    app.add_option("--budget-mib", o.budget_mib, "bytes for the map, in MiB");
    app.add_option("--passes", o.passes, "times over the frames, each from an empty map")
        ->check(CLI::Range(1, 1000));
    app.add_flag("--colour", o.range.colour, "fuse colour too");
    app.add_flag("--no-carve", o.no_carve, "do not clear space that rays pass through");
    app.add_flag("--stream", o.stream, "decode frames one by one: for figures of memory");
    app.add_flag("--mesh-each", o.mesh_each, "mesh the changed chunks after every frame");
    app.add_flag("--mesh", o.mesh, "mesh the whole map at the end of a pass");
    app.add_flag("--like-open3d", o.like_open3d, "mesh voxels seen once, with jumps of any height");
    app.add_option("--write-mesh", o.mesh_file, "the mesh of --mesh as PLY");
    app.add_option("--write-map", o.map_file, "save the map, timed");
    CLI11_PARSE(app, argc, argv);
    if (!o.frames.empty() && !burin::bench::parse_range(o.frames, &o.range)) {
        std::fprintf(stderr, "pipeline: --frames %s: expected A:B with A < B\n", o.frames.c_str());
        return 2;
    }
    Json report = {
        {"program", "burin"},          {"dataset", o.range.dataset},
        {"voxel_m", o.config.voxel_m}, {"truncation_m", o.config.voxel_m * o.config.truncation_voxels},
        {"threads", o.config.threads}, {"colour", o.range.colour},
        {"simd", burin_simd_name()}};
    if (const Status status = run(o, &report); !status.ok()) {
        std::fprintf(stderr, "pipeline: %s\n", status.text());
        return 1;
    }
    std::printf("%s\n", report.dump().c_str());
    return 0;
}
