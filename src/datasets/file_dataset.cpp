// SPDX-License-Identifier: MIT
#include "datasets/file_dataset.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "datasets/file.h"
#include "datasets/image_file.h"
#include "datasets/imu_file.h"

namespace burin {
namespace {

bool is_povray(const std::string& path) {
    return path.size() > 6 && path.compare(path.size() - 6, 6, ".depth") == 0;
}

Status check_size(const std::string& path, int width, int height, const Camera& camera, const char* what) {
    if (width == camera.width && height == camera.height) return {};
    return Status::error(Code::format, "%s: %s image is %dx%d, expected %dx%d as the %s camera says",
                         path.c_str(), what, width, height, camera.width, camera.height, what);
}

template <class T>
void clear(Image<T>* image) {
    image->pixels.clear();  // keeps the buffer
    image->width = image->height = 0;
}

class FileDataset final : public Dataset {
  public:
    explicit FileDataset(FileList list) : list_(std::move(list)) {}
    const char* format() const override { return list_.format; }
    int frame_count() const override { return static_cast<int>(list_.frames.size()); }
    std::string notes() const override { return list_.notes; }
    Status load(int index, Frame* out) const override;

  private:
    Status load_depth(const FrameFiles& files, Frame* out) const;
    Status load_images(const FrameFiles& files, Frame* out) const;
    Status load_confidence(const FrameFiles& files, Frame* out) const;
    FrameCameras cameras_of(const FrameFiles& files) const {
        return files.cameras ? *files.cameras : FrameCameras{list_.cameras.depth, list_.cameras.colour};
    }

