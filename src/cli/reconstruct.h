// SPDX-License-Identifier: MIT
// What fuse and scan share: frames in, one by one; mesh, map and report out.
#pragma once

#include <functional>

#include "cli/common.h"
#include "cli/feed.h"
#include "core/trajectory.h"

namespace burin::cli {

struct ReconstructOptions {
    FeedOptions feed;
    std::string output, frames, mesh_name = "mesh.ply", resume, store;
    bool store_resume = false;
    int store_commit = 0;
    MapOptions map;
    MeshFlags mesh;
    bool json = false, quiet = false, stream_mesh = false;
    void add_to(CLI::App& app);
};

struct Totals {
    int frames = 0, fused = 0, without_pose = 0, full_frames = 0;
    int tracked = 0, weak = 0, lost = 0, relocalised = 0;
    std::uint64_t dropped = 0;
    std::uint32_t store_flags = 0;
    std::vector<double> depth_ms, track_ms, integrate_ms, mesh_ms, planes_ms;
    std::vector<double> latency_ms;  // of a sensor: from a frame's last byte until it was taken in
    std::vector<double> frame_ms,
        wait_ms;            // all that is done for a frame; of that, waiting for it to be decoded
    Trajectory trajectory;  // of scan: the frames that have a pose

    // Of one frame that was fused.
    void add(const burin_frame_result& result);
};

// Hands one frame to the map. May be called with frames that have no pose. `beside`: what may be done
// meanwhile, the next frame and chunks to be meshed, null when nothing may; one that does so sets meshed.
// *note: a word for the progress line.
using TakeFrame = std::function<burin_status(const FeedFrame& frame, burin_map map, burin_beside* beside,
                                             Totals* totals, std::string* note)>;

// Runs the whole command: `name` for the progress line, `take` for every frame, `report` may add to
// report.json, and `finish` writes what else belongs in the output folder. Returns the exit code.
struct ReconstructSteps {
    const char* name;
    TakeFrame take;
    std::function<void(const Totals& totals, nlohmann::json* report)> report;
    std::function<Status(const Totals& totals)> finish;
    bool scans = false;  // takes sensors, and works beside
};
int reconstruct(ReconstructOptions& options, const ReconstructSteps& steps);

}  // namespace burin::cli
