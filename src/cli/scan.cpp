// SPDX-License-Identifier: MIT
// burin scan: depth and colour in, of a recording or a sensor, the camera tracked; trajectory, mesh, map and
// report out.
#include "cli/reconstruct.h"
#include "core/se3.h"
#include "datasets/trajectory_file.h"

namespace burin::cli {
namespace {

struct ScanOptions {
    ReconstructOptions common;
    std::string tracker = "sdf";
    bool no_track_colour = false, no_gyro = false;
};

// The first frame that is fused tells the world, when it has a pose (whose z is up, if the data set's is),
// else it is where its camera is; other poses are not looked at.
burin_status scan_frame(const FeedFrame& frame, burin_map map, burin_beside* beside, Totals* totals,
                        std::string* note) {
    burin_frame in = frame.view;
    if (!frame.has_pose) in.T_world_camera = burin_frame_default().T_world_camera;
    burin_scan_result result;
    const burin_status status = burin_scan_beside(map, &in, beside, &result);
    if (status != BURIN_OK) return status;
    totals->depth_ms.push_back(result.fusion.depth_ms);
    totals->track_ms.push_back(result.track_ms);
    totals->relocalised += result.relocalised != 0;
    if (result.state == BURIN_TRACKING_LOST) {
        ++totals->lost;
        *note = "lost";
        return BURIN_OK;
    }
    const burin_pose& p = result.T_world_camera;
    const Result<Se3> T = se3_from_quaternion({p.tx, p.ty, p.tz}, {p.qx, p.qy, p.qz, p.qw});
    if (T.ok()) totals->trajectory.push_back({frame.view.t_ns, *T});
    if (result.state == BURIN_TRACKING_WEAK) {
        ++totals->weak;
        *note = "weak";
        return BURIN_OK;
    }
    ++totals->tracked;
    *note = "tracking";
    totals->add(result.fusion);
    return BURIN_OK;
}

void finish_options(ScanOptions& o) {
    burin_config& config = o.common.map.config;
    config.tracker = o.tracker == "icp" ? BURIN_TRACKER_ICP : BURIN_TRACKER_SDF;
    config.track_colour = !o.no_track_colour;
    config.track_gyro = !o.no_gyro;
}

}  // namespace

void add_scan(CLI::App& app, int* exit) {
    auto* command = app.add_subcommand("scan",
                                       "Track the camera of a sequence or a sensor and fuse what it sees: "
                                       "trajectory.txt, mesh.ply, planes.json, map.burin, "
                                       "report.json");
    auto o = std::make_shared<ScanOptions>();
    o->common.map.start_from_scan();
    command->add_option("source", o->common.feed.path, "a sequence, or a sensor as burin devices lists them")
        ->required();
    o->common.add_to(*command);
    o->common.feed.source.add_to(*command);
    command
        ->add_option("--seconds", o->common.feed.seconds, "of a sensor: when to stop (otherwise at Ctrl-C)")
        ->group("Sensors")
        ->check(CLI::NonNegativeNumber);
    command
        ->add_option("--record", o->common.feed.record, "of a sensor: a folder for a recording of what comes")
        ->group("Sensors");
    command->add_option("--tracker", o->tracker, "sdf or icp")
        ->check(CLI::IsMember({"sdf", "icp"}))
        ->capture_default_str();
    command->add_flag("--no-track-colour", o->no_track_colour, "track by depth alone");
    command->add_flag("--no-gyro", o->no_gyro, "leave the gyroscope out");
    command->callback([o, exit] {
        finish_options(*o);
        *exit = reconstruct(
            o->common,
            {"scan", scan_frame,
             [](const Totals& t, nlohmann::json* report) {
                 (*report)["tracking"] = {
                     {"ok", t.tracked}, {"weak", t.weak}, {"lost", t.lost}, {"relocalised", t.relocalised}};
             },
             [o](const Totals& t) {
                 return write_tum_trajectory(o->common.output + "/trajectory.txt", t.trajectory);
             },
             true});
    });
}

}  // namespace burin::cli