    FileList list_;
};

Status FileDataset::load_depth(const FrameFiles& files, Frame* out) const {
    const Camera camera = cameras_of(files).depth;
    if (!is_povray(files.depth_path)) {
        clear(&out->depth_f32);
        BURIN_TRY(read_depth(files.depth_path, &out->depth_u16));
        return check_size(files.depth_path, out->depth_u16.width, out->depth_u16.height, camera, "depth");
    }
    clear(&out->depth_u16);
    std::string text;
    BURIN_TRY(read_file(files.depth_path, kMaxTextBytes, &text));
    return parse_povray_depth(text, files.depth_path, camera, &out->depth_f32);
}

Status FileDataset::load_images(const FrameFiles& files, Frame* out) const {
    BURIN_TRY(load_depth(files, out));
    BURIN_TRY(load_confidence(files, out));
    if (files.video_picture >= 0) return list_.video->load(files.video_picture, &out->colour);
    if (files.colour_path.empty()) {
        clear(&out->colour);
        return {};
    }
    BURIN_TRY(read_rgb(files.colour_path, &out->colour));
    return check_size(files.colour_path, out->colour.width, out->colour.height, cameras_of(files).colour,
                      "colour");
}

Status FileDataset::load_confidence(const FrameFiles& files, Frame* out) const {
    clear(&out->confidence);
    if (files.confidence_path.empty()) return {};
    BURIN_TRY(read_confidence(files.confidence_path, list_.confidence_scale, &out->confidence));
    return check_size(files.confidence_path, out->confidence.width, out->confidence.height,
                      cameras_of(files).depth, "confidence");
}

Status FileDataset::load(int index, Frame* out) const {
    if (index < 0 || index >= frame_count())
        return Status::error(Code::invalid_argument, "%s: frame %d, expected 0..%d", list_.folder.c_str(),
                             index, frame_count() - 1);
    const FrameFiles& files = list_.frames[static_cast<std::size_t>(index)];
    Status status;
    try {
        status = load_images(files, out);
        out->imu = imu_of_frame(list_.imu, index > 0 ? &list_.frames[std::size_t(index - 1)].t_ns : nullptr,
                                files.t_ns);
    } catch (...) {
        status =
            Status::error(Code::insufficient_memory, "%s: no memory to decode it", files.depth_path.c_str());
    }
    if (!status) {  // never half a frame
        clear(&out->depth_u16);
        clear(&out->depth_f32);
        clear(&out->colour);
        clear(&out->confidence);
        out->imu.clear();
        return status;
    }
    out->t_ns = files.t_ns;
    out->depth_unit_m = is_povray(files.depth_path) ? 1.0 : 1.0 / list_.cameras.depth_scale;
    out->min_confidence = out->confidence.empty() ? std::uint8_t{0} : list_.min_confidence;
    const FrameCameras cameras = cameras_of(files);
    out->depth_camera = cameras.depth;
    out->colour_camera = cameras.colour;
    out->colour_t_ns = files.colour_t_ns;
    out->T_colour_depth = list_.cameras.T_colour_depth;
    out->has_pose = files.has_pose;
    out->T_world_camera = files.T_world_camera;
    out->T_camera_imu = list_.cameras.T_camera_imu;
    return {};
}

// Fills a size the calibration does not say from the first image of that kind.
Status fill_size(const std::string& path, Camera* camera) {
    if (camera->width != 0 && camera->height != 0) return {};
    Result<ImageInfo> info = read_image_info(path);
    if (!info) return info.status();
    if (camera->width == 0) camera->width = info->width;
    if (camera->height == 0) camera->height = info->height;
    return {};
}

}  // namespace

Result<std::unique_ptr<Dataset>> make_file_dataset(FileList list) {
    const char* folder = list.folder.c_str();
    if (list.frames.empty())
        return Status::error(Code::format, "%s: holds 0 frames, expected at least 1", folder);
    if (!(list.cameras.depth_scale > 0))
        return Status::error(Code::format, "%s: depth scale is %g, expected a positive number", folder,
                             list.cameras.depth_scale);
    const std::string* first_colour = nullptr;
    for (const FrameFiles& frame : list.frames) {
        for (const std::string* path : {&frame.depth_path, &frame.colour_path, &frame.confidence_path})
            if (!path->empty() && !is_file(*path))
                return Status::error(Code::io, "%s: is not there, expected an image of frame %td",
                                     path->c_str(), &frame - list.frames.data());
        if (!first_colour && !frame.colour_path.empty()) first_colour = &frame.colour_path;
    }
    CameraFile& cameras = list.cameras;
    if (!is_povray(list.frames[0].depth_path))
        BURIN_TRY(fill_size(list.frames[0].depth_path, &cameras.depth));
    if (first_colour)
        BURIN_TRY(fill_size(*first_colour, &cameras.colour));
    else if (cameras.colour.width == 0 || cameras.colour.height == 0)
        cameras.colour.width = cameras.depth.width, cameras.colour.height = cameras.depth.height;
    for (const auto& [camera, what] :
         {std::pair(&cameras.depth, "depth"), std::pair(&cameras.colour, "colour")})
        if (const Status status = check_camera(*camera, what); !status)
            return Status::error(Code::format, "%s: %s", folder, status.text());
    return std::unique_ptr<Dataset>(std::make_unique<FileDataset>(std::move(list)));
}

std::int64_t stamp_at_30_hz(std::int64_t index) { return index * 1'000'000'000 / 30; }

void note_missing_poses(FileList* list, const char* why) {
    const auto missing = std::count_if(list->frames.begin(), list->frames.end(),
                                       [](const FrameFiles& f) { return !f.has_pose; });
    if (missing == 0) return;
    list->notes += std::to_string(missing) + " of " + std::to_string(list->frames.size()) +
                   " frames have no pose: " + why + "\n";
}

Status parse_povray_depth(std::string_view text, const std::string& name, const Camera& camera,
                          Image<float>* depth_m) {
    // Rooms of this set are under 10 m; larger numbers are the centimetres of Handa's earlier high-frame-rate
    // set.
    constexpr double kLongestRay = 100;
    clear(depth_m);
    const std::size_t expected = std::size_t(camera.width) * static_cast<std::size_t>(camera.height);
    if (text.size() < 2 * expected - 1)  // a digit and a blank each
        return Status::error(Code::format, "%s: %zu bytes, expected %zu ray lengths", name.c_str(),
                             text.size(), expected);
    depth_m->pixels.resize(expected);
    std::size_t at = 0;
    for (std::size_t i = 0; i < expected; ++i) {
        constexpr std::string_view kSpace = " \t\r\n";
        at = std::min(text.find_first_not_of(kSpace, at), text.size());
        const std::size_t end = std::min(text.find_first_of(kSpace, at), text.size());
        const std::string_view word = text.substr(at, end - at);
        double length = 0;
        if (!parse_number(word, &length) || !(length >= 0 && length <= kLongestRay)) {
            clear(depth_m);
            return Status::error(Code::format,
                                 "%s: value %zu of %zu is '%s', expected a ray length of 0..%g m",
                                 name.c_str(), i, expected, printable(word).c_str(), kLongestRay);
        }
        const int x = static_cast<int>(i % static_cast<std::size_t>(camera.width));
        const int y = static_cast<int>(i / static_cast<std::size_t>(camera.width));
        const Vec3d ray = unproject(camera, {double(x), double(y)});
        depth_m->pixels[i] = static_cast<float>(length / norm(ray));
        at = end;
    }
    if (text.find_first_not_of(" \t\r\n", at) != std::string_view::npos) {
        clear(depth_m);
        return Status::error(Code::format, "%s: more than %zu ray lengths, expected one a pixel of %dx%d",
                             name.c_str(), expected, camera.width, camera.height);
    }
    depth_m->width = camera.width;
    depth_m->height = camera.height;
    return {};
}

}  // namespace burin
