// SPDX-License-Identifier: MIT
// The files of a rendered sequence.
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "datasets/file.h"
#include "datasets/image_file.h"
#include "datasets/synthetic/sensor_noise.h"
#include "datasets/synthetic/synth.h"
#include "datasets/synthetic/synth_imu.h"
#include "datasets/synthetic/truth_planes.h"
#include "datasets/trajectory_file.h"

namespace burin {
namespace {

namespace fs = std::filesystem;

constexpr double kDepthScale = 5000;  // 0.2 mm a step, as in the TUM data sets
constexpr double kFarthest = 100;     // metres; no scene is that large

// Plain, since the whole folder gets its name only when everything in it is complete.
Status write_bytes(const std::string& path, std::string_view bytes) {
    std::FILE* file = std::fopen(path.c_str(), "wb");
    if (!file) return Status::error(Code::io, "%s: %s", path.c_str(), std::strerror(errno));
    const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
    if (std::fclose(file) != 0 || !written)
        return Status::error(Code::io, "%s: %s while writing %zu bytes", path.c_str(), std::strerror(errno),
                             bytes.size());
    return {};
}

// Portable FloatMap: little endian (negative scale), rows from the bottom up.
std::string encode_pfm(View<const float> image) {
    std::string bytes =
        "Pf\n" + std::to_string(image.width) + " " + std::to_string(image.height) + "\n-1.0\n";
    for (int y = image.height - 1; y >= 0; --y)
        for (int x = 0; x < image.width; ++x) {
            std::uint32_t bits;
            std::memcpy(&bits, image.row(y) + x, 4);
            for (int i = 0; i < 4; ++i) bytes += static_cast<char>(bits >> (8 * i) & 0xFF);
        }
    return bytes;
}

Image<std::uint16_t> depth_steps(const Image<float>& depth_m) {
    Image<std::uint16_t> out(depth_m.width, depth_m.height);
    for (std::size_t i = 0; i < depth_m.pixels.size(); ++i) {
        const double steps = std::floor(depth_m.pixels[i] * kDepthScale + 0.5);
        out.pixels[i] = steps < 65535 ? static_cast<std::uint16_t>(steps)
                                      : std::uint16_t(0);  // farther than 13.1 m: none
    }
    return out;
}

Image<std::uint8_t> normal_picture(const Image<float>& normal) {
    Image<std::uint8_t> out(normal.width, normal.height, 3);
    for (std::size_t i = 0; i < normal.pixels.size(); ++i)
        out.pixels[i] = static_cast<std::uint8_t>(std::floor(127.5f + 127.5f * normal.pixels[i] + 0.5f));
    return out;
}

std::string camera_text(const Camera& camera) {
    char text[400];
    std::snprintf(
        text, sizeof text,
        "# pinhole, undistorted. metres = depth_png / depth_scale\nfx %.9g\nfy %.9g\ncx %.9g\ncy %.9g\n"
        "width %d\nheight %d\ndepth_scale %g\n",
        camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height, kDepthScale);
    return text;
}

std::string scene_json(const SynthOptions& options, const SyntheticScene& scene, int frames) {
    nlohmann::ordered_json json = {{"scene", options.scene},
                                   {"seed", options.seed},
                                   {"frames", frames},
                                   {"noise", options.noise == SynthNoise::sensor ? "sensor" : "none"},
                                   {"width", options.width},
                                   {"height", options.height},
                                   {"trajectory", options.trajectory_file},
                                   {"world", "right-handed, metres, z up, floor at z = 0"},
                                   {"mesh_resolution_m", scene.data().mesh_resolution}};
    const Vec3d low = scene.data().mesh_bounds.low, high = scene.data().mesh_bounds.high;
    json["mesh_bounds"] = {{low.x, low.y, low.z}, {high.x, high.y, high.z}};
    if (options.imu_rate_hz != 0) json["imu_rate_hz"] = options.imu_rate_hz;
    // Paths are bytes, not always UTF-8.
    return json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

struct FrameImages {
    TruthImages truth;
    Image<float> depth_m;
    Image<std::uint8_t> rgb;
};

// All files of one frame, encoded and written side by side.
Status write_frame(const std::string& dir, const std::string& name, const FrameImages& images,
                   bool truth_images, Jobs& jobs) {
    const int count = truth_images ? 7 : 2;
    std::vector<Status> status(static_cast<std::size_t>(count));
    jobs.run(count, [&](int item, int) {
        std::string bytes, path = dir;
        Status& result = status[static_cast<std::size_t>(item)];
        const auto png = [&](const char* folder, const auto& image) {
            path += folder + name + ".png";
            result = encode_png(image.view(), &bytes);
        };
        switch (item) {
            case 0:
                png("/rgb/", images.rgb);
                break;
            case 1:
                png("/depth/", depth_steps(images.depth_m));
                break;
            case 2:
                path += "/truth/depth/" + name + ".pfm";
                bytes = encode_pfm(images.truth.depth_m.view());
                break;
            case 3:
                png("/truth/normals/", normal_picture(images.truth.normal));
                break;
            case 4:
                png("/truth/albedo/", encode_srgb(images.truth.albedo.view()));
                break;
            case 5:
                png("/truth/labels/", images.truth.label);
                break;
            default:
                png("/truth/instances/", images.truth.instance);
                break;
        }
        if (result.ok()) result = write_bytes(path, bytes);
    });
    for (const Status& s : status) BURIN_TRY(s);
    return {};
}

Status write_sequence(const SynthOptions& options, const Trajectory& trajectory, const SyntheticScene& scene,
                      const SynthImu& imu, const std::string& dir, const SynthProgress& progress,
                      Jobs& jobs) {
    std::error_code error;
    std::vector<std::string> folders{"/rgb", "/depth", "/truth"};
    if (options.truth_images)
        for (const char* name :
             {"/truth/depth", "/truth/normals", "/truth/albedo", "/truth/labels", "/truth/instances"})
            folders.emplace_back(name);
    for (const std::string& folder : folders)
        if (fs::create_directories(dir + folder, error); error)
            return Status::error(Code::io, "%s: %s", (dir + folder).c_str(), error.message().c_str());

    const Camera camera = synth_camera(options.width, options.height);
    const bool noise = options.noise == SynthNoise::sensor;
    const SensorRange range;
    PlaneSurvey survey(scene);
    FrameImages images;
    std::string rgb = "# timestamp filename\n", depth = rgb, both = "# t_rgb rgb t_depth depth\n";
    const auto total = static_cast<int>(trajectory.size());
    for (int i = 0; i < total; ++i) {
        const StampedPose& pose = trajectory[static_cast<std::size_t>(i)];
        if (Status s = render_truth(scene, camera, pose.T_world_camera, false, jobs, &images.truth); !s.ok())
            return Status::error(s.code(), "frame %d: %s", i, s.text());
        if (noise)
            sensor_depth(images.truth, camera, pose.T_world_camera, options.seed, i, range, jobs,
                         &images.depth_m);
        else
            images.depth_m = images.truth.depth_m;
        sensor_colour(images.truth, noise, options.seed, i, jobs, &images.rgb);
        survey.add_frame(images.truth, camera, pose.T_world_camera, noise ? range.max_m : kFarthest, jobs);
        char name[16];
        std::snprintf(name, sizeof name, "%06d", i);
        BURIN_TRY(write_frame(dir, name, images, options.truth_images, jobs));
        const std::string t = format_seconds(pose.t_ns);
        rgb += t + " rgb/" + name + ".png\n";
        depth += t + " depth/" + name + ".png\n";
        both += t + " rgb/" + name + ".png " + t + " depth/" + name + ".png\n";
        if (progress && !progress(i + 1, total))
            return Status::error(Code::cancelled, "%s: stopped after %d of %d frames",
                                 options.output_dir.c_str(), i + 1, total);
    }
    BURIN_TRY(write_bytes(dir + "/rgb.txt", rgb));
    BURIN_TRY(write_bytes(dir + "/depth.txt", depth));
    BURIN_TRY(write_bytes(dir + "/associations.txt", both));
    BURIN_TRY(write_bytes(dir + "/groundtruth.txt", format_tum_trajectory(trajectory)));
    const bool has_imu = !imu.samples.empty();
    BURIN_TRY(write_bytes(dir + "/camera.txt",
                          camera_text(camera) + (has_imu ? synth_imu_camera_text() : std::string())));
    if (has_imu) {
        BURIN_TRY(write_bytes(dir + "/imu.txt", synth_imu_text(imu, options.imu_rate_hz, noise)));
        BURIN_TRY(write_bytes(dir + "/truth/imu_bias.txt", synth_imu_bias_text(imu)));
    }
    BURIN_TRY(write_bytes(dir + "/truth/planes.json", planes_json(survey.planes())));
    return write_bytes(dir + "/truth/scene.json", scene_json(options, scene, total));
}

}  // namespace

Status synthesise(const SynthOptions& options, const SynthProgress& progress, Jobs& jobs,
                  std::unique_ptr<SyntheticScene>* out) {
    Result<Trajectory> trajectory = synth_trajectory(options);
    if (!trajectory.ok()) return trajectory.status();
    Result<std::unique_ptr<SyntheticScene>> scene = make_scene(options.scene, options.seed);
    if (!scene.ok()) return scene.status();
    SynthImu imu;
    if (options.imu_rate_hz != 0) {
        Result<SynthImu> made =
            synth_imu(*trajectory, options.imu_rate_hz, options.noise == SynthNoise::sensor, options.seed);
        if (!made.ok()) return made.status();
        imu = std::move(*made);
    }
    std::string dir = options.output_dir;
    while (dir.size() > 1 && dir.back() == '/') dir.pop_back();
    if (dir.empty())
        return Status::error(Code::invalid_argument, "output folder: an empty name, expected a path");
    std::error_code error;
    const bool there = fs::exists(dir, error);
    if (there && (!fs::is_directory(dir, error) || !fs::is_empty(dir, error)))
        return Status::error(Code::invalid_argument, "%s: exists already, expected a new or empty folder",
                             dir.c_str());
    const std::string partial = dir + ".partial";
    if (fs::exists(partial, error))
        return Status::error(Code::invalid_argument,
                             "%s: left by another run, expected it gone; remove it first", partial.c_str());
    if (fs::create_directories(partial, error); error)
        return Status::error(Code::io, "%s: %s", partial.c_str(), error.message().c_str());
    Status status = write_sequence(options, *trajectory, **scene, imu, partial, progress, jobs);
    if (status.ok()) {
        fs::rename(partial, dir, error);  // replaces an empty folder
        if (error)
            status = Status::error(Code::io, "%s: %s while renaming to %s", partial.c_str(),
                                   error.message().c_str(), dir.c_str());
    }
    if (!status.ok()) {
        fs::remove_all(partial, error);
        return status;
    }
    if (out) *out = std::move(*scene);
    return {};
}

}  // namespace burin
