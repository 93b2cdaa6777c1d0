// SPDX-License-Identifier: MIT
// The roof over integration: what this machine's memory and arithmetic allow, what the frames ask of them,
// what integration takes, and where the rest goes. All in one run, since machines that are shared change by
// the minute, on one thread and in processor time, which neighbours do not lengthen.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "api/c_frame.h"
#include "roofline/machine.h"
#include "roofline/stages.h"
#include "support/frames.h"

namespace {

using burin::Frame;
using burin::Status;
using burin::bench::StageTimes;
using Json = nlohmann::ordered_json;

// A fused chunk's geometry is 2 KiB, read and written.
constexpr double kBytesPerChunk = 4096;
// Float operations a voxel, counted in the formulas of simd/tsdf.h: 3 additions, a division, 2 products, 2
// sums, 5 clamps, 2 for the depth in metres, a difference, a product, a clamp, 2 comparisons (observe); 2
// products, 4 conversions, a division, a difference, a sum (fuse).
constexpr double kOperationsPerVoxel = 28;

struct Options {
    burin::bench::FrameRange range;
    std::string frames, json_file;
    std::vector<float> voxels = {0.01f, 0.005f};
    float truncation_voxels = 4;
    int warm = 10, passes = 3, repeats = 3;
    bool machine_only = false;
};

double median(std::vector<double> values) {
    if (values.empty()) return 0;
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                     values.end());
    return values[values.size() / 2];
}

// For each frame the least time over the passes, each from an empty map, through the C interface.
struct Timed {
    std::vector<double> ms, fused;
};
Status time_frames(const std::vector<Frame>& frames, const burin_config& config, int passes, bool cold,
                   Timed* out) {
    out->ms.assign(frames.size(), 1e30);
    out->fused.assign(frames.size(), 0);
    for (int pass = 0; pass < passes; ++pass) {
        burin::bench::BenchMap map;
        BURIN_TRY(map.create(config));
        for (std::size_t i = 0; i < frames.size(); ++i) {
            const burin_frame in = burin::c_frame(frames[i]);
            burin_frame_result result;
            if (cold) burin::bench::evict_caches();
            const double start = burin::bench::cpu_ms();
            if (const burin_status s = burin_integrate(map.get(), &in, &result); s != BURIN_OK)
                return Status::error(static_cast<burin::Code>(s), "%s", burin_last_error(map.get()));
            out->ms[i] = std::min(out->ms[i], burin::bench::cpu_ms() - start);
            out->fused[i] = result.chunks_fused;
        }
    }
    return {};
}

double median_after(const std::vector<double>& values, int warm) {
    return median({values.begin() + std::min<std::ptrdiff_t>(warm, std::ssize(values) - 1), values.end()});
}

Json stages_json(const std::vector<StageTimes>& times, int warm) {
    using burin::IntegrationTimes;
    const auto of = [&](auto member) {
        std::vector<double> values;
        for (const StageTimes& t : times) values.push_back(static_cast<double>(t.integrate.*member));
        return median_after(values, warm);
    };
    std::vector<double> depth;
    for (const StageTimes& t : times) depth.push_back(t.depth);
    return {{"depth", median_after(depth, warm)},      {"mark", of(&IntegrationTimes::mark)},
            {"choose", of(&IntegrationTimes::choose)}, {"test", of(&IntegrationTimes::test)},
            {"insert", of(&IntegrationTimes::insert)}, {"fuse", of(&IntegrationTimes::fuse)},
            {"carve", of(&IntegrationTimes::carve)},   {"candidates", of(&IntegrationTimes::candidates)},
            {"chosen", of(&IntegrationTimes::chosen)}, {"missing", of(&IntegrationTimes::missing)}};
}

burin::Result<Json> measure(const Options& o, const std::vector<Frame>& frames, float voxel_m,
                            double bandwidth, double operations) {
    burin_config config = burin_config_default();
    config.voxel_m = voxel_m;
    config.truncation_voxels = o.truncation_voxels;
    config.colour = 0;
    config.budget_bytes = std::uint64_t{1} << 30;
    config.max_width = static_cast<std::uint32_t>(frames[0].depth_camera.width);
    config.max_height = static_cast<std::uint32_t>(frames[0].depth_camera.height);
    Timed warm, cold;
    BURIN_TRY(time_frames(frames, config, o.passes, false, &warm));
    BURIN_TRY(time_frames(frames, config, 1, true, &cold));
    const auto stages = burin::bench::time_stages(frames, config, o.repeats);
    if (!stages) return stages.status();

    std::vector<double> ratio;
    for (std::size_t i = 0; i < frames.size(); ++i)
        ratio.push_back(warm.ms[i] / (1e3 * std::max(1.0, warm.fused[i]) * kBytesPerChunk / bandwidth));
    const double chunks = median_after(warm.fused, o.warm), ms = median_after(warm.ms, o.warm);
    return Json{{"voxel_m", voxel_m},
                {"chunks_fused", chunks},
                {"bytes", chunks * kBytesPerChunk},
                {"bandwidth_ms", 1e3 * chunks * kBytesPerChunk / bandwidth},
                {"arithmetic_ms", 1e3 * chunks * 512 * kOperationsPerVoxel / operations},
                {"integrate_ms", ms},
                {"cold_ms", median_after(cold.ms, o.warm)},
                {"ratio", median_after(ratio, o.warm)},
                {"stages_ms", stages_json(*stages, o.warm)}};
}

