// SPDX-License-Identifier: MIT
// burin eval planes: found planes, and the meshes they changed, against a rendered scene's truth.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "cli/common.h"
#include "eval/plane_metrics.h"

namespace burin::cli {
namespace {

struct PlanesEvalOptions {
    std::string estimate, truth;
    PlaneMatchOptions match;
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

int run_planes(const PlanesEvalOptions& o) {
    const auto found = read_planes(planes_file(o.estimate));
    if (!found.ok()) return complain_input(found.status());
    const auto truth = read_planes(planes_file(o.truth));
    if (!truth.ok()) return complain_input(truth.status());
    const PlaneMatches matches = match_planes(*found, *truth, o.match);
    nlohmann::json out = {{"planes", json_of(matches, *found, *truth)}};
    if (o.json)
        std::printf("%s\n", out.dump().c_str());
    else
        print(matches, *found, *truth, o.verbose);
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
    planes->add_flag("--verbose", p->verbose, "one line a plane");
    planes->add_flag("--json", p->json, "one JSON object");
    planes->callback([p, exit] { *exit = run_planes(*p); });
}

}  // namespace burin::cli
