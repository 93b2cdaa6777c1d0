// SPDX-License-Identifier: MIT
// The layer of planes on recorded sequences with given poses, one thread: what it costs a frame, how still it
// holds the surface, its candidates beside RANSAC on the mesh, and both ways to new planes.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "planes/compare.h"
#include "planes/stability.h"
#include "support/frames.h"

namespace burin::bench {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
    std::vector<std::string> datasets;
    MappingOptions mapping;
    StabilityOptions stability;
    RansacOptions ransac;
    bool json = false, no_stability = false;
};

Json summary(const std::vector<double>& values) {
    return {{"mean", mean_of(values)}, {"p50", quantile(values, 0.5)}, {"p95", quantile(values, 0.95)}};
}

Json json_of(const CandidateFigures& f) {
    return {{"us_per_chunk", f.us_per_chunk},
            {"found", f.found},
            {"on_planes", f.on_planes},
            {"angle_deg", summary(f.angle_deg)},
            {"distance_mm", summary(f.distance_mm)}};
}

// One whole pass: frames, then the last word about planes, against the truth where there is one.
Status add_pass(const Options& o, const std::string& folder, const std::vector<LabelledPlane>& truth,
                MergeBy merge_by, Json* out) {
    MappingOptions options = o.mapping;
    options.merge_by = merge_by;
    Mapping mapping(options);
    BURIN_TRY(mapping.run(folder));
    std::vector<double> planes_ms, integrate_ms;
    for (const FrameReport& f : mapping.frames()) {
        planes_ms.push_back(f.planes_ms);
        integrate_ms.push_back(f.integrate_ms);
    }
    if (merge_by == MergeBy::ransac) (*out)["frames"] = mapping.frames().size();
    Json& pass = (*out)[merge_by == MergeBy::ransac ? "merge_ransac" : "merge_growing"];
    pass["planes_ms"] = summary(planes_ms);
    pass["integrate_ms"] = summary(integrate_ms);
    pass["planes_before_refresh"] = mapping.told();
    const double start = cpu_ms();
    mapping.session().refresh_planes(mapping.jobs());
    pass["refresh_ms"] = cpu_ms() - start;
    pass["planes"] = mapping.told();
    if (truth.empty()) return {};
    const PlaneMatches m = match_planes(mapping.planes(), truth, {});
    pass["recall"] = m.recall;
    pass["precision"] = m.precision;
    pass["true_planes"] = m.true_planes;
    pass["found_planes"] = m.found_planes;
    pass["split"] = m.split;
    pass["angle_deg"] = {{"p50", m.median_angle_deg}, {"worst", m.worst_angle_deg}};
    pass["offset_mm"] = {{"p50", 1e3 * m.median_offset_m}, {"worst", 1e3 * m.worst_offset_m}};
    if (merge_by != MergeBy::ransac) return {};
    const CandidateComparison c = compare_candidates(mapping, truth, o.ransac);
    (*out)["candidates"] = {{"chunks", c.chunks},
                            {"mesh_us_per_chunk", c.mesh_us_per_chunk},
                            {"least_squares", json_of(c.distances)},
                            {"ransac", json_of(c.ransac)},
                            {"in_both",
                             {{"pairs", c.both_least_squares_deg.size()},
                              {"least_squares_deg", summary(c.both_least_squares_deg)},
                              {"ransac_deg", summary(c.both_ransac_deg)},
                              {"least_squares_mm", summary(c.both_least_squares_mm)},
                              {"ransac_mm", summary(c.both_ransac_mm)}}}};
    return {};
}

