// SPDX-License-Identifier: MIT
// Tracks recorded sequences with given settings and scores the trajectory: one row a sequence.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "api/config.h"
#include "core/jobs.h"
#include "datasets/open.h"
#include "datasets/prefetch.h"
#include "datasets/trajectory_file.h"
#include "eval/trajectory.h"
#include "session/fusion_session.h"
#include "support/frames.h"

namespace burin {
namespace {

struct Options {
    std::vector<std::string> datasets;
    burin_config config = burin_scan_config_default();
    TrackingOptions tracking;
    int first = 0, last = 1 << 30, threads = 2;
    std::string tracker = "sdf", weight = "constant", drop = "linear", trajectory;
    bool verbose = false, given = false;
};

double median(std::vector<double> v, double share = 0.5) {
    if (v.empty()) return 0;
    std::sort(v.begin(), v.end());
    return v[static_cast<std::size_t>(share * static_cast<double>(v.size() - 1))];
}

int run_one(const Options& o, const std::string& folder) {
    const auto dataset = open_dataset(folder, "");
    if (!dataset.ok()) return std::fprintf(stderr, "%s\n", dataset.status().text()), 1;
    FusionOptions options = options_of(o.config);
    options.tracking = o.tracking;
    options.tracking.tracker = o.tracker == "icp" ? Tracker::icp : Tracker::sdf;
    options.budget_bytes = std::uint64_t{2} << 30;
    std::uint64_t bytes = 0;
    options.volume.capacity = FusionSession::capacity_for(options, &bytes);
    void* memory = std::aligned_alloc(4096, (bytes + 4095) & ~std::uint64_t{4095});
    Arena arena(memory, bytes);
    auto session = std::make_unique<FusionSession>();
    session->place(arena, options);
    session->clear();
    Jobs jobs(o.threads);
    Trajectory estimate, truth;
    std::vector<double> depth_ms, track_ms, fuse_ms, evaluations;
    const int end = std::min(o.last, (*dataset)->frame_count());
    FramePrefetcher frames(**dataset, o.first, end, 4, 1);
    Frame frame;
    int lost = 0, weak = 0;
    for (;;) {
        const Result<bool> got = frames.next(&frame);
        if (!got.ok()) return std::fprintf(stderr, "%s\n", got.status().text()), 1;
        if (!*got) break;
        if (!frame.has_pose && estimate.empty()) continue;
        const FrameView view = bench::view_of(frame);
        const ScanReport r = session->scan(view, jobs);
        if (frame.has_pose) truth.push_back({frame.t_ns, frame.T_world_camera});
        if (r.tracking.state != TrackingState::lost)
            estimate.push_back({frame.t_ns, r.tracking.T_world_camera});
        lost += r.tracking.state == TrackingState::lost;
        weak += r.tracking.state == TrackingState::weak;
        depth_ms.push_back(r.fusion.depth_ms);
        track_ms.push_back(r.tracking.track_ms);
        fuse_ms.push_back(r.fusion.integrate_ms);
        evaluations.push_back(r.tracking.evaluations);
        if (o.verbose)
            std::printf(
                "%4d %s evals %2d close %.3f known %.3f cost %.3f scale %.3f colour %.2f weakest %.2f mm "
                "free %d jump %.1f mm %.2f deg error %.1f mm\n",
                frames.index(),
                r.tracking.state == TrackingState::tracking ? "ok  "
                : r.tracking.state == TrackingState::weak   ? "weak"
                                                            : "lost",
                r.tracking.evaluations, r.tracking.verdict.close_share, r.tracking.verdict.known_share,
                r.tracking.cost, r.tracking.scale, r.tracking.verdict.keyframe_share,
                1e3 * r.tracking.verdict.weakest_m, r.tracking.verdict.free_directions,
                1e3 * r.tracking.verdict.jump_m, 57.3 * r.tracking.verdict.jump_rad,
                1e3 * norm(r.tracking.T_world_camera.t - frame.T_world_camera.t));
    }
    std::free(memory);
    const auto error = absolute_error(estimate, truth, Alignment::se3);
    const auto start = absolute_error(estimate, truth, Alignment::none);
    if (!error.ok()) return std::fprintf(stderr, "%s: %s\n", folder.c_str(), error.status().text()), 1;
    std::printf(
        "%-34s ATE %7.2f median %6.2f max %7.2f unaligned %7.2f mm  lost %d weak %d of %zu  track %.2f p95 "
        "%.2f fuse %.2f depth %.2f ms evals %.0f chunks %u\n",
        folder.substr(folder.find_last_of('/') + 1).c_str(), 1e3 * error->translation_m.rmse,
        1e3 * error->translation_m.median, 1e3 * error->translation_m.max, 1e3 * start->translation_m.rmse,
        lost, weak, truth.size(), median(track_ms), median(track_ms, 0.95), median(fuse_ms), median(depth_ms),
        median(evaluations), session->volume().live());
    std::fflush(stdout);
    if (!o.trajectory.empty()) (void)write_tum_trajectory(o.trajectory, estimate);
    return 0;
}

}  // namespace
}  // namespace burin

int main(int argc, char** argv) {
    using namespace burin;
    Options o;
    CLI::App app("Track sequences and score the trajectories");
    app.add_option("datasets", o.datasets)->required();
    app.add_option("--first", o.first);
    app.add_option("--last", o.last);
    app.add_option("--threads", o.threads);
    app.add_option("--voxel", o.config.voxel_m);
    app.add_option("--truncation", o.config.truncation_voxels);
    app.add_option("--quadratic", o.config.truncation);
    app.add_option("--truncation-scale", o.config.truncation_scale);
    app.add_option("--max-depth", o.config.max_depth_m);
    app.add_option("--max-weight", o.config.max_weight);
    app.add_option("--weight", o.weight);
    app.add_option("--drop", o.drop);
    app.add_option("--edge-removal", o.config.edge_removal);
    app.add_option("--angle-weight", o.config.angle_weight);
    app.add_option("--bilateral", o.config.bilateral);
    app.add_option("--carve", o.config.carve);
    app.add_option("--trajectory", o.trajectory);
    app.add_option("--tracker", o.tracker)->check(CLI::IsMember({"sdf", "icp"}));
    app.add_option("--select", o.tracking.select);
    app.add_option("--least", o.tracking.descent.least_m);
    app.add_option("--colour", o.tracking.colour);
    app.add_option("--colour-weight", o.tracking.colour_weight);
    app.add_option("--steps0", o.tracking.descent.steps[0]);
    app.add_option("--steps1", o.tracking.descent.steps[1]);
    app.add_option("--steps2", o.tracking.descent.steps[2]);
    app.add_flag("--verbose", o.verbose);
    o.drop = "none";
    CLI11_PARSE(app, argc, argv);
    o.config.colour = 0;
    o.config.weight = o.weight == "inverse-z2" ? BURIN_WEIGHT_INVERSE_Z2 : BURIN_WEIGHT_CONSTANT;
    o.config.drop = o.drop == "linear"        ? BURIN_DROP_LINEAR
                    : o.drop == "exponential" ? BURIN_DROP_EXPONENTIAL
                                              : BURIN_DROP_NONE;
    int failed = 0;
    for (const std::string& dataset : o.datasets) failed += run_one(o, dataset);
    return failed;
}
