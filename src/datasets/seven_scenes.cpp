// SPDX-License-Identifier: MIT
// 7-Scenes (Glocker, Izadi, Shotton, Criminisi, ISMAR 2013) and folders of the same layout with their own
// intrinsics (SUN3D as shipped by 3DMatch): frame-%06d.{color,depth}.png and .pose.txt, directly or in one
// seq-XX folder. Depth in millimetres, 65535 or 0 where there is none; numbers may have gaps.
#include <utility>

#include "datasets/file.h"
#include "datasets/file_dataset.h"
#include "datasets/formats.h"
#include "datasets/trajectory_file.h"

namespace burin {
namespace {

constexpr double kDepthScale = 1000;
// The set's page gives these for depth; colour is not registered to it and has no calibration of its own.
constexpr Camera kDefaultCamera{640, 480, 585, 585, 320, 240};

constexpr std::string_view kPrefix = "frame-", kDepthEnd = ".depth.png";

bool is_depth_name(std::string_view name) {
    return name.size() > kPrefix.size() + kDepthEnd.size() && name.substr(0, kPrefix.size()) == kPrefix &&
           name.substr(name.size() - kDepthEnd.size()) == kDepthEnd;
}

bool has_frames(const std::string& folder) {
    for (const std::string& name : list_folder(folder))
        if (is_depth_name(name)) return true;
    return false;
}

std::vector<std::string> sequences_in(const std::string& folder) {
    std::vector<std::string> found;
    for (const std::string& name : list_folder(folder))
        if (name.compare(0, 4, "seq-") == 0 && is_folder(folder + "/" + name) &&
            has_frames(folder + "/" + name))
            found.push_back(name);
    return found;
}

Status read_frame(const std::string& folder, const std::string& depth_name, FileList* list) {
    const std::string stem = folder + "/" + depth_name.substr(0, depth_name.size() - kDepthEnd.size());
    FrameFiles frame;
    frame.depth_path = folder + "/" + depth_name;
    for (const char* end : {".color.png", ".color.jpg"})
        if (is_file(stem + end)) frame.colour_path = stem + end;
    frame.t_ns = frame.colour_t_ns = stamp_at_30_hz(first_number(depth_name));
    if (!list->frames.empty() && frame.t_ns <= list->frames.back().t_ns)
        return Status::error(Code::format,
                             "%s: its number does not come after the one before, expected frame-%%06d",
                             frame.depth_path.c_str());
    if (const std::string path = stem + ".pose.txt"; is_file(path)) {
        Result<MaybePose> pose = read_pose_file(path);
        if (!pose) return pose.status();
        frame.has_pose = pose->known;
        frame.T_world_camera = pose->T_world_camera;
    }
    list->frames.push_back(std::move(frame));
    return {};
}

}  // namespace

bool looks_like_seven_scenes(const std::string& folder) {
    return has_frames(folder) || !sequences_in(folder).empty();
}

Result<std::unique_ptr<Dataset>> open_seven_scenes(const std::string& given) {
    FileList list;
    list.format = "7scenes";
    list.folder = given;
    if (!has_frames(given)) {
        const std::vector<std::string> sequences = sequences_in(given);
        if (sequences.empty())
            return Status::error(Code::format,
                                 "%s: no frame-%%06d.depth.png here or in a seq-XX folder, expected 7-Scenes",
                                 given.c_str());
        if (sequences.size() > 1)
            return Status::error(
                Code::invalid_argument, "%s: holds %zu sequences (%s to %s), expected the folder of one",
                given.c_str(), sequences.size(), sequences.front().c_str(), sequences.back().c_str());
        list.folder = given + "/" + sequences.front();
    }
    list.cameras.depth = list.cameras.colour = kDefaultCamera;
    bool own_intrinsics = false;
    for (const std::string& folder : {list.folder, list.folder + "/.."}) {
        const std::string path = folder + "/camera-intrinsics.txt";
        if (!is_file(path)) continue;
        Result<CameraFile> file = read_intrinsic_matrix(path);
        if (!file) return file.status();
        list.cameras = *file;
        own_intrinsics = true;
        break;
    }
    if (!own_intrinsics)
        list.notes +=
            "no camera-intrinsics.txt: 7-Scenes default 585 585 320 240; colour is not registered to depth "
            "there\n";
    list.cameras.depth_scale = kDepthScale;
    for (const std::string& name : list_folder(list.folder))
        if (is_depth_name(name)) BURIN_TRY(read_frame(list.folder, name, &list));
    note_missing_poses(&list, "no .pose.txt, or marked as lost");
    return make_file_dataset(std::move(list));
}

}  // namespace burin
