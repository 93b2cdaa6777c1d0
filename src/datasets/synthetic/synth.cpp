// SPDX-License-Identifier: MIT
#include "datasets/synthetic/synth.h"

#include <cmath>
#include <utility>

#include "datasets/imu_file.h"
#include "datasets/synthetic/camera_path.h"
#include "datasets/synthetic/sensor_noise.h"
#include "datasets/synthetic/synth_imu.h"
#include "datasets/trajectory_file.h"

namespace burin {
namespace {

Status check_options(const SynthOptions& options) {
    if (options.frames < 0)
        return Status::error(Code::invalid_argument, "frames %d: expected 0 (all) or more", options.frames);
    return check_camera(synth_camera(options.width, options.height), "synthetic");
}

}  // namespace

Camera synth_camera(int width, int height) {
    Camera camera;
    camera.width = width;
    camera.height = height;
    // The nominal Kinect lens; one focal length for both axes, by the image width.
    camera.fx = camera.fy = 525.0 * width / 640;
    camera.cx = 0.5 * (width - 1);
    camera.cy = 0.5 * (height - 1);
    return camera;
}

Result<Trajectory> synth_trajectory(const SynthOptions& options) {
    BURIN_TRY(check_options(options));
    if (options.trajectory_file.empty()) {
        bool known = false;
        for (const std::string& name : scene_names()) known = known || name == options.scene;
        if (!known) return make_scene(options.scene, 0).status();
        return builtin_path(options.scene, options.seed,
                            options.frames > 0 ? options.frames : default_frame_count(options.scene));
    }
    Result<Trajectory> flown = read_tum_trajectory(options.trajectory_file);
    if (!flown.ok()) return flown.status();
    if (options.frames > static_cast<int>(flown->size()))
        return Status::error(Code::invalid_argument, "%s: %d frames asked for, the trajectory has %zu poses",
                             options.trajectory_file.c_str(), options.frames, flown->size());
    const Se3 T_scene_trajectory = options.T_scene_trajectory
                                       ? *options.T_scene_trajectory
                                       : default_T_scene_trajectory(options.scene, options.seed, *flown);
    if (options.frames > 0) flown->resize(static_cast<std::size_t>(options.frames));
    for (StampedPose& pose : *flown) pose.T_world_camera = T_scene_trajectory * pose.T_world_camera;
    return flown;
}

Result<std::unique_ptr<SyntheticDataset>> SyntheticDataset::create(const SynthOptions& options) {
    std::unique_ptr<SyntheticDataset> set(new SyntheticDataset);
    Result<Trajectory> trajectory = synth_trajectory(options);
    if (!trajectory.ok()) return trajectory.status();
    Result<std::unique_ptr<SyntheticScene>> scene = make_scene(options.scene, options.seed);
    if (!scene.ok()) return scene.status();
    if (options.imu_rate_hz != 0) {
        Result<SynthImu> imu =
            synth_imu(*trajectory, options.imu_rate_hz, options.noise == SynthNoise::sensor, options.seed);
        if (!imu.ok()) return imu.status();
        set->imu_ = std::move(imu->samples);
    }
    set->options_ = options;
    set->trajectory_ = std::move(*trajectory);
    set->scene_ = std::move(*scene);
    set->camera_ = synth_camera(options.width, options.height);
    return set;
}

Status SyntheticDataset::load(int index, Frame* out) const {
    if (index < 0 || index >= frame_count())
        return Status::error(Code::invalid_argument, "frame %d: expected 0 to %d", index, frame_count() - 1);
    const StampedPose& pose = trajectory_[static_cast<std::size_t>(index)];
    Jobs one(1);
    TruthImages truth;
    BURIN_TRY(render_truth(*scene_, camera_, pose.T_world_camera, false, one, &truth));
    const bool noise = options_.noise == SynthNoise::sensor;
    out->t_ns = out->colour_t_ns = pose.t_ns;
    out->depth_u16 = {};
    if (noise)
        sensor_depth(truth, camera_, pose.T_world_camera, options_.seed, index, {}, one, &out->depth_f32);
    else
        out->depth_f32 = std::move(truth.depth_m);
    out->depth_unit_m = 1;
    out->confidence = {};
    sensor_colour(truth, noise, options_.seed, index, one, &out->colour);
    out->depth_camera = out->colour_camera = camera_;
    out->T_colour_depth = {};
    out->has_pose = true;
    out->T_world_camera = pose.T_world_camera;
    out->imu = imu_of_frame(
        imu_, index > 0 ? &trajectory_[static_cast<std::size_t>(index - 1)].t_ns : nullptr, pose.t_ns);
    out->T_camera_imu = imu_.empty() ? Se3{} : synth_T_camera_imu();
    return {};
}

}  // namespace burin
