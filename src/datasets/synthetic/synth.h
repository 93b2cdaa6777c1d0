// SPDX-License-Identifier: MIT
// Rendered sequences with exact truth: as files in the TUM layout, or as a data set in memory.
//
// All poses, planes and meshes are in the scene's frame (z up, floor at z = 0; see scene.h), also when a
// recorded trajectory given in another world is flown: T_scene_trajectory carries it over.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/dataset.h"
#include "core/jobs.h"
#include "core/trajectory.h"
#include "datasets/synthetic/scene.h"

namespace burin {

enum class SynthNoise { none, sensor };

struct SynthOptions {
    std::string scene = "room";  // one of scene_names()
    std::uint64_t seed = 1;      // moves furniture, textures and lights
    int frames = 0;              // 0: as many as default_frame_count, or all of the trajectory
    SynthNoise noise = SynthNoise::sensor;
    int width = 640,
        height = 480;             // pixels; the field of view is that of 525 pixels focal length at 640 x 480
    std::string trajectory_file;  // TUM text; empty flies the built-in path (camera_path.h)
    std::optional<Se3> T_scene_trajectory;  // default: default_T_scene_trajectory (camera_path.h)
    int imu_rate_hz = 0;                    // 0: no IMU; see synth_imu.h. Its noise comes with `noise`
    bool truth_images = true;  // truth/depth, normals, albedo, labels, instances: some 2 MB a frame
    std::string output_dir;    // must not exist, or be empty
};

// Called after every frame; returning false stops the work.
using SynthProgress = std::function<bool(int done, int total)>;

// The camera of all built-in sequences at this size.
Camera synth_camera(int width, int height);
// The poses the options ask for, in the scene's frame. Errors: the trajectory file's own; `frames` negative
// or more than the file has.
Result<Trajectory> synth_trajectory(const SynthOptions& options);

// Renders the whole sequence into options.output_dir:
//   rgb/NNNNNN.png  depth/NNNNNN.png (16 bit, metres = value / 5000)  rgb.txt depth.txt associations.txt
//   groundtruth.txt camera.txt (depth_scale 5000)  imu.txt truth/imu_bias.txt (with an IMU)
//   truth/depth/NNNNNN.pfm  exact depth, 32-bit floats (Portable FloatMap, metres along the optical axis, 0 =
//   nothing) truth/normals/NNNNNN.png (8 bit, scene frame: 127.5 + 127.5 n)  truth/albedo/NNNNNN.png (8 bit
//   sRGB) truth/labels/NNNNNN.png (8 bit, 0..7)  truth/instances/NNNNNN.png (16 bit) truth/planes.json
//   truth/scene.json
// truth/mesh.ply is left to the caller (truth_mesh.h). The files are written beside the final name and moved
// there when all are complete; after an error nothing stands under it. The same options give the same bytes
// for any number of threads. `scene` gets the scene when not null. Errors: invalid_argument for options, io,
// format (trajectory), cancelled when progress returned false.
Status synthesise(const SynthOptions& options, const SynthProgress& progress, Jobs& jobs,
                  std::unique_ptr<SyntheticScene>* scene = nullptr);

// The same frames without files: rendered on demand, each load on one thread. load() may be called from
// several threads at once. Depth is float metres (exact when noise is none), colour beside it, poses known.
class SyntheticDataset : public Dataset {
  public:
    // Errors as for synthesise. Ignores output_dir and truth_images.
    static Result<std::unique_ptr<SyntheticDataset>> create(const SynthOptions& options);

    const char* format() const override { return "synthetic"; }
    int frame_count() const override { return static_cast<int>(trajectory_.size()); }
    Status load(int index, Frame* out) const override;

    const SyntheticScene& scene() const { return *scene_; }
    const Trajectory& trajectory() const { return trajectory_; }
    const Camera& camera() const { return camera_; }

  private:
    SyntheticDataset() = default;
    SynthOptions options_;
    std::unique_ptr<SyntheticScene> scene_;
    Trajectory trajectory_;
    Camera camera_;
    std::vector<ImuSample> imu_;
};

}  // namespace burin
