// SPDX-License-Identifier: MIT
// Polycam's raw export ("developer mode"). Facts from github.com/PolyCam/polyform, README ("Polycam's data
// format") and polyform/core/capture_folder.py: under keyframes/, files named by a stamp in microseconds,
//   images/ cameras/                        as captured: with some lens distortion, ARKit's poses
//   corrected_images/ corrected_cameras/    undistorted, poses optimised; where they are, they are taken
//   depth/       16-bit PNG, millimetres, of a smaller size than the images, whose view it shows
//   confidence/  8-bit PNG, 0 127 255 for ARKit's 0 1 2
#include "datasets/polycam.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "datasets/file.h"
#include "datasets/file_dataset.h"
#include "datasets/formats.h"
#include "datasets/image_file.h"

namespace burin {
namespace {

constexpr double kDepthScale = 1000;
constexpr std::size_t kMaxCameraBytes = 1 << 20;  // they have half a kilobyte

Status take(const nlohmann::json& object, const char* key, const std::string& name, double* value) {
    const auto found = object.find(key);
    if (found == object.end() || !found->is_number())
        return Status::error(Code::format, "%s: no number '%s', expected one", name.c_str(), key);
    *value = found->get<double>();
    return {};
}

Result<nlohmann::json> parse_object(std::string_view text, const std::string& name) {
    try {
        nlohmann::json root = nlohmann::json::parse(text.begin(), text.end(), nullptr, false);
        if (root.is_object()) return root;
    } catch (...) {
        return Status::error(Code::insufficient_memory, "%s: no memory to read it", name.c_str());
    }
    return Status::error(Code::format, "%s: is no JSON object, expected a camera of Polycam", name.c_str());
}

// Microseconds in a name; -1 when it is none.
std::int64_t stamp_of(const std::string& name) {
    const std::size_t dot = name.rfind('.');
    if (dot == 0 || dot == std::string::npos || dot > 15) return -1;
    std::int64_t value = 0;
    for (std::size_t i = 0; i < dot; ++i) {
        if (name[i] < '0' || name[i] > '9') return -1;
        value = 10 * value + (name[i] - '0');
    }
    return value;
}

struct Folders {
    std::string images, cameras, depth, confidence;
};

Folders folders_of(const std::string& folder, FileList* list) {
    const std::string base = folder + "/keyframes/";
    const bool corrected = is_folder(base + "corrected_cameras") && is_folder(base + "corrected_images");
    if (!corrected)
        list->notes +=
            "no corrected_cameras and corrected_images: ARKit's poses, images with some distortion\n";
    const std::string prefix = base + (corrected ? "corrected_" : "");
    return {prefix + "images/", prefix + "cameras/", base + "depth/", base + "confidence/"};
}

Status read_frame(const Folders& folders, const std::string& stem, int depth_width, int depth_height,
                  FileList* list) {
    FrameFiles frame;
    const std::string camera_path = folders.cameras + stem + ".json";
    std::string text;
    BURIN_TRY(read_file(camera_path, kMaxCameraBytes, &text));
    const Result<PolycamCamera> camera = parse_polycam_camera(text, camera_path);
    if (!camera) return camera.status();
    frame.depth_path = folders.depth + stem + ".png";
    if (const std::string path = folders.images + stem + ".jpg"; is_file(path)) frame.colour_path = path;
    if (const std::string path = folders.confidence + stem + ".png"; is_file(path))
        frame.confidence_path = path;
    frame.t_ns = frame.colour_t_ns = stamp_of(stem + ".") * 1000;
    frame.cameras = FrameCameras{scaled_camera(camera->colour, depth_width, depth_height), camera->colour};
    frame.has_pose = true;
    frame.T_world_camera = camera->T_world_camera;
    list->frames.push_back(std::move(frame));
    return {};
}

}  // namespace

Result<PolycamCamera> parse_polycam_camera(std::string_view text, const std::string& name) {
    Result<nlohmann::json> root = parse_object(text, name);
    if (!root) return root.status();
    PolycamCamera out;
    double width = 0, height = 0, m[12];
    BURIN_TRY(take(*root, "fx", name, &out.colour.fx));
    BURIN_TRY(take(*root, "fy", name, &out.colour.fy));
    BURIN_TRY(take(*root, "cx", name, &out.colour.cx));
    BURIN_TRY(take(*root, "cy", name, &out.colour.cy));
    BURIN_TRY(take(*root, "width", name, &width));
    BURIN_TRY(take(*root, "height", name, &height));
    if (!(width >= 1 && width <= kMaxImageSide && height >= 1 && height <= kMaxImageSide))
        return Status::error(Code::format, "%s: size is %gx%g, expected 1 to %d pixels a side", name.c_str(),
                             width, height, kMaxImageSide);
    out.colour.width = static_cast<int>(width);
    out.colour.height = static_cast<int>(height);
    if (const Status status = check_camera(out.colour, "colour"); !status)
        return Status::error(Code::format, "%s: %s", name.c_str(), status.text());
    for (int i = 0; i < 12; ++i) {
        const char key[] = {'t', '_', static_cast<char>('0' + i / 4), static_cast<char>('0' + i % 4), 0};
        BURIN_TRY(take(*root, key, name, &m[i]));
    }
    const Result<Se3> T = se3_from_matrix(m, 3);
    if (!T) return Status::error(Code::format, "%s: %s", name.c_str(), T.status().text());
    out.T_world_camera = opencv_from_arkit(*T);
    return out;
}

bool looks_like_polycam(const std::string& folder) {
    return is_folder(folder + "/keyframes/depth") &&
           (is_folder(folder + "/keyframes/cameras") || is_folder(folder + "/keyframes/corrected_cameras"));
}

Result<std::unique_ptr<Dataset>> open_polycam(const std::string& folder) {
    FileList list;
    list.format = "polycam";
    list.folder = folder;
    list.confidence_scale = ConfidenceScale::bytes;
    list.cameras.depth_scale = kDepthScale;
    const Folders folders = folders_of(folder, &list);
    std::vector<std::string> names;
    for (std::string& name : list_folder(folders.depth))
        if (has_ending(name, ".png") && stamp_of(name) >= 0) names.push_back(std::move(name));
    std::sort(names.begin(), names.end(),
              [](const std::string& a, const std::string& b) { return stamp_of(a) < stamp_of(b); });
    ImageInfo info;
    std::size_t without = 0;
    for (const std::string& name : names) {
        const std::string stem = name.substr(0, name.size() - 4);
        if (!is_file(folders.cameras + stem + ".json")) {
            ++without;
            continue;
        }
        if (info.width == 0) {
            const Result<ImageInfo> first = read_image_info(folders.depth + name);
            if (!first) return first.status();
            info = *first;
        }
        BURIN_TRY(read_frame(folders, stem, info.width, info.height, &list));
    }
    if (without > 0)
        list.notes += std::to_string(without) + " of " + std::to_string(names.size()) +
                      " depth images left out: no camera file\n";
    if (list.frames.empty())
        return Status::error(Code::format,
                             "%s: none of %zu depth images has a camera file, expected both named by a stamp",
                             folder.c_str(), names.size());
    list.cameras.depth = list.frames.front().cameras->depth;
    list.cameras.colour = list.frames.front().cameras->colour;
    return make_file_dataset(std::move(list));
}

}  // namespace burin
