// SPDX-License-Identifier: MIT
#include "suite/extras.h"

#include <cstdio>
#include <filesystem>
#include <fstream>

namespace burin::bench {
namespace {

std::string name_of(const std::string& dataset) { return std::filesystem::path(dataset).filename().string(); }

Json read_json(const std::string& path) {
    std::ifstream file(path);
    Json json = Json::parse(file, nullptr, false);
    return json.is_discarded() ? Json() : json;
}

}  // namespace

std::string frames_of(const Options& o, const std::string& dataset) {
    if (!o.frames.empty()) return o.frames;
    // 15 timed frames after 3, where the camera already moves and the truth has begun; the room is larger.
    if (o.quick) return name_of(dataset) == "room" ? "0:11" : "40:58";
    return name_of(dataset) == "tum_fr3_structure_notexture_far" ? "0:60" : "0:30";
}

Json kernels(const Options& o) {
    Json out = Json::object();
    const std::string program = o.build + "/bench/kernels/bench_kernels", file = o.results + "/kernels.json";
    if (!std::filesystem::exists(program)) return out;
    std::fprintf(stderr, "kernels\n");
    // Seconds a benchmark: some ten thousand calls.
    const Json json = run_json({program, std::string("--benchmark_min_time=") + (o.quick ? "0.01" : "0.2"),
                                "--benchmark_format=json", "--benchmark_out=" + file});
    if (!json.is_object()) return out;
    for (const Json& one : json["benchmarks"])
        if (one.contains("cpu_time")) out[one["name"].get<std::string>()] = one["cpu_time"];
    return out;
}

bool roofline(const Options& o, const std::string& dataset, const std::string& frames, Json* report) {
    std::fprintf(stderr, "roofline\n");
    const std::string file = o.results + "/roofline.json";
    const char* passes = o.quick ? "1" : "3";
    if (!run_plain({o.build + "/bench/roofline/bench_roofline", dataset, "--frames", frames, "--warm",
                    std::to_string(o.warm), "--passes", passes, "--repeats", passes, "--json", file}))
        return false;
    const Json json = read_json(file);
    if (!json.is_object()) return false;
    Json flat = Json::object();
    for (const Json& run : json["runs"]) {
        char prefix[16];
        std::snprintf(prefix, sizeof prefix, "%.0fmm_", 1e3 * run["voxel_m"].get<double>());
        for (const auto& [key, value] : run.items())
            if (value.is_number()) flat[prefix + key] = value;
        for (const auto& [key, value] : run["stages_ms"].items()) flat[prefix + ("stage_" + key)] = value;
    }
    (*report)["roofline"] = flat;
    (*report)["roofline_runs"] = json["runs"];
    return true;
}

Json memory(const Options& o, const std::string& dataset) {
    Json out = Json::object();
    for (const bool colour : {false, true}) {
        std::fprintf(stderr, "memory %s\n", colour ? "with colour" : "depth only");
        // TUM's first frames have no pose: 205 hold 200 that do. The budget is the default one.
        std::vector<std::string> command = {o.build + "/bench/pipeline/bench_pipeline",
                                            dataset,
                                            "--frames",
                                            "0:205",
                                            "--voxel",
                                            "0.005",
                                            "--stream",
                                            "--mesh",
                                            "--budget-mib",
                                            "256"};
        if (colour) command.push_back("--colour");
        const Json json = run_json(command);
        if (!json.is_object()) continue;
        const Json& m = json["memory"];
        const std::string suffix = colour ? "_colour" : "_depth_only";
        out["frames" + suffix] = json["frames"];
        out["dropped_chunks" + suffix] = json["chunks"]["dropped"];
        out["rss_fused_mb" + suffix] = 1e-6 * m["rss_fused_bytes"].get<double>();
        out["map_bytes_per_m2" + suffix] = m["map_bytes_per_m2"];
        out["mesh_scratch_bytes_per_vertex" + suffix] = m["mesh_scratch_bytes_per_vertex"];
    }
    return out;
}

Json coverage(const Options& o, const std::string& dataset, const std::string& frames) {
    Json out = Json::object();
    for (const int voxel_mm : {10, 5}) {
        const std::string voxel = voxel_mm == 5 ? "0.005" : "0.01", mm = std::to_string(voxel_mm) + "mm";
        const std::string ours = o.results + "/burin-" + mm + ".ply";
        if (!run_json({o.build + "/bench/pipeline/bench_pipeline", dataset, "--frames", frames, "--voxel",
                       voxel, "--mesh", "--write-mesh", ours})
                 .is_object())
            continue;
        for (const char* peer : {"open3d_vbg", "open3d_scalable"}) {
            std::fprintf(stderr, "coverage %s %s\n", mm.c_str(), peer);
            const std::string theirs = peer_mesh(o, dataset, peer, voxel_mm);
            // Completeness is the share of the second mesh near the first, precision the other way round.
            const Json json = run_json({o.build + "/src/cli/burin", "eval", "mesh", ours, theirs,
                                        "--threshold", voxel_mm == 5 ? "0.01" : "0.02", "--json"});
            if (!json.is_object()) continue;
            const std::string name = std::string(peer) + "_" + mm;
            out[name + "_covered_by_ours"] = json["scores"][0]["completeness_ratio"];
            out["ours_covered_by_" + name] = json["scores"][0]["precision"];
        }
    }
    return out;
}

}  // namespace burin::bench
