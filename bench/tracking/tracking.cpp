// SPDX-License-Identifier: MIT
// Tracks recorded sequences with given settings, disturbed when told so, and scores the trajectory: one line
// a sequence, or with --json one object.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "datasets/trajectory_file.h"
#include "tracking/score.h"

namespace burin::bench {
namespace {

struct Options {
    std::vector<std::string> datasets;
    RunOptions run;
    std::string tracker = "sdf", weight = "constant", drop = "none", trajectory, blank, hand, plane;
    bool json = false;
};

int score_one(const Options& o, const std::string& folder) {
    const auto run = track_sequence(folder, o.run);
    if (!run.ok()) return std::fprintf(stderr, "%s\n", run.status().text()), 1;
    auto row = score_run(*run, o.run.disturbance);
    if (!row.ok()) return std::fprintf(stderr, "%s: %s\n", folder.c_str(), row.status().text()), 1;
    const std::string name = folder.substr(folder.find_last_of('/') + 1);
    if (o.json) {
        nlohmann::ordered_json object = {{"dataset", name},
                                         {"tracker", o.tracker},
                                         {"colour", o.run.tracking.colour},
                                         {"gyro", o.run.tracking.gyro && run->has_imu},
                                         {"threads", o.run.threads}};
        object.update(*row);
        std::printf("%s\n", object.dump().c_str());
    } else {
        std::printf("%s\n", line_of(name, *row).c_str());
    }
    std::fflush(stdout);
    if (o.trajectory.empty()) return 0;
    const Status written = write_tum_trajectory(o.trajectory, estimate_of(*run));
    return written.ok() ? 0 : (std::fprintf(stderr, "%s\n", written.text()), 1);
}

void add_options(CLI::App& app, Options* o) {
    burin_config& config = o->run.config;
    TrackingOptions& tracking = o->run.tracking;
    Disturbance& disturbance = o->run.disturbance;
    app.add_option("datasets", o->datasets)->required();
    app.add_option("--first", o->run.first);
    app.add_option("--last", o->run.last, "frames of the data set, half open");
    app.add_option("--threads", o->run.threads);
    app.add_option("--voxel", config.voxel_m);
    app.add_option("--truncation", config.truncation_voxels);
    app.add_option("--quadratic", config.truncation);
    app.add_option("--truncation-scale", config.truncation_scale);
    app.add_option("--max-depth", config.max_depth_m);
    app.add_option("--max-weight", config.max_weight);
    app.add_option("--weight", o->weight);
    app.add_option("--drop", o->drop);
    app.add_option("--edge-removal", config.edge_removal);
    app.add_option("--angle-weight", config.angle_weight);
    app.add_option("--bilateral", config.bilateral);
    app.add_option("--carve", config.carve);
    app.add_option("--trajectory", o->trajectory, "file for the poses (TUM)");
    app.add_option("--tracker", o->tracker)->check(CLI::IsMember({"sdf", "icp"}));
    app.add_option("--select", tracking.select);
    app.add_option("--least", tracking.descent.least_m);
    app.add_option("--colour", tracking.colour);
    app.add_option("--gyro", tracking.gyro, "0: not even where there is an IMU");
    app.add_option("--colour-weight", tracking.colour_weight);
    app.add_option("--steps0", tracking.descent.steps[0]);
    app.add_option("--steps1", tracking.descent.steps[1]);
    app.add_option("--steps2", tracking.descent.steps[2]);
    app.add_flag("--back", o->run.back, "then the same frames backwards");
    app.add_option("--mesh", o->run.mesh, "file for the mesh of the map at the end (PLY)");
    app.add_option("--true-mesh", o->run.true_mesh,
                   "the same of the same frames, fused with their true poses (PLY)");
    app.add_option("--blank", o->blank,
                   "A:B, frames without depth and colour; with --back the count goes on");
    app.add_option("--hand", o->hand, "A:B, frames with a hand before the lens");
    app.add_option("--plane", o->plane,
                   "A:B, frames of which the largest plane alone is seen, without colour");
    app.add_option("--dropout", disturbance.dropout, "share of depth pixels without a reading")
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--skip", disturbance.skip, "every N-th frame only")->check(CLI::Range(1, 100));
    app.add_flag("--verbose", o->run.verbose, "a line a frame");
    app.add_flag("--json", o->json, "an object a sequence");
}

int run(int argc, char** argv) {
    Options o;
    o.run.config = burin_scan_config_default();
    CLI::App app("Track sequences and score the trajectories");
    add_options(app, &o);
    CLI11_PARSE(app, argc, argv);
    for (const auto& [text, span] :
         {std::pair(&o.blank, &o.run.disturbance.blank), std::pair(&o.hand, &o.run.disturbance.hand),
          std::pair(&o.plane, &o.run.disturbance.plane)})
        if (!text->empty() && !parse_span(*text, span))
            return std::fprintf(stderr, "'%s': expected frames A:B with A < B\n", text->c_str()), 2;
    burin_config& config = o.run.config;
    config.colour = o.run.tracking.colour;  // of the map: a lost camera is found by it
    config.weight = o.weight == "inverse-z2" ? BURIN_WEIGHT_INVERSE_Z2 : BURIN_WEIGHT_CONSTANT;
    config.drop = o.drop == "linear"        ? BURIN_DROP_LINEAR
                  : o.drop == "exponential" ? BURIN_DROP_EXPONENTIAL
                                            : BURIN_DROP_NONE;
    o.run.tracking.tracker = o.tracker == "icp" ? Tracker::icp : Tracker::sdf;
    int failed = 0;
    for (const std::string& dataset : o.datasets) failed |= score_one(o, dataset);
    return failed;
}

}  // namespace
}  // namespace burin::bench

int main(int argc, char** argv) { return burin::bench::run(argc, argv); }
