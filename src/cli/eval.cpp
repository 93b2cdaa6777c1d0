// SPDX-License-Identifier: MIT
// burin eval: trajectories and meshes against the truth.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <thread>

#include "cli/common.h"
#include "core/jobs.h"
#include "datasets/open.h"
#include "datasets/prefetch.h"
#include "datasets/synthetic/camera_path.h"
#include "datasets/synthetic/render.h"
#include "datasets/synthetic/synth.h"
#include "datasets/synthetic/truth_mesh.h"
#include "datasets/trajectory_file.h"
#include "eval/mesh_metrics.h"
#include "eval/mesh_topology.h"
#include "eval/trajectory.h"
#include "eval/triangle_bvh.h"
#include "export/ply.h"

namespace burin::cli {
namespace {

nlohmann::json json_of(const ErrorStats& s) {
    return {{"rmse", s.rmse}, {"mean", s.mean},   {"median", s.median},
            {"max", s.max},   {"std", s.std_dev}, {"count", s.count}};
}

// ------------------------------------------------------------------------------------------------- eval
// trajectory

struct TrajectoryOptions {
    std::string estimate, truth, align = "se3";
    double delta_s = 1;
    bool json = false;
};

int run_trajectory(const TrajectoryOptions& o) {
    const auto estimate = read_tum_trajectory(o.estimate);
    if (!estimate.ok()) return complain_input(estimate.status());
    const auto truth = read_tum_trajectory(o.truth);
    if (!truth.ok()) return complain_input(truth.status());
    const Alignment alignment = o.align == "sim3"   ? Alignment::sim3
                                : o.align == "none" ? Alignment::none
                                                    : Alignment::se3;
    const auto aligned = absolute_error(*estimate, *truth, alignment);
    if (!aligned.ok()) return complain(kBadInput, o.estimate + ": " + aligned.status().text());
    const auto plain = absolute_error(*estimate, *truth, Alignment::none);
    if (!plain.ok()) return complain(kBadInput, o.estimate + ": " + plain.status().text());
    const auto relative = relative_error(*estimate, *truth, {RelativeDelta::Unit::seconds, o.delta_s});
    nlohmann::json out = {{"alignment", o.align},
                          {"ate_m", json_of(aligned->translation_m)},
                          {"ate_unaligned_m", json_of(plain->translation_m)},
                          {"scale", aligned->scale},
                          {"pairs", aligned->pairs.size()},
                          {"path_length_m", path_length_m(*truth)}};
    if (relative.ok())
        out["rpe"] = {{"delta_s", o.delta_s},
                      {"translation_m", json_of(relative->translation_m)},
                      {"rotation_rad", json_of(relative->rotation_rad)}};
    if (o.json) {
        std::printf("%s\n", out.dump().c_str());
        return kDone;
    }
    const ErrorStats& a = aligned->translation_m;
    std::printf(
        "ATE (%s)  rmse %.6f m  mean %.6f  median %.6f  max %.6f  (%lld pairs, path %.3f m, scale %.6f)\n",
        o.align.c_str(), a.rmse, a.mean, a.median, a.max, static_cast<long long>(a.count),
        path_length_m(*truth), aligned->scale);
    std::printf("ATE (unaligned)  rmse %.6f m  median %.6f  max %.6f\n", plain->translation_m.rmse,
                plain->translation_m.median, plain->translation_m.max);
    if (relative.ok())
        std::printf("RPE per %.3g s  translation rmse %.6f m  median %.6f  rotation rmse %.6f rad\n",
                    o.delta_s, relative->translation_m.rmse, relative->translation_m.median,
                    relative->rotation_rad.rmse);
    else
        std::printf("RPE  %s\n", relative.status().text());
    return kDone;
}

// -------------------------------------------------------------------------------------------------------
// eval mesh

struct MeshEvalOptions {
    std::string estimate, truth, scene, dataset, frames;
    std::uint64_t seed = 1;
    std::vector<double> thresholds = {0.01, 0.02, 0.05};
    int samples = 300000;
    double min_depth_m = 0.2, max_depth_m = 4;
    unsigned threads = std::max(1u, std::thread::hardware_concurrency());
    bool json = false;
};

nlohmann::json json_of(const DistanceStats& s) {
    return {{"mean_m", s.mean_m}, {"median_m", s.median_m}, {"rms_m", s.rms_m},
            {"p99_m", s.p99_m},   {"max_m", s.max_m},       {"count", s.count}};
}

nlohmann::json json_of(const MeshTopology& t) {
    return {{"vertices", t.vertices},
            {"triangles", t.triangles},
            {"duplicate_vertices", t.duplicate_vertices},
            {"unreferenced_vertices", t.unreferenced_vertices},
            {"degenerate_triangles", t.degenerate_triangles},
            {"boundary_edges", t.boundary_edges},
            {"non_manifold_edges", t.non_manifold_edges},
            {"inconsistent_edges", t.inconsistent_edges},
            {"components", t.components},
            {"area_m2", t.area_m2},
            {"clean", t.clean()}};
}

// The cameras that looked at the scene: those of the data set, or of the scene's own path.
Status cameras_of(const MeshEvalOptions& o, Camera* camera, Trajectory* poses) {
    int begin = 0, end = 1000000000;
    if (!o.frames.empty() && !parse_range(o.frames, &begin, &end))
        return Status::error(Code::invalid_argument, "--frames: '%s', expected A:B with A < B",
                             o.frames.c_str());
    if (o.dataset.empty()) {
        *camera = synth_camera(640, 480);
        *poses = builtin_path(o.scene, o.seed, default_frame_count(o.scene));
    } else {
        const auto dataset = open_dataset(o.dataset, "");
        if (!dataset.ok()) return dataset.status();
        Frame first;
        BURIN_TRY((*dataset)->load(0, &first));
        *camera = first.depth_camera;
        auto truth = read_tum_trajectory(o.dataset + "/groundtruth.txt");
        if (!truth.ok()) return truth.status();
        *poses = std::move(*truth);
    }
    end = std::min(end, static_cast<int>(poses->size()));
    if (begin >= end)
        return Status::error(Code::invalid_argument, "--frames: starts at %d of %zu frames", begin,
                             poses->size());
    *poses = Trajectory(poses->begin() + begin, poses->begin() + end);
    return {};
}

// The seed a rendered data set was made with.
Status seed_of(const std::string& dataset, const std::string& scene, std::uint64_t* seed) {
    const std::string path = dataset + "/truth/scene.json";
    std::ifstream file(path);
    if (!file)
        return Status::error(Code::io, "%s: cannot read (is this a sequence of burin synth?)", path.c_str());
    const auto json = nlohmann::json::parse(file, nullptr, false);
    if (json.is_discarded() || !json.is_object() || !json.contains("seed") ||
        !json["seed"].is_number_unsigned() || !json.contains("scene"))
        return Status::error(Code::format, "%s: expected an object with \"scene\" and \"seed\"",
                             path.c_str());
    if (json["scene"] != scene)
        return Status::error(Code::invalid_argument, "%s: rendered from scene %s, --scene says '%s'",
                             path.c_str(), json["scene"].dump().c_str(), scene.c_str());
    *seed = json["seed"].get<std::uint64_t>();
    return {};
}

// Points of the true surface that some frame saw.
Status seen_samples(const MeshEvalOptions& o, const SyntheticScene& scene, Jobs& jobs, SurfaceSamples* out,
                    double* seen_share) {
    Camera camera;
    Trajectory poses;
    BURIN_TRY(cameras_of(o, &camera, &poses));
    const auto points = sample_surface(scene, o.samples, o.seed, 0, jobs);
    if (!points.ok()) return points.status();
    std::vector<Vec3d> positions;
    for (const SurfacePoint& p : *points) positions.push_back(p.position);
    std::vector<std::uint8_t> seen(positions.size(), 0);
    Progress progress("visibility", static_cast<int>(poses.size()), o.json);
    for (std::size_t i = 0; i < poses.size(); ++i) {
        // Two millimetres before the point the ray must still be free: less than any object is thick.
        mark_seen(scene, camera, poses[i].T_world_camera, o.min_depth_m, o.max_depth_m, 0.002, positions,
                  jobs, &seen);
        progress.update(static_cast<int>(i) + 1);
    }
    for (std::size_t i = 0; i < seen.size(); ++i) {
        if (!seen[i]) continue;
        out->points.push_back(positions[i]);
        out->normals.push_back((*points)[i].normal);
    }
    *seen_share =
        static_cast<double>(out->points.size()) / static_cast<double>(std::max<std::size_t>(seen.size(), 1));
    return {};
}

Status measure(const MeshEvalOptions& o, const TriangleMesh& estimate, MeshMetrics* metrics,
               nlohmann::json* json) {
    Jobs jobs(static_cast<int>(o.threads));
    MeshMetricsOptions options;
    options.samples = o.samples;
    options.thresholds_m = o.thresholds;
    if (o.scene.empty()) {
        const auto truth = read_ply(o.truth);
        if (!truth.ok()) return truth.status();
        auto measured = evaluate_mesh(estimate, *truth, options, jobs);
        if (!measured.ok()) return measured.status();
        *metrics = std::move(*measured);
        return {};
    }
    MeshEvalOptions sized = o;
    if (!o.dataset.empty()) BURIN_TRY(seed_of(o.dataset, o.scene, &sized.seed));
    const auto scene = make_scene(o.scene, sized.seed);
    if (!scene.ok()) return scene.status();
    SurfaceSamples samples;
    double share = 0;
    BURIN_TRY(seen_samples(sized, **scene, jobs, &samples, &share));
    MeshTruth truth;
    truth.samples = &samples;
    truth.distance_m = [&](Vec3d p) { return (*scene)->surface_distance(p); };
    truth.normal = [&](Vec3d p) { return (*scene)->normal(p); };
    auto measured = evaluate_mesh(estimate, truth, options, jobs);
    if (!measured.ok()) return measured.status();
    *metrics = std::move(*measured);
    (*json)["scene"] = o.scene;
    (*json)["seed"] = sized.seed;
    (*json)["seen_share"] = share;
    return {};
}

int run_mesh(const MeshEvalOptions& o) {
    if (o.scene.empty() == o.truth.empty())
        return complain(kBadInput, "eval mesh: expected either a truth mesh or --scene");
    const auto estimate = read_ply(o.estimate);
    if (!estimate.ok()) return complain_input(estimate.status());
    const auto topology = check_topology(*estimate);
    if (!topology.ok()) return complain(kBadInput, o.estimate + ": " + topology.status().text());
    MeshMetrics m;
    nlohmann::json out;
    if (const Status status = measure(o, *estimate, &m, &out); !status.ok()) return complain_input(status);
    out["accuracy"] = json_of(m.accuracy);
    out["completeness"] = json_of(m.completeness);
    out["normal_consistency"] = m.normal_consistency;
    out["flipped_ratio"] = m.flipped_ratio;
    out["topology"] = json_of(*topology);
    for (const ThresholdScore& s : m.scores)
        out["scores"].push_back({{"threshold_m", s.threshold_m},
                                 {"precision", s.precision},
                                 {"completeness_ratio", s.completeness_ratio},
                                 {"f_score", s.f_score}});
    if (o.json) {
        std::printf("%s\n", out.dump().c_str());
        return kDone;
    }
    std::printf("accuracy      mean %.3f mm  median %.3f  rms %.3f  p99 %.3f\n", 1e3 * m.accuracy.mean_m,
                1e3 * m.accuracy.median_m, 1e3 * m.accuracy.rms_m, 1e3 * m.accuracy.p99_m);
    std::printf("completeness  mean %.3f mm  median %.3f  rms %.3f  p99 %.3f\n", 1e3 * m.completeness.mean_m,
                1e3 * m.completeness.median_m, 1e3 * m.completeness.rms_m, 1e3 * m.completeness.p99_m);
    for (const ThresholdScore& s : m.scores)
        std::printf("within %g mm  precision %.2f %%  completeness %.2f %%  F-score %.2f %%\n",
                    1e3 * s.threshold_m, 100 * s.precision, 100 * s.completeness_ratio, 100 * s.f_score);
    std::printf("normals       consistency %.4f  flipped %.3f %%\n", m.normal_consistency,
                100 * m.flipped_ratio);
    std::printf("mesh          %lld vertices, %lld triangles, %.3f m2, %s\n",
                static_cast<long long>(topology->vertices), static_cast<long long>(topology->triangles),
                topology->area_m2, topology->clean() ? "clean" : "NOT clean (see --json)");
    return kDone;
}

// ------------------------------------------------------------------------------------------------------ eval
// depth

struct DepthEvalOptions {
    std::string mesh, dataset, format, frames;
    double min_depth_m = 0.2, max_depth_m = 4;
    std::vector<double> thresholds = {0.005, 0.01, 0.02, 0.05};
    int step = 4;
    unsigned threads = std::max(1u, std::thread::hardware_concurrency());
    bool json = false;
};

int run_depth(const DepthEvalOptions& o) {
    int begin = 0, end = 1000000000;
    if (!o.frames.empty() && !parse_range(o.frames, &begin, &end))
        return complain(kBadInput, "--frames: '" + o.frames + "', expected A:B with A < B");
    const auto mesh = read_ply(o.mesh);
    if (!mesh.ok()) return complain_input(mesh.status());
    const auto dataset = open_dataset(o.dataset, o.format);
    if (!dataset.ok()) return complain_input(dataset.status());
    Jobs jobs(static_cast<int>(o.threads));
    const auto bvh = TriangleBvh::build(*mesh, jobs);
    if (!bvh.ok()) return complain(kBadInput, o.mesh + ": " + bvh.status().text());
    FramePrefetcher prefetcher(**dataset, begin, end, 4, 1);
    std::vector<double> all;
    Frame frame;
    for (;;) {
        const Result<bool> got = prefetcher.next(&frame);
        if (!got.ok()) return complain_input(got.status());
        if (!*got) break;
        if (!frame.has_pose) continue;
        const Camera& c = frame.depth_camera;
        std::vector<std::vector<double>> rows(static_cast<std::size_t>((c.height + o.step - 1) / o.step));
        jobs.run(static_cast<int>(rows.size()), [&](int row, int) {
            const int y = row * o.step;
            for (int x = 0; x < c.width; x += o.step) {
                double z = frame.depth_u16.empty() ? frame.depth_f32.view().at(x, y)
                                                   : frame.depth_u16.view().at(x, y);
                if (!frame.depth_u16.empty() && z == 65535) continue;
                z *= frame.depth_unit_m;
                if (!(z >= o.min_depth_m && z <= o.max_depth_m)) continue;
                const Vec3d p = frame.T_world_camera *
                                (unproject(c, {static_cast<double>(x), static_cast<double>(y)}) * z);
                rows[static_cast<std::size_t>(row)].push_back(bvh->closest(p).distance_m);
            }
        });
        for (const auto& row : rows) all.insert(all.end(), row.begin(), row.end());
    }
    if (all.empty())
        return complain(kBadInput, o.dataset + ": no depth between the limits in frames with a pose");
    const ErrorStats stats = error_stats(all);
    nlohmann::json out = {
        {"pixels", all.size()}, {"median_m", stats.median}, {"mean_m", stats.mean}, {"rms_m", stats.rmse}};
    for (const double t : o.thresholds) {
        const auto within = std::count_if(all.begin(), all.end(), [t](double d) { return d <= t; });
        out["shares"].push_back(
            {{"threshold_m", t}, {"share", static_cast<double>(within) / static_cast<double>(all.size())}});
    }
    if (o.json) {
        std::printf("%s\n", out.dump().c_str());
        return kDone;
    }
    std::printf("%zu depth pixels to the mesh: median %.3f mm  mean %.3f  rms %.3f\n", all.size(),
                1e3 * stats.median, 1e3 * stats.mean, 1e3 * stats.rmse);
    for (const auto& share : out["shares"])
        std::printf("within %g mm  %.2f %%\n", 1e3 * share["threshold_m"].get<double>(),
                    100 * share["share"].get<double>());
    return kDone;
}

}  // namespace

void add_eval(CLI::App& app, int* exit) {
    auto* command = app.add_subcommand("eval", "Measure results against the truth");
    command->require_subcommand(1);

    auto* trajectory =
        command->add_subcommand("trajectory", "ATE and RPE of a TUM trajectory (TUM benchmark conventions)");
    auto t = std::make_shared<TrajectoryOptions>();
    trajectory->add_option("estimate", t->estimate, "TUM trajectory")->required();
    trajectory->add_option("truth", t->truth, "TUM trajectory")->required();
    trajectory->add_option("--align", t->align, "se3, sim3 or none")
        ->check(CLI::IsMember({"se3", "sim3", "none"}))
        ->capture_default_str();
    trajectory->add_option("--delta", t->delta_s, "seconds of the relative pose error")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    trajectory->add_flag("--json", t->json, "one JSON object");
    trajectory->callback([t, exit] { *exit = run_trajectory(*t); });

    auto* mesh = command->add_subcommand("mesh", "Accuracy, completeness and F-score of a mesh (PLY)");
    auto m = std::make_shared<MeshEvalOptions>();
    mesh->add_option("estimate", m->estimate, "PLY")->required();
    mesh->add_option("truth", m->truth, "PLY of the true surface");
    mesh->add_option("--scene", m->scene,
                     "measure against this analytic scene instead, where some frame saw it");
    mesh->add_option("--dataset", m->dataset,
                     "with --scene: the rendered sequence (its seed and its cameras)");
    mesh->add_option("--seed", m->seed, "with --scene and no --dataset: the scene's seed")
        ->capture_default_str();
    mesh->add_option("--frames", m->frames, "with --scene: A:B, only what frames A..B-1 saw");
    mesh->add_option("--min-depth", m->min_depth_m, "with --scene: nearer surface was not seen, metres")
        ->capture_default_str();
    mesh->add_option("--max-depth", m->max_depth_m, "with --scene: farther surface was not seen, metres")
        ->capture_default_str();
    mesh->add_option("--threshold", m->thresholds,
                     "distances for precision, completeness ratio and F-score, metres")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    mesh->add_option("--samples", m->samples, "points on each surface")
        ->check(CLI::Range(1000, 20000000))
        ->capture_default_str();
    mesh->add_option("--threads", m->threads, "worker threads")->capture_default_str();
    mesh->add_flag("--json", m->json, "one JSON object");
    mesh->callback([m, exit] { *exit = run_mesh(*m); });

    auto* depth = command->add_subcommand("depth", "Distances of a sequence's depth pixels to a mesh (PLY)");
    auto d = std::make_shared<DepthEvalOptions>();
    depth->add_option("mesh", d->mesh, "PLY")->required();
    depth->add_option("dataset", d->dataset, "sequence with poses")->required();
    depth->add_option("--format", d->format, "layout of the data set");
    depth->add_option("--frames", d->frames, "A:B, only frames A..B-1");
    depth->add_option("--min-depth", d->min_depth_m, "metres")->capture_default_str();
    depth->add_option("--max-depth", d->max_depth_m, "metres")->capture_default_str();
    depth->add_option("--threshold", d->thresholds, "metres")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    depth->add_option("--step", d->step, "every so many pixels each way")
        ->check(CLI::Range(1, 64))
        ->capture_default_str();
    depth->add_option("--threads", d->threads, "worker threads")->capture_default_str();
    depth->add_flag("--json", d->json, "one JSON object");
    depth->callback([d, exit] { *exit = run_depth(*d); });
    add_eval_planes(*command, exit);
}

}  // namespace burin::cli
