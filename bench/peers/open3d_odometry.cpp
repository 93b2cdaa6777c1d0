// SPDX-License-Identifier: MIT
// Open3D's RGB-D odometry of the same frames, for comparison: each frame against the one before it
// (ComputeRGBDOdometry, hybrid term of Park et al., "Colored Point Cloud Registration Revisited", ICCV 2017),
// chained from the first true pose. Options are Open3D's defaults. Prints one JSON object.
//
// Timed is what Open3D does with two frames that are ready in its own format; reading, decoding, clipping to
// the depth range, bringing colour to the depth pixels and turning it to brightness are not. When it reports
// failure, the camera counts as having stayed where it was.
#include <open3d/camera/PinholeCameraIntrinsic.h>
#include <open3d/geometry/RGBDImage.h>
#include <open3d/pipelines/odometry/Odometry.h>
#include <open3d/utility/Logging.h>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>

#include "datasets/trajectory_file.h"
#include "eval/trajectory.h"
#include "peers/open3d_frames.h"
#include "support/frames.h"

namespace {

namespace geometry = open3d::geometry;
namespace odometry = open3d::pipelines::odometry;
using burin::Frame;
using burin::Se3;
using burin::Status;
using burin::Trajectory;
using peers::percentile;
using peers::ReadyFrame;

int fail(const std::string& text) {
    std::fprintf(stderr, "open3d_odometry: %s\n", text.c_str());
    return 1;
}

std::shared_ptr<geometry::RGBDImage> rgbd_of(const ReadyFrame& frame, double max_depth_m) {
    geometry::Image colour, depth;
    colour.Prepare(frame.width, frame.height, 3, 1);
    std::copy(frame.rgb.begin(), frame.rgb.end(), colour.data_.begin());
    depth.Prepare(frame.width, frame.height, 1, 4);
    std::memcpy(depth.data_.data(), frame.depth_m.data(), frame.depth_m.size() * sizeof(float));
    return geometry::RGBDImage::CreateFromColorAndDepth(colour, depth, 1.0, max_depth_m, true);
}

// The rotation of a product of thousands stays one, by way of a unit quaternion.
Se3 chained(const Se3& T_world_last, const Eigen::Matrix4d& T_last_now) {
    const Eigen::Quaterniond q =
        Eigen::Quaterniond(Eigen::Matrix3d(T_last_now.block<3, 3>(0, 0))).normalized();
    const Eigen::Matrix3d R = q.toRotationMatrix();
    Se3 motion;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) motion.R(r, c) = R(r, c);
    motion.t = {T_last_now(0, 3), T_last_now(1, 3), T_last_now(2, 3)};
    return T_world_last * motion;
}

struct Tracked {
    Trajectory estimate, truth;
    std::vector<double> frame_ms, frame_cpu_ms;
    int failures = 0;
};

Status track(const peers::Options& options, const burin::bench::FrameRange& range, Tracked* out) {
    const auto dataset = burin::open_dataset(options.dataset, options.format);
    if (!dataset) return dataset.status();
    odometry::OdometryOption settings;
    settings.depth_min_ = options.min_depth_m;
    settings.depth_max_ = options.max_depth_m;
    std::shared_ptr<geometry::RGBDImage> last;
    ReadyFrame ready;
    for (int i = range.first; i < std::min(range.last, (*dataset)->frame_count()); ++i) {
        Frame frame;
        BURIN_TRY((*dataset)->load(i, &frame));
        if (!frame.has_pose && !last) continue;
        BURIN_TRY(make_ready(frame, options, &ready));
        const auto now = rgbd_of(ready, options.max_depth_m);
        Se3 T = frame.T_world_camera;
        if (last) {
            const burin::Camera& k = ready.camera;
            const open3d::camera::PinholeCameraIntrinsic intrinsic(ready.width, ready.height, k.fx, k.fy,
                                                                   k.cx, k.cy);
            const double start = burin::bench::now_ms(), cpu_start = burin::bench::cpu_ms();
            const auto [found, T_last_now, information] =
                odometry::ComputeRGBDOdometry(*now, *last, intrinsic, Eigen::Matrix4d::Identity(),
                                              odometry::RGBDOdometryJacobianFromHybridTerm(), settings);
            out->frame_cpu_ms.push_back(burin::bench::cpu_ms() - cpu_start);
            out->frame_ms.push_back(burin::bench::now_ms() - start);
            out->failures += !found;
            const Se3& before = out->estimate.back().T_world_camera;
            T = found ? chained(before, T_last_now) : before;
        }
        out->estimate.push_back({frame.t_ns, T});
        if (frame.has_pose) out->truth.push_back({frame.t_ns, frame.T_world_camera});
        last = now;
    }
    if (out->frame_ms.empty())
        return Status::error(burin::Code::invalid_argument, "%s: fewer than two frames to track",
                             options.dataset.c_str());
    return {};
}

