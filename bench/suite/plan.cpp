// SPDX-License-Identifier: MIT
#include "suite/plan.h"

#include <filesystem>

namespace burin::bench {
namespace {

struct Planner {
    const Options& o;
    const std::string &dataset, &frames;
    std::vector<Job> jobs;

    std::vector<std::string> common(const Subject& s) const {
        return {dataset,
                "--voxel",
                s.voxel_mm == 5 ? "0.005" : "0.01",
                "--truncation",
                "4",
                "--max-depth",
                "4",
                "--frames",
                frames,
                "--threads",
                std::to_string(s.threads)};
    }
    void add(Subject s, const std::string& suffix, const std::string& program, std::vector<std::string> flags,
             int most_runs, bool required) {
        s.dataset = std::filesystem::path(dataset).filename().string();
        Job job;
        job.name = s.id() + suffix;
        job.subject = s;
        job.command = common(s);
        job.command.insert(job.command.begin(), o.build + program);
        job.command.insert(job.command.end(), flags.begin(), flags.end());
        if (s.colour) job.command.push_back("--colour");
        job.most_runs = most_runs, job.required = required;
        jobs.push_back(std::move(job));
    }
    // Ours is short, so a run holds several passes, each from an empty map.
    void ours(int voxel_mm, int threads, bool colour, std::vector<std::string> flags,
              const std::string& suffix = "") {
        // Two threads want both processors at once, which a shared machine seldom has: many passes, and as
        // many of one thread, with which they are compared.
        const char* passes = !suffix.empty() ? "1" : voxel_mm == 5 && !colour ? (o.quick ? "10" : "5") : "3";
        flags.insert(flags.end(), {"--passes", passes});
        add({"", "burin", voxel_mm, threads, colour}, suffix, "/bench/pipeline/bench_pipeline", flags, 1000,
            true);
    }
    void theirs(const char* kind, int voxel_mm, int threads, bool mesh, int most_runs, bool required = true) {
        if (!o.open3d) return;
        const std::string program = std::string("open3d_") + kind;
        std::vector<std::string> flags = {"--preload"};
        if (program == "open3d_vbg") flags.push_back("--vbg");
        if (!mesh) flags.push_back("--no-mesh");
        // One reading makes a surface, as in ScalableTSDFVolume, and by default in ours.
        flags.insert(flags.end(), {"--min-weight", "0.5"});
        // The mesh also serves the comparison of surfaces.
        if (mesh && !o.quick) flags.insert(flags.end(), {"-o", peer_mesh(o, dataset, program, voxel_mm)});
        add({"", program, voxel_mm, threads, false}, "", "/bench/peers/open3d_fuse", flags, most_runs,
            required);
        if (!required) jobs.back().first_round = 1;
    }
    void machine() {
        Job job;
        job.name = kMachine;
        job.command = {o.build + "/bench/roofline/bench_roofline", "--machine"};
        jobs.push_back(job);
    }
};

}  // namespace

std::string peer_mesh(const Options& o, const std::string& dataset, const std::string& program,
                      int voxel_mm) {
    return o.results + "/" + std::filesystem::path(dataset).filename().string() + "-" + program + "-" +
           std::to_string(voxel_mm) + "mm.ply";
}

std::vector<Job> plan_jobs(const Options& o, const std::string& dataset, const std::string& frames) {
    Planner p{o, dataset, frames, {}};
    const bool full = !o.quick;
    // Ours and theirs in turn; most wanted first, for when the time is short.
    p.machine();
    p.ours(5, 1, false, {"--mesh"});
    p.theirs("vbg", 5, 1, true, o.rounds);
    p.ours(10, 1, false, full ? std::vector<std::string>{"--mesh"} : std::vector<std::string>{});
    p.theirs("vbg", 10, 1, full, o.rounds);
    p.ours(5, 2, false, {});
    p.theirs("scalable", 5, 1, true, o.rounds);
    p.ours(5, 1, true, {});
    p.theirs("scalable", 10, 1, full, o.rounds);
    p.ours(5, 1, false, {"--mesh-each"}, "-incremental");
    p.ours(5, 2, false, {"--mesh-each"}, "-incremental");
    if (full) {
        p.theirs("vbg", 5, 2, false, 1);
        p.ours(10, 2, false, {});
        p.ours(5, 2, true, {});
        p.ours(5, 2, true, {"--mesh-each"}, "-incremental");
        p.ours(5, 1, true, {"--mesh-each"}, "-incremental");
        p.theirs("scalable", 5, 2, false, 1);
    }
    p.theirs("vbg", 10, 2, false, 1, full);
    p.theirs("scalable", 10, 2, false, 1, full);
    return std::move(p.jobs);
}

}  // namespace burin::bench
