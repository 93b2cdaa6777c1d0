// SPDX-License-Identifier: MIT
#include "suite/figures.h"

#include <algorithm>
#include <cmath>

namespace burin::bench {
namespace {

constexpr double kBytesPerChunk = 4096;  // 2 KiB of geometry, read and written

using Series = std::vector<double>;  // one value a frame

double median(Series values) {
    if (values.empty()) return std::nan("");
    std::sort(values.begin(), values.end());
    const std::size_t n = values.size();
    return n % 2 ? values[n / 2] : (values[n / 2 - 1] + values[n / 2]) / 2;
}

Series after(const Series& values, int warm) {
    const auto skip = std::min<std::ptrdiff_t>(warm, std::max<std::ptrdiff_t>(0, std::ssize(values) - 1));
    return {values.begin() + skip, values.end()};
}

// A series of every pass of every run; Open3D's program makes one pass a run.
std::vector<Series> all_series(const Job& job, const char* key) {
    std::vector<Series> all;
    for (const Json& output : job.outputs) {
        const Json passes = output.contains("passes") ? output["passes"] : Json::array({output});
        for (const Json& pass : passes)
            if (pass.contains(key) && !pass[key].empty()) all.push_back(pass[key].get<Series>());
    }
    return all;
}

Series least(const std::vector<Series>& all) {
    Series out = all.empty() ? Series{} : all[0];
    for (const Series& one : all)
        for (std::size_t i = 0; i < std::min(out.size(), one.size()); ++i) out[i] = std::min(out[i], one[i]);
    return out;
}

Series plus(const Series& a, const Series& b) {
    Series sum = a;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) sum[i] += b[i];
    return sum;
}

// The last pass of each of the first `runs` runs.
std::vector<Series> one_a_run(const Job& job, const char* key, std::size_t runs) {
    std::vector<Series> some;
    for (std::size_t i = 0; i < std::min(runs, job.outputs.size()); ++i) {
        const Json& output = job.outputs[i];
        const Json pass = output.contains("passes") ? output["passes"].back() : output;
        some.push_back(pass[key].get<Series>());
    }
    return some;
}

double least_value(const Job& job, const char* ours, const char* theirs) {
    double value = std::nan("");
    const auto take = [&](double v) { value = std::isnan(value) || v < value ? v : value; };
    for (const Json& output : job.outputs) {
        if (output.contains(ours))
            for (const double v : output[ours]) take(v);
        if (output.contains(theirs) && output.value("vertices", 0) > 0) take(output[theirs]);
    }
    return value;
}

const Job* find(const std::vector<Job>& jobs, const std::string& name) {
    for (const Job& job : jobs)
        if (job.name == name && !job.outputs.empty()) return &job;
    return nullptr;
}

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

}  // namespace

Json figures_of(const Job& job, int warm) {
    Json out;
    for (const char* key :
         {"decode_ms", "depth_ms", "integrate_ms", "frame_ms", "frame_cpu_ms", "mesh_ms", "mesh_cpu_ms"}) {
        const double value = median(after(least(all_series(job, key)), warm));
        if (std::isfinite(value)) out[key] = value;
    }
    Series plain;
    for (const Series& one : all_series(job, "frame_ms"))
        for (const double ms : after(one, warm)) plain.push_back(ms);
    if (!plain.empty()) out["frame_plain_ms"] = median(plain);
    if (!job.outputs.empty() && job.outputs[0].contains("bandwidth_bytes_per_s"))
        for (const char* key : {"bandwidth_bytes_per_s", "operations_per_s"}) {
            double most = 0;
            for (const Json& output : job.outputs) most = std::max(most, output[key].get<double>());
            out[key] = most;
        }
    const double full = least_value(job, "mesh_full_ms", "extract_ms");
    const double full_cpu = least_value(job, "mesh_full_cpu_ms", "extract_cpu_ms");
    if (std::isfinite(full)) out["mesh_full_ms"] = full, out["mesh_full_cpu_ms"] = full_cpu;
    if (!job.outputs.empty() && job.outputs[0].contains("memory")) {
        const Json& memory = job.outputs[0]["memory"];
        for (const char* key : {"map_bytes_per_m2", "mesh_scratch_bytes_per_vertex"})
            if (memory.contains(key)) out[key] = memory[key];
        out["chunks_fused"] = median(after(job.outputs[0]["chunks"]["fused"].get<Series>(), warm));
    }
    out["runs"] = job.outputs.size();
    return out;
}