int run(const peers::Options& options) {
    burin::bench::FrameRange range;
    if (!options.frames.empty() && !burin::bench::parse_range(options.frames, &range))
        return fail("--frames " + options.frames + ": expected A:B with A < B");
    Tracked tracked;
    if (const Status status = track(options, range, &tracked); !status.ok()) return fail(status.text());
    const auto aligned = burin::absolute_error(tracked.estimate, tracked.truth, burin::Alignment::se3);
    if (!aligned.ok()) return fail(options.dataset + ": " + aligned.status().text());
    const auto unaligned = burin::absolute_error(tracked.estimate, tracked.truth, burin::Alignment::none);
    if (!unaligned.ok()) return fail(options.dataset + ": " + unaligned.status().text());
    if (!options.output.empty())
        if (const Status status = burin::write_tum_trajectory(options.output, tracked.estimate); !status.ok())
            return fail(status.text());
    std::sort(tracked.frame_ms.begin(), tracked.frame_ms.end());
    std::sort(tracked.frame_cpu_ms.begin(), tracked.frame_cpu_ms.end());
    const nlohmann::ordered_json report = {
        {"peer", "open3d_rgbd_odometry"},
        {"dataset", options.dataset},
        {"frames", tracked.estimate.size()},
        {"failures", tracked.failures},
        {"threads", options.threads},
        {"ate_mm", 1e3 * aligned->translation_m.rmse},
        {"ate_max_mm", 1e3 * aligned->translation_m.max},
        {"unaligned_mm", 1e3 * unaligned->translation_m.rmse},
        {"track_p50_ms", percentile(tracked.frame_ms, 0.5)},
        {"track_p95_ms", percentile(tracked.frame_ms, 0.95)},
        {"track_p50_cpu_ms", percentile(tracked.frame_cpu_ms, 0.5)},
    };
    std::printf("%s\n", report.dump().c_str());
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    peers::Options options;
    options.colour = true;
    options.min_depth_m = 0;  // OdometryOption's
    options.max_depth_m = 4;  // likewise; up to 5 m it does worse: 33 for 24 mm on icl_office_kt3_noisy
    CLI::App app{"Tracks a data set with Open3D's RGB-D odometry and prints its errors and times as JSON"};
    app.add_option("dataset", options.dataset, "folder of the data set")->required();
    app.add_option("--format", options.format, "format of the data set, recognised by default");
    app.add_option("-o,--output", options.output, "trajectory to write (TUM)");
    app.add_option("--max-depth", options.max_depth_m, "metres")->check(CLI::Range(0.1, 100.0));
    app.add_option("--frames", options.frames, "A:B, half open");
    app.add_option("--threads", options.threads)->check(CLI::Range(1, 256));
    CLI11_PARSE(app, argc, argv);
    peers::start_over_with_threads(options.threads, argv);
    open3d::utility::SetVerbosityLevel(open3d::utility::VerbosityLevel::Warning);
    try {
        return run(options);
    } catch (const std::exception& error) {
        return fail(error.what());
    }
}
