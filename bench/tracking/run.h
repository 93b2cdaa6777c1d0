// SPDX-License-Identifier: MIT
// One sequence through the session, every frame's outcome kept beside the truth.
#pragma once

#include <string>
#include <vector>

#include "api/config.h"
#include "session/fusion_session.h"
#include "tracking/disturb.h"

namespace burin::bench {

struct RunOptions {
    burin_config config;
    TrackingOptions tracking;
    Disturbance disturbance;
    int first = 0, last = 1 << 30, threads = 2;
    bool back = false;     // then the same frames backwards: every place is seen again. Without the IMU
    bool verbose = false;  // a line a frame
    std::string mesh;      // a file for the mesh of the map at the end, none: empty
    // A file for the mesh of the frames that were fused, fused with their true poses: what tracking alone,
    // and not fewer or worse readings, did to the mesh above.
    std::string true_mesh;
};

struct TrackedFrame {
    int index = 0;  // in the data set
    int step = 0;   // in the run: the index, and on the way back it goes on
    std::int64_t t_ns = 0;
    bool has_truth = false;
    Se3 T_true;  // world from camera
    TrackingReport tracking;
    double depth_ms = 0, fuse_ms = 0;
    double scan_cpu_ms = 0;  // depth, tracking and fusion, of all threads
    bool lost() const { return tracking.state == TrackingState::lost; }
    // Of the position, the first pose being true.
    double error_m() const { return norm(tracking.T_world_camera.t - T_true.t); }
};

struct Run {
    std::vector<TrackedFrame> frames;
    int turn = 1 << 30;  // the step at which the way back begins
    bool has_imu = false;
    std::uint32_t chunks = 0;  // in the map at the end
};

Result<Run> track_sequence(const std::string& folder, const RunOptions& options);

}  // namespace burin::bench
