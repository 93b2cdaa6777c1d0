// SPDX-License-Identifier: MIT
// burin synth: a rendered sequence with exact truth.
#include <cstdio>
#include <thread>

#include "cli/common.h"
#include "core/jobs.h"
#include "datasets/synthetic/synth.h"
#include "datasets/synthetic/truth_mesh.h"
#include "export/ply.h"

namespace burin::cli {
namespace {

struct Options {
    SynthOptions synth;
    std::string noise = "sensor", size = "640x480";
    unsigned threads = std::max(1u, std::thread::hardware_concurrency());
    int imu_rate = 200;
    bool imu = false, no_truth_images = false, no_truth_mesh = false, json = false, quiet = false;
};

int run(Options& o) {
    if (std::sscanf(o.size.c_str(), "%dx%d", &o.synth.width, &o.synth.height) != 2)
        return complain(kBadInput, "--size: '" + o.size + "', expected WIDTHxHEIGHT");
    o.synth.noise = o.noise == "none" ? SynthNoise::none : SynthNoise::sensor;
    o.synth.truth_images = !o.no_truth_images;
    o.synth.imu_rate_hz = o.imu ? o.imu_rate : 0;
    Jobs jobs(static_cast<int>(o.threads));
    std::unique_ptr<SyntheticScene> scene;
    const auto trajectory = synth_trajectory(o.synth);
    if (!trajectory.ok()) return complain_input(trajectory.status());
    {
        Progress progress("synth", static_cast<int>(trajectory->size()), o.quiet);
        const Status status = synthesise(
            o.synth,
            [&](int done, int) {
                progress.update(done);
                return true;
            },
            jobs, &scene);
        if (!status.ok()) return complain_output(status);
    }
    if (!o.no_truth_mesh) {
        const auto mesh = truth_mesh(*scene, 0, jobs);
        if (!mesh.ok()) return complain_output(mesh.status());
        if (const Status status = write_ply(o.synth.output_dir + "/truth/mesh.ply", *mesh); !status.ok())
            return complain_output(status);
    }
    if (o.json)
        std::printf(
            "%s\n",
            nlohmann::json({{"scene", o.synth.scene}, {"seed", o.synth.seed}, {"frames", trajectory->size()}})
                .dump()
                .c_str());
    else if (!o.quiet)
        std::printf("%s: %zu frames of %s, seed %llu\n", o.synth.output_dir.c_str(), trajectory->size(),
                    o.synth.scene.c_str(), static_cast<unsigned long long>(o.synth.seed));
    return kDone;
}

}  // namespace

void add_synth(CLI::App& app, int* exit) {
    auto* command = app.add_subcommand(
        "synth", "Render a sequence with exact truth (room, desk, corridor, relief, figure)");
    auto o = std::make_shared<Options>();
    command->add_option("scene", o->synth.scene, "room, desk, corridor, relief or figure")->required();
    command
        ->add_option("-o,--output", o->synth.output_dir,
                     "folder for the sequence; must not exist or be empty")
        ->required();
    command
        ->add_option("--frames", o->synth.frames,
                     "number of frames (default: the scene's, or all of the trajectory)")
        ->check(CLI::Range(1, 1000000));
    command->add_option("--seed", o->synth.seed, "moves furniture, textures and lights")
        ->capture_default_str();
    command->add_option("--noise", o->noise, "sensor or none")
        ->check(CLI::IsMember({"sensor", "none"}))
        ->capture_default_str();
    command->add_option("--size", o->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
    command->add_option("--trajectory", o->synth.trajectory_file, "fly this TUM trajectory");
    auto* imu = command->add_flag("--imu", o->imu, "also write the readings of an IMU, imu.txt");
    command->add_option("--imu-rate", o->imu_rate, "its samples a second")
        ->needs(imu)
        ->check(CLI::Range(10, 8000))
        ->capture_default_str();
    command->add_flag("--no-truth-images", o->no_truth_images,
                      "leave out the true depth, normals, albedo and labels");
    command->add_flag("--no-truth-mesh", o->no_truth_mesh, "leave out truth/mesh.ply");
    command->add_option("--threads", o->threads, "worker threads")->capture_default_str();
    command->add_flag("--json", o->json, "print a summary as JSON");
    command->add_flag("--quiet", o->quiet, "print nothing");
    command->callback([o, exit] { *exit = run(*o); });
}

}  // namespace burin::cli