Json ratios_of(const std::vector<Job>& jobs, int warm) {
    const auto figure = [&](const std::string& name, const char* key) {
        const Job* job = find(jobs, name);
        if (!job) return std::nan("");
        const Json figures = figures_of(*job, warm);
        return figures.contains(key) ? figures[key].get<double>() : std::nan("");
    };
    const auto cpu = [&](const std::string& name) { return figure(name, "frame_cpu_ms"); };
    // Their runs over as many passes of ours: the least of more would flatter.
    const auto against = [&](const std::string& program, const std::string& voxel) {
        const Job *theirs = find(jobs, program + "-" + voxel + "-1t"),
                  *ours = find(jobs, "burin-" + voxel + "-1t");
        if (!theirs || !ours) return Json(nullptr);
        const std::size_t runs = std::min(theirs->outputs.size(), ours->outputs.size());
        const auto time = [&](const Job& job) {
            return median(after(least(one_a_run(job, "frame_cpu_ms", runs)), warm));
        };
        return number(time(*theirs) / time(*ours));
    };
    Json r;
    r["integrate_10mm_vs_o3d_vbg"] = against("open3d_vbg", "10mm");
    r["integrate_10mm_vs_o3d_legacy"] = against("open3d_scalable", "10mm");
    r["integrate_5mm_vs_o3d_vbg"] = against("open3d_vbg", "5mm");
    r["integrate_5mm_vs_o3d_legacy"] = against("open3d_scalable", "5mm");

    r["integrate_5mm_vs_bandwidth"] = nullptr;
    if (const Job* job = find(jobs, "burin-5mm-1t"); job && find(jobs, kMachine)) {
        const double bytes_per_ms = 1e-3 * figure(kMachine, "bandwidth_bytes_per_s");
        Series ratio = least(all_series(*job, "frame_cpu_ms"));
        const Series fused = job->outputs[0]["chunks"]["fused"];
        for (std::size_t i = 0; i < ratio.size(); ++i)
            ratio[i] /= std::max(1.0, fused[i]) * kBytesPerChunk / bytes_per_ms;
        r["integrate_5mm_vs_bandwidth"] = number(median(after(ratio, warm)));
    }
    r["threads2_vs_1"] = number(figure("burin-5mm-1t", "frame_ms") / figure("burin-5mm-2t", "frame_ms"));
    r["colour_vs_depth"] = number(cpu("burin-5mm-1t-colour") / cpu("burin-5mm-1t"));
    // Against the faster of the two.
    const double theirs = std::fmin(figure("open3d_vbg-5mm-1t", "mesh_full_cpu_ms"),
                                    figure("open3d_scalable-5mm-1t", "mesh_full_cpu_ms"));
    r["mesh_full_vs_o3d"] = number(theirs / figure("burin-5mm-1t", "mesh_full_cpu_ms"));
    const auto incremental = [&](const std::string& name) {
        const std::string job = name + "-incremental";
        return figure(job, "mesh_cpu_ms") / figure(job, "frame_cpu_ms");
    };
    r["mesh_incremental_vs_integrate"] = number(
        std::isnan(incremental("burin-5mm-1t")) ? incremental("burin-5mm-2t") : incremental("burin-5mm-1t"));
    const auto fps = [&](const char* name) {
        const Job* job = find(jobs, name);
        if (!job) return std::nan("");
        // The sum of a frame is least in one and the same pass.
        std::vector<Series> frames = all_series(*job, "frame_ms");
        const std::vector<Series> meshes = all_series(*job, "mesh_ms");
        for (std::size_t i = 0; i < std::min(frames.size(), meshes.size()); ++i)
            frames[i] = plus(frames[i], meshes[i]);
        return 1000 / median(after(least(frames), warm));
    };
    r["fps_5mm_2threads"] = number(fps("burin-5mm-2t-incremental"));
    r["fps_5mm_2threads_colour"] = number(fps("burin-5mm-2t-colour-incremental"));
    return r;
}

Json worst_of(const std::vector<Json>& ratios) {
    Json worst;
    for (const Json& one : ratios)
        for (const auto& [key, value] : one.items()) {
            if (!worst.contains(key) || worst[key].is_null()) worst[key] = value;
            if (value.is_null()) continue;
            const bool small_is_good = key == "integrate_5mm_vs_bandwidth" || key == "colour_vs_depth" ||
                                       key == "mesh_incremental_vs_integrate";
            worst[key] = small_is_good ? std::max(worst[key].get<double>(), value.get<double>())
                                       : std::min(worst[key].get<double>(), value.get<double>());
        }
    return worst;
}

}  // namespace burin::bench
