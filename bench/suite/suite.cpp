// SPDX-License-Identifier: MIT
// Everything `./dev bench` measures, in one run: Burin and Open3D in turn on the same frames, kernels, the
// roof over integration, memory, and how much of Open3D's surface ours covers. docs/bench.md says what the
// figures mean.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "suite/extras.h"
#include "suite/figures.h"
#include "suite/output.h"
#include "suite/plan.h"

namespace {

using namespace burin::bench;

// Ends within 50 s: what no ratio needs is left out beyond this, and further rounds.
constexpr double kQuickDeadline = 43;

struct Run {
    std::string dataset, name, frames;
    std::vector<Job> jobs;
};

Json entry_of(const Options& o, const Run& run, Json* report) {
    Json entry = {{"frames", run.frames}, {"warm", o.warm}, {"ratios", ratios_of(run.jobs, o.warm)}};
    for (const Job& job : run.jobs) {
        if (job.outputs.empty()) continue;
        const Json figures = figures_of(job, o.warm);
        if (job.name == kMachine)
            (*report)["machine_figures"] = figures;
        else
            entry["jobs"][job.name] = {{"program", job.subject.program},
                                       {"voxel_mm", job.subject.voxel_mm},
                                       {"threads", job.subject.threads},
                                       {"colour", job.subject.colour},
                                       {"figures", figures}};
    }
    if (!o.quick && o.open3d) entry["coverage"] = coverage(o, run.dataset, run.frames);
    return entry;
}

int run(Options& o) {
    if (o.nice != 0 && setpriority(PRIO_PROCESS, 0, o.nice) != 0)
        std::fprintf(stderr, "suite: no right to priority %d: going on without\n", o.nice);
    o.deadline_s = 60 * o.minutes;
    if (o.quick) o.deadline_s = kQuickDeadline - o.spent_s, o.warm = 3, o.rounds = 6;
    Json report = {{"machine", o.machine}, {"commit", o.commit}, {"run", o.quick ? "quick" : "full"}};
    std::vector<Run> runs;
    for (const std::string& dataset : o.datasets) {
        const std::string frames = frames_of(o, dataset);
        runs.push_back({dataset, std::filesystem::path(dataset).filename().string(), frames,
                        plan_jobs(o, dataset, frames)});
    }
    for (int round = 0; round < o.rounds; ++round) {
        bool any = false;
        for (Run& one : runs) {
            bool ran = false;
            std::fprintf(stderr, "%s, frames %s\n", one.name.c_str(), one.frames.c_str());
            if (!run_round(one.jobs, round, o.deadline_s, &ran)) return 1;
            any |= ran;
        }
        if (!any) break;
        if (round > 0) continue;
        // After the first round, so that --quick knows how much time is left for more.
        report["kernels_ns"] = kernels(o);
        if (!roofline(o, runs[0].dataset, runs[0].frames, &report)) return 1;
    }

    std::vector<Json> ratios;
    for (const Run& one : runs) {
        report["datasets"][one.name] = entry_of(o, one, &report);
        ratios.push_back(report["datasets"][one.name]["ratios"]);
    }
    report["ratios"] = worst_of(ratios);
    report["fps_5mm_2threads"] = report["ratios"]["fps_5mm_2threads"];
    if (!o.quick) report["memory"] = memory(o, o.datasets[0]);
    report["seconds"] = seconds_since_start();

    const std::string table = table_of(o, report);
    std::printf("\n%s\n", table.c_str());
    const std::string csv = o.results + "/../../../bench/results/" + o.machine + ".csv";
    std::filesystem::create_directories(std::filesystem::path(csv).parent_path());
    bool written = write_csv(csv, o, report) && write_text(o.results + "/table.md", table) &&
                   write_text(o.results + "/report.json", report.dump(2) + "\n");
    if (!o.json_file.empty()) written = write_text(o.json_file, report.dump(2) + "\n") && written;
    if (!o.quick) written = write_text(csv.substr(0, csv.size() - 3) + "md", table) && written;
    std::printf("figures in bench/results/%s.csv, %s/report.json and table.md (%.0f s)\n", o.machine.c_str(),
                o.results.c_str(), seconds_since_start());
    return written ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
    Options o;
    CLI::App app{"Runs the whole bench; called by ./dev bench"};
    app.add_option("--build", o.build, "build folder")->required();
    app.add_option("--results", o.results, "folder for what is written on the way")->required();
    app.add_option("--machine", o.machine, "name of this machine in the results")->required();
    app.add_option("--commit", o.commit)->required();
    app.add_option("--dataset", o.datasets, "folder; may be repeated")->required();
    app.add_option("--json", o.json_file, "the report");
    app.add_option("--frames", o.frames, "A:B instead of what suits the data set");
    app.add_option("--rounds", o.rounds, "over all programs")->check(CLI::Range(1, 100));
    app.add_option("--minutes", o.minutes, "further rounds end by then, the first does not")
        ->check(CLI::Range(1, 1000));
    app.add_option("--nice", o.nice, "priority for the time of the bench, -20..19");
    app.add_option("--spent", o.spent_s, "seconds that --quick has taken already");
    app.add_flag("--quick", o.quick, "under 50 s: one data set, few frames");
    app.add_flag("--open3d", o.open3d, "Open3D beside it");
    CLI11_PARSE(app, argc, argv);
    return run(o);
}
