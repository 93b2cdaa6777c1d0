// SPDX-License-Identifier: MIT
// Redwood (Choi, Zhou, Koltun, CVPR 2015) and Open3D's reconstruction system: folders of colour and depth
// images, a .log trajectory, optionally Open3D's intrinsic JSON. Depth in millimetres unless the JSON says
// otherwise.
#include <unordered_map>
#include <utility>

#include "datasets/file.h"
#include "datasets/file_dataset.h"
#include "datasets/formats.h"
#include "datasets/trajectory_file.h"

namespace burin {
namespace {

constexpr double kDepthScale = 1000;
// PrimeSense default, which the set's page gives for all its scenes (and Open3D as PrimeSenseDefault).
constexpr Camera kDefaultCamera{640, 480, 525, 525, 319.5, 239.5};

constexpr const char* kColourFolders[] = {"color", "image", "rgb"};
// Odometry of the scan first: fragments' trajectory.log is the result of one particular optimisation.
constexpr const char* kLogNames[] = {"odometry.log", "trajectory.log"};
constexpr const char* kIntrinsicNames[] = {"camera_intrinsic.json", "intrinsic.json"};

bool is_image_name(const std::string& name) {
    const std::size_t dot = name.rfind('.');
    const std::string end = dot == std::string::npos ? "" : name.substr(dot);
    return end == ".png" || end == ".jpg" || end == ".jpeg" || end == ".pgm" || end == ".ppm";
}

std::vector<std::string> images_in(const std::string& folder) {
    std::vector<std::string> images;
    for (std::string& name : list_folder(folder))
        if (is_image_name(name)) images.push_back(std::move(name));
    return images;
}

std::string colour_folder(const std::string& folder) {
    for (const char* name : kColourFolders)
        if (const std::string path = folder + "/" + name; is_folder(path)) return path;
    return {};
}

// The first of the names that is there, or empty.
template <std::size_t N>
std::string first_file(const std::string& folder, const char* const (&names)[N]) {
    for (const char* name : names)
        if (const std::string path = folder + "/" + name; is_file(path)) return path;
    return {};
}

// Colour image of each depth image: by the number in the name where numbers are unique, else by order.
Status pair_images(const std::string& folder, FileList* list) {
    const std::vector<std::string> depth = images_in(folder + "/depth");
    const std::string colour_path = colour_folder(folder);
    const std::vector<std::string> colour =
        colour_path.empty() ? std::vector<std::string>{} : images_in(colour_path);
    std::unordered_map<std::int64_t, const std::string*> by_number;
    bool numbered = true;
    for (const std::string& name : colour)
        numbered = first_number(name) >= 0 && by_number.emplace(first_number(name), &name).second && numbered;
    std::int64_t before = -1;
    for (const std::string& name : depth) {
        numbered = numbered && first_number(name) > before;
        before = first_number(name);
    }
    if (!numbered && colour.size() != depth.size() && !colour.empty())
        return Status::error(
            Code::format,
            "%s: %zu colour and %zu depth images without common numbers, expected as many of each",
            folder.c_str(), colour.size(), depth.size());
    std::size_t without = 0;
    for (std::size_t i = 0; i < depth.size(); ++i) {
        FrameFiles frame;
        frame.depth_path = folder + "/depth/" + depth[i];
        const std::string* name = nullptr;
        if (numbered) {
            const auto found = by_number.find(first_number(depth[i]));
            name = found == by_number.end() ? nullptr : found->second;
        } else if (!colour.empty()) {
            name = &colour[i];
        }
        if (name) frame.colour_path = colour_path + "/" + *name;
        without += name == nullptr;
        frame.t_ns = frame.colour_t_ns = stamp_at_30_hz(static_cast<std::int64_t>(i));
        list->frames.push_back(std::move(frame));
    }
    if (without > 0)
        list->notes += std::to_string(without) + " of " + std::to_string(depth.size()) +
                       " frames have no colour image\n";
    return {};
}

}  // namespace

bool looks_like_redwood(const std::string& folder) {
    return is_folder(folder + "/depth") && !colour_folder(folder).empty();
}

Result<std::unique_ptr<Dataset>> open_redwood(const std::string& folder) {
    FileList list;
    list.format = "redwood";
    list.folder = folder;
    if (!is_folder(folder + "/depth"))
        return Status::error(
            Code::format, "%s: no folder depth, expected the Redwood layout (depth and color, image or rgb)",
            folder.c_str());
    list.cameras.depth = list.cameras.colour = kDefaultCamera;
    if (const std::string path = first_file(folder, kIntrinsicNames); !path.empty()) {
        Result<CameraFile> file = read_open3d_intrinsic_json(path);
        if (!file) return file.status();
        list.cameras = *file;
    } else {
        list.notes += "no camera_intrinsic.json: PrimeSense default 525 525 319.5 239.5\n";
    }
    if (list.cameras.depth_scale == 0) list.cameras.depth_scale = kDepthScale;
    BURIN_TRY(pair_images(folder, &list));
    if (const std::string path = first_file(folder, kLogNames); !path.empty()) {
        Result<std::vector<LogPose>> poses = read_log_trajectory(path);
        if (!poses) return poses.status();
        for (const LogPose& pose : *poses) {
            const auto index = static_cast<std::size_t>(pose.ids[0]);
            if (index >= list.frames.size())
                break;  // the trajectory of a scan of which only the start is here
            list.frames[index].has_pose = true;
            list.frames[index].T_world_camera = pose.T_world_camera;
        }
    }
    note_missing_poses(&list, "not in odometry.log or trajectory.log");
    return make_file_dataset(std::move(list));
}

}  // namespace burin