Status add_stability(const Options& o, const std::string& folder, bool refresh, Json* out) {
    Mapping mapping(o.mapping);
    StabilityOptions options = o.stability;
    options.refresh = refresh;
    Stability stability(options);
    BURIN_TRY(mapping.run(folder, [&](int frames) { stability.take(mapping, frames); }));
    const Motion& m = stability.motion();
    const auto ratio = [](double a, double b) { return b > 0 ? a / b : 0; };
    const auto um = [](double metres) { return 1e6 * metres; };
    (*out)[refresh ? "stability_refreshed" : "stability"] = {
        {"every", o.stability.every},
        {"pairs", stability.pairs()},
        {"vertices", m.with.size()},
        {"with_p50_um", um(quantile(m.with, 0.5))},
        {"without_p50_um", um(quantile(m.without, 0.5))},
        {"ratio_p50", ratio(quantile(m.with, 0.5), quantile(m.without, 0.5))},
        {"with_p95_um", um(quantile(m.with, 0.95))},
        {"without_p95_um", um(quantile(m.without, 0.95))},
        {"with_mean_um", um(mean_of(m.with))},
        {"without_mean_um", um(mean_of(m.without))},
        {"ratio_mean", ratio(mean_of(m.with), mean_of(m.without))}};
    return {};
}

Status measure(const Options& o, const std::string& folder, Json* out) {
    std::vector<LabelledPlane> truth;
    if (const std::string path = folder + "/truth/planes.json"; std::filesystem::is_regular_file(path)) {
        auto read = read_planes(path);
        if (!read.ok()) return read.status();
        truth = std::move(*read);
    }
    (*out)["dataset"] = folder.substr(folder.find_last_of('/') + 1);
    BURIN_TRY(add_pass(o, folder, truth, MergeBy::ransac, out));
    if (!truth.empty()) BURIN_TRY(add_pass(o, folder, truth, MergeBy::growing, out));
    for (const bool refresh : {false, true})
        if (!o.no_stability) BURIN_TRY(add_stability(o, folder, refresh, out));
    return {};
}

int run(int argc, char** argv) {
    Options o;
    burin_config& config = o.mapping.config;
    config = burin_config_default();
    config.planes = 1;
    config.colour = 0;
    // What the figures of docs/planes.md are by.
    config.truncation_voxels = 8;
    config.bilateral = config.edge_removal = 1;
    config.max_depth_m = 5;
    config.budget_bytes = std::uint64_t{2} << 30;
    CLI::App app("Measure the layer of planes");
    app.add_option("datasets", o.datasets)->required();
    app.add_option("--first", o.mapping.first);
    app.add_option("--last", o.mapping.last, "frames of the data set, half open");
    app.add_option("--voxel", config.voxel_m)->capture_default_str();
    app.add_option("--truncation", config.truncation_voxels)->capture_default_str();
    app.add_option("--max-depth", config.max_depth_m)->capture_default_str();
    app.add_option("--every", o.stability.every, "frames between two meshes")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    app.add_option("--seen", o.stability.least_seen, "observations before the surface counts")
        ->check(CLI::Range(0, 200))
        ->capture_default_str();
    app.add_option("--hypotheses", o.ransac.hypotheses)->check(CLI::PositiveNumber)->capture_default_str();
    app.add_option("--least", o.ransac.least, "vertices of a plane of the baseline")
        ->check(CLI::Range(4, 1000))
        ->capture_default_str();
    app.add_flag("--no-stability", o.no_stability);
    app.add_flag("--json", o.json, "an object a sequence on one line");
    CLI11_PARSE(app, argc, argv);
    if (const Status status = check_config(config); !status.ok())
        return std::fprintf(stderr, "%s\n", status.text()), 2;
    o.ransac.inlier_m = 0.5 * static_cast<double>(config.voxel_m);
    for (const std::string& dataset : o.datasets) {
        Json out;
        if (const Status status = measure(o, dataset, &out); !status.ok())
            return std::fprintf(stderr, "%s: %s\n", dataset.c_str(), status.text()), 1;
        std::printf("%s\n", out.dump(o.json ? -1 : 2).c_str());
        std::fflush(stdout);
    }
    return 0;
}

}  // namespace
}  // namespace burin::bench

int main(int argc, char** argv) { return burin::bench::run(argc, argv); }
