// SPDX-License-Identifier: MIT
// TUM RGB-D benchmark (Sturm, Engelhard, Endres, Burgard, Cremers, IROS 2012), also what `burin synth`
// writes. Depth is registered to the colour camera; metres = value / 5000, 0 where there is none.
#include <utility>

#include "datasets/file.h"
#include "datasets/formats.h"
#include "datasets/trajectory_file.h"
#include "datasets/tum_layout.h"

namespace burin {
namespace {

constexpr double kDepthScale = 5000;  // of the benchmark's files

struct Published {
    const char* names[2];
    Camera camera;  // of the colour images
};
// The benchmark's page "File formats", table of calibrations. fr3 has been undistorted by its authors. The
// depth images already carry the correction factors that the page also lists.
constexpr Published kPublished[] = {
    {{"freiburg1", "fr1"}, {640, 480, 517.3, 516.5, 318.6, 255.3, 0.2624, -0.9531, -0.0054, 0.0026, 1.1633}},
    {{"freiburg2", "fr2"}, {640, 480, 520.9, 521.0, 325.1, 249.7, 0.2312, -0.7849, -0.0033, -0.0001, 0.9172}},
    {{"freiburg3", "fr3"}, {640, 480, 535.4, 539.2, 320.1, 247.6}},
};
// The page's recommendation when no calibration is known: the ROS driver's default.
constexpr Camera kRosDefault{640, 480, 525, 525, 319.5, 239.5};

Status read_cameras(FileList* list) {
    if (const std::string path = list->folder + "/camera.txt"; is_file(path)) {
        Result<CameraFile> file = read_camera_text(path);
        if (!file) return file.status();
        list->cameras = *file;
        if (list->cameras.depth_scale == 0) list->cameras.depth_scale = kDepthScale;
        return {};
    }
    list->cameras.depth_scale = kDepthScale;
    const std::string name = folder_name(list->folder);
    for (const Published& published : kPublished)
        for (const char* part : published.names) {
            if (name.find(part) == std::string::npos) continue;
            list->cameras.colour = published.camera;
            // The driver registers depth to an undistorted pinhole with the same focal length.
            Camera& depth = list->cameras.depth;
            depth = published.camera;
            depth.k1 = depth.k2 = depth.p1 = depth.p2 = depth.k3 = 0;
            list->notes += std::string("no camera.txt: published intrinsics of ") + published.names[0] + "\n";
            return {};
        }
    list->cameras.depth = list->cameras.colour = kRosDefault;
    list->notes += "no camera.txt: ROS default intrinsics 525 525 319.5 239.5, depth_scale 5000\n";
    return {};
}

}  // namespace

bool looks_like_tum(const std::string& folder) { return has_tum_lists(folder); }

Result<std::unique_ptr<Dataset>> open_tum(const std::string& folder) {
    FileList list;
    list.format = "tum";
    list.folder = folder;
    if (!has_tum_lists(folder))
        return Status::error(Code::format,
                             "%s: neither associations.txt nor depth.txt, expected the TUM RGB-D layout",
                             folder.c_str());
    BURIN_TRY(read_cameras(&list));
    BURIN_TRY(read_tum_frames(&list));
    BURIN_TRY(read_tum_imu(&list));
    if (const std::string path = folder + "/groundtruth.txt"; is_file(path)) {
        Result<Trajectory> truth = read_tum_trajectory(path);
        if (!truth) return truth.status();
        assign_poses(*truth, &list);
    } else {
        note_missing_poses(&list, "no groundtruth.txt");
    }
    return make_file_dataset(std::move(list));
}

}  // namespace burin
