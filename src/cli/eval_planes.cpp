// SPDX-License-Identifier: MIT
// burin eval planes: found planes, and the meshes they changed, against a rendered scene's truth.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>

#include "cli/common.h"
#include "core/jobs.h"
#include "datasets/open.h"
#include "datasets/synthetic/scene.h"
#include "datasets/trajectory_file.h"
#include "eval/plane_metrics.h"
#include "eval/plane_objects.h"
#include "eval/plane_surface.h"
#include "export/ply.h"

namespace burin::cli {
namespace {

struct PlanesEvalOptions {
    std::string estimate, truth;
    PlaneMatchOptions match;
    double voxel_m = 0.005;
    unsigned threads = std::max(1u, std::thread::hardware_concurrency());
    bool json = false, verbose = false;
};

// planes.json of a folder (or of its truth/), or the file itself.
std::string planes_file(const std::string& path) {
    for (const char* name : {"/truth/planes.json", "/planes.json"})
        if (std::filesystem::is_regular_file(path + name)) return path + name;
    return std::filesystem::is_directory(path) ? path + "/planes.json" : path;
}

nlohmann::json json_of(const PlaneFault& fault, const std::vector<LabelledPlane>& own,
                       const std::vector<LabelledPlane>& others, int other) {
    const LabelledPlane& plane = own[static_cast<std::size_t>(fault.plane)];
    nlohmann::json out = {{"id", plane.id},
                          {"label", label_name(plane.label)},
                          {"area_m2", plane.area_m2},
                          {"seen_area_m2", plane.seen_area_m2},
                          {"normal", {plane.normal.x, plane.normal.y, plane.normal.z}},
                          {"offset", plane.offset},
                          {"reason", fault.reason}};
    if (other >= 0)
        out["best"] = {{"id", others[static_cast<std::size_t>(other)].id},
                       {"overlap_m2", fault.best.overlap_m2},
                       {"angle_deg", fault.best.angle_deg},
                       {"offset_m", fault.best.offset_m}};
    return out;
}

nlohmann::json json_of(const PlaneMatches& m, const std::vector<LabelledPlane>& found,
                       const std::vector<LabelledPlane>& truth) {
    nlohmann::json out = {{"true_planes", m.true_planes},
                          {"found_planes", m.found_planes},
                          {"recall", m.recall},
                          {"precision", m.precision},
                          {"median_angle_deg", m.median_angle_deg},
                          {"worst_angle_deg", m.worst_angle_deg},
                          {"median_offset_m", m.median_offset_m},
                          {"worst_offset_m", m.worst_offset_m},
                          {"split", m.split},
                          {"missed", nlohmann::json::array()},
                          {"false", nlohmann::json::array()}};
    for (const PlaneFault& f : m.missed) out["missed"].push_back(json_of(f, truth, found, f.best.found));
    for (const PlaneFault& f : m.invented) out["false"].push_back(json_of(f, found, truth, f.best.truth));
    return out;
}

void print(const char* what, const PlaneFault& fault, const std::vector<LabelledPlane>& own,
           const std::vector<LabelledPlane>& others, int other) {
    const LabelledPlane& p = own[static_cast<std::size_t>(fault.plane)];
    std::printf("  %-6s %4d  %-7s  %8.3f m2  n (%6.3f %6.3f %6.3f) d %8.4f  %s", what, p.id,
                label_name(p.label), p.seen_area_m2 > 0 ? p.seen_area_m2 : p.area_m2, p.normal.x, p.normal.y,
                p.normal.z, p.offset, fault.reason);
    if (other >= 0)
        std::printf(": best %d, overlap %.3f m2, %.2f deg, %.2f mm",
                    others[static_cast<std::size_t>(other)].id, fault.best.overlap_m2, fault.best.angle_deg,
                    1e3 * fault.best.offset_m);
    std::printf("\n");
}

void print(const PlaneMatches& m, const std::vector<LabelledPlane>& found,
           const std::vector<LabelledPlane>& truth, bool verbose) {
    std::printf("planes      recall %.2f %% of %d  precision %.2f %% of %d  split %d\n", 100 * m.recall,
                m.true_planes, 100 * m.precision, m.found_planes, m.split);
    std::printf("            normal median %.3f deg, worst %.3f  offset median %.3f mm, worst %.3f\n",
                m.median_angle_deg, m.worst_angle_deg, 1e3 * m.median_offset_m, 1e3 * m.worst_offset_m);
    for (const PlaneFault& f : m.missed) print("missed", f, truth, found, f.best.found);
    for (const PlaneFault& f : m.invented) print("false", f, found, truth, f.best.truth);
    if (!verbose) return;
    for (const PlanePair& p : m.pairs) {
        const LabelledPlane &t = truth[static_cast<std::size_t>(p.truth)],
                            &f = found[static_cast<std::size_t>(p.found)];
        std::printf(
            "  pair   %4d  %-7s  %8.3f m2  n (%6.3f %6.3f %6.3f) d %8.4f  found %d, %s, "
            "%.3f m2, overlap %.3f m2, %.3f deg, %.2f mm\n",
            t.id, label_name(t.label), t.seen_area_m2, t.normal.x, t.normal.y, t.normal.z, t.offset, f.id,
            label_name(f.label), f.area_m2, p.overlap_m2, p.angle_deg, 1e3 * p.offset_m);
    }
}

nlohmann::json json_of(const CompletionFigures& c) {
    return {{"open_m2", c.open_m2},
            {"missing_m2", c.missing_m2},
            {"closed_m2", c.closed_m2},
            {"holes_m2", c.holes_m2},
            {"closed_holes_m2", c.closed_holes_m2},
            {"filled_m2", c.filled_m2},
            {"hidden_m2", c.hidden_m2},
            {"false_m2", c.false_m2}};
}

nlohmann::json json_of(const FlatnessFigures& f) {
    return {{"plane_vertices", f.plane_vertices},
            {"plane_rms_m", f.plane_rms_m},
            {"other_vertices", f.other_vertices},
            {"other_mean_m", f.other_mean_m}};
}

// Share in per cent; of nothing, 0.
double percent(double part, double whole) { return whole > 0 ? 100 * part / whole : 0; }

void print(const char* what, const FlatnessFigures& f) {
    std::printf("%-10s  planes rms %.4f mm of %lld vertices  else mean %.4f mm of %lld\n", what,
                1e3 * f.plane_rms_m, static_cast<long long>(f.plane_vertices), 1e3 * f.other_mean_m,
                static_cast<long long>(f.other_vertices));
}

void print(const CompletionFigures& c) {
    std::printf("completion  holes %.4f m2, closed %.2f %%  missing %.4f of %.3f m2, closed %.2f %%\n",
                c.holes_m2, percent(c.closed_holes_m2, c.holes_m2), c.missing_m2, c.open_m2,
                percent(c.closed_m2, c.missing_m2));
    std::printf("            filled %.4f m2, hidden %.4f, false %.4f (%.3f %%)\n", c.filled_m2, c.hidden_m2,
                c.false_m2, percent(c.false_m2, c.filled_m2));
}

constexpr std::uint8_t kJudgedLabels[] = {2, 1, 3, 4};  // floor wall ceiling table: what the issue names

nlohmann::json json_of(const LabelFigures& l) {
    nlohmann::json out;
    for (const std::uint8_t label : kJudgedLabels)
        out[label_name(label)] = {{"recall", LabelFigures::recall(l.surface_m2, label)},
                                  {"precision", LabelFigures::precision(l.surface_m2, label)},
                                  {"plane_recall", LabelFigures::recall(l.plane_m2, label)},
                                  {"plane_precision", LabelFigures::precision(l.plane_m2, label)}};
    out["surface_m2"] = l.surface_m2;
    out["plane_m2"] = l.plane_m2;
    return out;
}

void print(const LabelFigures& l) {
    for (const std::uint8_t label : kJudgedLabels) {
        double area = 0, on_planes = 0;
        for (const double a : l.surface_m2[label]) area += a;
        for (const double a : l.plane_m2[label]) on_planes += a;
        std::printf(
            "%-10s  on planes %.3f m2, right %.2f %%, precision %.2f %%  all %.3f m2, right %.2f %%, "
            "precision %.2f %%\n",
            label_name(label), on_planes, 100 * LabelFigures::recall(l.plane_m2, label),
            100 * LabelFigures::precision(l.plane_m2, label), area,
            100 * LabelFigures::recall(l.surface_m2, label),
            100 * LabelFigures::precision(l.surface_m2, label));
    }
}

// One line a true plane that counts.
void print_planes(const PlaneTruth& truth, double min_area_m2, const FlatnessFigures* raw,
                  const FlatnessFigures& flat, const CompletionFigures& c) {
    std::printf("  plane  label       open  missing   closed    holes   closed m2   raw mm  flat mm\n");
    for (std::size_t t = 0; t < truth.planes.size(); ++t) {
        const LabelledPlane& p = truth.planes[t];
        if (p.seen_area_m2 < min_area_m2) continue;
        const CompletionFigures& own = c.planes[t];
        std::printf("  %5d  %-7s %8.3f %8.3f %8.3f %8.3f %8.3f    %8.3f %8.3f\n", p.id, label_name(p.label),
                    own.open_m2, own.missing_m2, own.closed_m2, own.holes_m2, own.closed_holes_m2,
                    raw ? 1e3 * raw->rms_m[t] : 0.0, 1e3 * flat.rms_m[t]);
    }
}

// The scene that a sequence was rendered from.
Result<std::unique_ptr<SyntheticScene>> scene_of(const std::string& sequence) {
    const std::string path = sequence + "/truth/scene.json";
    std::ifstream file(path);
    if (!file)
        return Status::error(Code::io, "%s: cannot read (is this a sequence of burin synth?)", path.c_str());
    const auto json = nlohmann::json::parse(file, nullptr, false);
    if (!json.is_object() || !json.contains("scene") || !json["scene"].is_string() ||
        !json.contains("seed") || !json["seed"].is_number_unsigned())
        return Status::error(Code::format, "%s: expected an object with \"scene\" and \"seed\"",
                             path.c_str());
    return make_scene(json["scene"].get<std::string>(), json["seed"].get<std::uint64_t>());
}

// What the meshes of the estimate say; prints unless json.
Status measure_meshes(const PlanesEvalOptions& o, const std::vector<LabelledPlane>& planes, Jobs& jobs,
                      nlohmann::json* json) {
    const std::string mesh_path = o.estimate + "/mesh.ply", raw_path = o.estimate + "/raw.ply";
    if (!std::filesystem::is_regular_file(mesh_path)) return {};
    const auto mesh = read_ply(mesh_path);
    if (!mesh.ok()) return mesh.status();
    Result<TriangleMesh> raw = TriangleMesh{};
    const bool has_raw = std::filesystem::is_regular_file(raw_path);
    if (has_raw) raw = read_ply(raw_path);
    if (!raw.ok()) return raw.status();
    const auto scene = scene_of(o.truth);
    if (!scene.ok()) return scene.status();
    PlaneTruth truth;
    truth.planes = planes;
    truth.distance_m = [&](Vec3d p) { return (*scene)->distance(p); };
    truth.surface_distance_m = [&](Vec3d p) { return (*scene)->surface_distance(p); };
    truth.label = [&](Vec3d p) { return (*scene)->label(p); };
    TrueExtentOptions grid;
    grid.voxel_m = o.voxel_m;
    grid.min_area_m2 = o.match.min_area_m2;
    const TrueExtents extents(truth, grid, jobs);
    const PlaneSurfaceOptions options;

    FlatnessFigures before;
    if (has_raw) before = measure_flatness(*raw, truth, extents, options, jobs);
    const FlatnessFigures after = measure_flatness(*mesh, truth, extents, options, jobs);
    const CompletionFigures closed =
        measure_completion(has_raw ? *raw : *mesh, *mesh, truth, extents, options, jobs);
    const LabelFigures labels = measure_labels(*mesh, truth, extents, jobs);
    if (has_raw) (*json)["raw"] = json_of(before);
    (*json)["flattened"] = json_of(after);
    (*json)["completion"] = json_of(closed);
    if (!mesh->labels.empty()) (*json)["labels"] = json_of(labels);
    if (o.json) return {};
    if (has_raw) print("raw", before);
    print("flattened", after);
    if (has_raw)
        std::printf("            planes rms %.2f of raw, else mean %+.2f %%\n",
                    before.plane_rms_m > 0 ? after.plane_rms_m / before.plane_rms_m : 0.0,
                    percent(after.other_mean_m - before.other_mean_m, before.other_mean_m));
    print(closed);
    if (!mesh->labels.empty()) print(labels);
    if (o.verbose) print_planes(truth, grid.min_area_m2, has_raw ? &before : nullptr, after, closed);
    return {};
}

// Objects against the things that the sequence's cameras saw.
Status measure_objects(const PlanesEvalOptions& o, Jobs& jobs, nlohmann::json* json) {
    const std::string path = o.estimate + "/objects.json";
    if (!std::filesystem::is_regular_file(path)) return {};
    const auto found = read_objects(path);
    if (!found.ok()) return found.status();
    const auto scene = scene_of(o.truth);
    if (!scene.ok()) return scene.status();
    const auto poses = read_tum_trajectory(o.truth + "/groundtruth.txt");
    if (!poses.ok()) return poses.status();
    const auto dataset = open_dataset(o.truth, "");
    if (!dataset.ok()) return dataset.status();
    Frame first;
    BURIN_TRY((*dataset)->load(0, &first));
    const auto truth = true_objects(**scene, first.depth_camera, *poses, {}, jobs);
    if (!truth.ok()) return truth.status();
    constexpr double kMinIou = 0.5;
    const ObjectMatches m = match_objects(*found, *truth, kMinIou);
    (*json)["objects"] = {{"true", truth->size()},     {"found", found->size()},
                          {"recall", m.recall},        {"precision", m.precision},
                          {"missed", m.missed.size()}, {"false", m.invented.size()}};
    if (o.json) return {};
    std::printf("objects     recall %.2f %% of %zu  precision %.2f %% of %zu\n", 100 * m.recall,
                truth->size(), 100 * m.precision, found->size());
    if (!o.verbose) return {};
    const auto line = [&](const char* what, const ObjectMatches::Pair& p) {
        for (const auto& [list, index] : {std::pair{&*truth, p.truth}, std::pair{&*found, p.found}}) {
            if (index < 0) continue;
            const ObjectBounds& b = (*list)[static_cast<std::size_t>(index)];
            std::printf("  %-6s %-5s %4d  (%.3f %.3f %.3f) to (%.3f %.3f %.3f)  IoU %.3f  %s\n", what,
                        list == &*truth ? "true" : "found", b.id, b.low.x, b.low.y, b.low.z, b.high.x,
                        b.high.y, b.high.z, p.iou, b.name.c_str());
        }
    };
    for (const auto& p : m.pairs) line("pair", p);
    for (const auto& p : m.missed) line("missed", p);
    for (const auto& p : m.invented) line("false", p);
    return {};
}

int run_planes(const PlanesEvalOptions& o) {
    const auto found = read_planes(planes_file(o.estimate));
    if (!found.ok()) return complain_input(found.status());
    const auto truth = read_planes(planes_file(o.truth));
    if (!truth.ok()) return complain_input(truth.status());
    const PlaneMatches matches = match_planes(*found, *truth, o.match);
    nlohmann::json out = {{"planes", json_of(matches, *found, *truth)}};
    if (!o.json) print(matches, *found, *truth, o.verbose);
    Jobs jobs(static_cast<int>(o.threads));
    if (std::filesystem::is_directory(o.estimate) && std::filesystem::is_directory(o.truth)) {
        if (const Status status = measure_meshes(o, *truth, jobs, &out); !status.ok())
            return complain_input(status);
        if (const Status status = measure_objects(o, jobs, &out); !status.ok()) return complain_input(status);
    }
    if (o.json) std::printf("%s\n", out.dump().c_str());
    return kDone;
}

}  // namespace

void add_eval_planes(CLI::App& eval, int* exit) {
    auto* planes = eval.add_subcommand("planes", "Planes, and meshes flattened and completed by them");
    auto p = std::make_shared<PlanesEvalOptions>();
    planes->add_option("estimate", p->estimate, "folder with planes.json, mesh.ply, raw.ply; or planes.json")
        ->required();
    planes->add_option("truth", p->truth, "sequence of burin synth, or planes.json")->required();
    planes->add_option("--min-area", p->match.min_area_m2, "smaller planes are not counted, m^2")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    planes->add_option("--max-angle", p->match.max_angle_deg, "between normals of a match, degrees")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    planes->add_option("--max-offset", p->match.max_offset_m, "between planes of a match, metres")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    planes->add_option("--voxel", p->voxel_m, "of the map that the meshes are of, metres")
        ->check(CLI::Range(0.002, 0.1))
        ->capture_default_str();
    planes->add_option("--threads", p->threads, "worker threads")->capture_default_str();
    planes->add_flag("--verbose", p->verbose, "one line a plane");
    planes->add_flag("--json", p->json, "one JSON object");
    planes->callback([p, exit] { *exit = run_planes(*p); });
}

}  // namespace burin::cli
