// SPDX-License-Identifier: MIT
// Replica (Straub et al. 2019) as rendered for NICE-SLAM (Zhu et al., CVPR 2022): results/frame%06d.jpg,
// results/depth%06d.png and traj.txt, one camera-to-world matrix a line with OpenCV camera axes.
#include <utility>

#include "datasets/file.h"
#include "datasets/file_dataset.h"
#include "datasets/formats.h"
#include "datasets/trajectory_file.h"

namespace burin {
namespace {

// NICE-SLAM's configs/Replica/replica.yaml.
constexpr double kDepthScale = 6553.5;
constexpr Camera kDefaultCamera{1200, 680, 600, 600, 599.5, 339.5};

// depth000000.png, not depth.png or depth_colour0.png.
bool is_depth_name(const std::string& name) {
    return name.size() > 9 && name.compare(0, 5, "depth") == 0 &&
           name.compare(name.size() - 4, 4, ".png") == 0 &&
           name.find_first_not_of("0123456789", 5) == name.size() - 4;
}

Status read_cameras(FileList* list) {
    for (const char* place : {"/cam_params.json", "/../cam_params.json"}) {
        const std::string path = list->folder + place;
        if (!is_file(path)) continue;
        Result<CameraFile> file = read_cam_params_json(path);
        if (!file) return file.status();
        list->cameras = *file;
        return {};
    }
    list->cameras.depth = list->cameras.colour = kDefaultCamera;
    list->cameras.depth_scale = kDepthScale;
    list->notes += "no cam_params.json: NICE-SLAM's 1200x680 600 600 599.5 339.5, depth_scale 6553.5\n";
    return {};
}

}  // namespace

bool looks_like_replica(const std::string& folder) {
    for (const std::string& name : list_folder(folder + "/results"))
        if (is_depth_name(name)) return true;
    return false;
}

Result<std::unique_ptr<Dataset>> open_replica(const std::string& folder) {
    FileList list;
    list.format = "replica";
    list.folder = folder;
    BURIN_TRY(read_cameras(&list));
    std::vector<MaybePose> poses;
    if (const std::string path = folder + "/traj.txt"; is_file(path)) {
        Result<std::vector<MaybePose>> read = read_matrix_lines(path);
        if (!read) return read.status();
        poses = std::move(*read);
    }
    const std::string results = folder + "/results";
    for (const std::string& name : list_folder(results)) {
        if (!is_depth_name(name)) continue;
        const std::int64_t number = first_number(name);
        const std::string digits = name.substr(5, name.size() - 9);
        FrameFiles frame;
        frame.depth_path = results + "/" + name;
        for (const char* end : {".jpg", ".png"})
            if (const std::string path = results + "/frame" + digits + end; is_file(path))
                frame.colour_path = path;
        frame.t_ns = frame.colour_t_ns = stamp_at_30_hz(number);
        if (number < 0 || (!list.frames.empty() && frame.t_ns <= list.frames.back().t_ns))
            return Status::error(Code::format,
                                 "%s: its number does not come after the one before, expected depth%%06d.png",
                                 frame.depth_path.c_str());
        // Line k of traj.txt belongs to number k, so a folder that keeps every tenth frame still fits.
        if (static_cast<std::uint64_t>(number) < poses.size()) {
            const MaybePose& pose = poses[static_cast<std::size_t>(number)];
            frame.has_pose = pose.known;
            frame.T_world_camera = pose.T_world_camera;
        }
        list.frames.push_back(std::move(frame));
    }
    if (list.frames.empty())
        return Status::error(Code::format,
                             "%s: no depth%%06d.png, expected Replica as rendered for NICE-SLAM",
                             results.c_str());
    note_missing_poses(&list, "no line of that number in traj.txt");
    return make_file_dataset(std::move(list));
}

}  // namespace burin