void print_row(const char* name, double ms, const Json& run) {
    const double total = run["integrate_ms"], chunks = run["chunks_fused"], roof = run["bandwidth_ms"];
    std::printf("  %-34s %8.3f %7.1f %% %9.0f %9.2f\n", name, ms, 100 * ms / total,
                1e6 * ms / std::max(1.0, chunks), ms / roof);
}

void print(const Json& run) {
    const Json& s = run["stages_ms"];
    std::printf("\nvoxel %g mm: %.0f chunks fused a frame, %.1f MB read and written\n",
                1e3 * double(run["voxel_m"]), double(run["chunks_fused"]), 1e-6 * double(run["bytes"]));
    std::printf("  %-34s %8s %9s %9s %9s\n", "", "ms", "share", "ns/chunk", "x memory");
    print_row("memory roof: bandwidth alone", run["bandwidth_ms"], run);
    print_row("arithmetic roof: operations alone", run["arithmetic_ms"], run);
    print_row("integration (depth to map)", run["integrate_ms"], run);
    print_row("  depth: convert, pad, tiles", s["depth"], run);
    print_row("  mark the band", s["mark"], run);
    print_row("  choose chunks, find in the hash", s["choose"], run);
    print_row("  distances of chunks not in the map", s["test"], run);
    print_row("  insert", s["insert"], run);
    print_row("  distances and averages", s["fuse"], run);
    print_row("  carve", s["carve"], run);
    double sum = 0;
    for (const char* part : {"depth", "mark", "choose", "test", "insert", "fuse", "carve"})
        sum += double(s[part]);
    print_row("  not accounted for", double(run["integrate_ms"]) - sum, run);
    print_row("integration, caches emptied before", run["cold_ms"], run);
    std::printf("  %.0f candidates, %.0f in reach, of them %.0f not in the map\n", double(s["candidates"]),
                double(s["chosen"]), double(s["missing"]));
    std::printf("  integration takes %.2f times the bandwidth time (median over frames)\n",
                double(run["ratio"]));
}

Status run(const Options& o, Json* report) {
    const double operations = burin::bench::float_operations_per_second();
    double bandwidth = burin::bench::inplace_bytes_per_second();
    if (o.machine_only) {
        *report = {{"bandwidth_bytes_per_s", bandwidth}, {"operations_per_s", operations}};
        return {};
    }
    const auto frames = burin::bench::load_frames(o.range, nullptr);
    if (!frames) return frames.status();
    Json runs = Json::array();
    for (const float voxel_m : o.voxels) {
        // The best that was seen so far: the roof is what the machine can do, not what its neighbours left.
        bandwidth = std::max(bandwidth, burin::bench::inplace_bytes_per_second());
        auto one = measure(o, *frames, voxel_m, bandwidth, operations);
        if (!one) return one.status();
        runs.push_back(*one);
    }
    *report = {{"dataset", o.range.dataset},
               {"simd", burin_simd_name()},
               {"bandwidth_bytes_per_s", bandwidth},
               {"operations_per_s", operations},
               {"runs", runs}};
    std::printf(
        "memory, in place, one thread: %.1f GB/s read + written; arithmetic: %.1f G operations/s (%s)\n",
        1e-9 * bandwidth, 1e-9 * operations, burin_simd_name());
    for (const Json& one : runs) print(one);
    return {};
}

}  // namespace

int main(int argc, char** argv) {
    Options o;
    CLI::App app{"Measures memory and arithmetic, and integration against both"};
    app.add_option("dataset", o.range.dataset, "folder of the data set");
    app.add_option("--format", o.range.format, "format of the data set, recognised by default");
    app.add_option("--frames", o.frames, "A:B, half open");
    app.add_option("--voxel", o.voxels, "metres; may be repeated");
    app.add_option("--truncation", o.truncation_voxels, "in voxels");
    app.add_option("--warm", o.warm, "first frames left out of the medians");
    app.add_option("--passes", o.passes, "times over the frames")->check(CLI::Range(1, 100));
    app.add_option("--repeats", o.repeats, "of every stage")->check(CLI::Range(1, 100));
    app.add_option("--json", o.json_file, "write the figures to this file");
    app.add_flag("--machine", o.machine_only, "bandwidth and arithmetic only");
    CLI11_PARSE(app, argc, argv);
    if ((o.range.dataset.empty() && !o.machine_only) ||
        (!o.frames.empty() && !burin::bench::parse_range(o.frames, &o.range))) {
        std::fprintf(stderr, "roofline: expected a data set, and --frames A:B with A < B\n");
        return 2;
    }
    Json report;
    if (const Status status = run(o, &report); !status.ok()) {
        std::fprintf(stderr, "roofline: %s\n", status.text());
        return 1;
    }
    if (o.json_file.empty() && o.machine_only) std::printf("%s\n", report.dump().c_str());
    if (o.json_file.empty()) return 0;
    std::FILE* file = std::fopen(o.json_file.c_str(), "w");
    if (!file || std::fprintf(file, "%s\n", report.dump(2).c_str()) < 0 || std::fclose(file) != 0) {
        std::fprintf(stderr, "roofline: %s: cannot be written\n", o.json_file.c_str());
        return 1;
    }
    return 0;
}
