// SPDX-License-Identifier: MIT
// Stray Scanner, an iOS app. Facts from github.com/strayrobots/scanner: docs/format.md and, where it is
// silent, the app's writers (OdometryEncoder, IMUEncoder, DatasetEncoder, VideoEncoder .swift).
//   camera_matrix.csv  of the pictures of rgb.mp4
//   odometry.csv       camera to world; the world is ARKit's, y up, the camera's axes OpenCV's
//   depth/NNNNNN.png   256x192, 16 bits, millimetres, registered to colour; confidence/NNNNNN.png 0 1 2
//   rgb.mp4            a picture for each row of odometry.csv, HEVC
//   imu.csv            CoreMotion's raw readings: the current app writes g, format.md says m/s^2; the
//   readings
//                      themselves tell
#include "datasets/stray.h"

#include <cstdio>
#include <utility>

#include "datasets/file.h"
#include "datasets/file_dataset.h"
#include "datasets/formats.h"
#include "datasets/image_file.h"
#include "datasets/mp4_size.h"

namespace burin {
namespace {

constexpr double kDepthScale = 1000;
constexpr int kVideoWidth = 1920, kVideoHeight = 1440;  // ARKit's video on every phone with LiDAR
// CoreMotion's axes on a phone held upright: x right, y up, z out of the screen. ARKit's camera has x along
// the long side towards the bottom (ARCamera.transform), so in OpenCV's axes x = -y, y = -x, z = -z. The
// offset between them, some centimetres, is nowhere written and taken as none.
constexpr Mat3d kR_camera_imu{{0, -1, 0, -1, 0, 0, 0, 0, -1}};

Status read_text(const std::string& path, std::string* text) { return read_file(path, kMaxTextBytes, text); }

std::string numbered(const std::string& folder, const char* part, std::int64_t frame) {
    char name[24];
    std::snprintf(name, sizeof name, "%06lld.png", static_cast<long long>(frame));
    return folder + "/" + part + "/" + name;
}

// Size of colour, and its pictures where this build can read them.
Status read_video(FileList* list, Camera* colour) {
    const std::string path = list->folder + "/rgb.mp4";
    colour->width = kVideoWidth;
    colour->height = kVideoHeight;
    if (!is_file(path)) {
        list->notes += "no rgb.mp4: depth alone, intrinsics taken as those of 1920x1440\n";
        return {};
    }
    RandomFile file;
    BURIN_TRY(file.open(path));
    const Result<PictureSize> size = mp4_picture_size(file);
    if (!size) return size.status();
    colour->width = size->width;
    colour->height = size->height;
    if (!video_is_built()) {
        list->notes +=
            "COLOUR IS LEFT OUT: this build cannot read rgb.mp4, it was built without FFmpeg's libraries\n";
        return {};
    }
    Result<std::unique_ptr<Video>> video = open_video(path);
    if (!video) return video.status();
    colour->width = (*video)->width();
    colour->height = (*video)->height();
    list->video = std::move(*video);
    return {};
}

Status read_cameras(FileList* list) {
    const std::string path = list->folder + "/camera_matrix.csv";
    std::string text;
    BURIN_TRY(read_text(path, &text));
    const Result<StrayMatrix> K = parse_stray_matrix(text, path);
    if (!K) return K.status();
    Camera& colour = list->cameras.colour;
    BURIN_TRY(read_video(list, &colour));
    colour.fx = K->fx, colour.fy = K->fy, colour.cx = K->cx, colour.cy = K->cy;
    list->cameras.depth_scale = kDepthScale;
    const Result<ImageInfo> info = read_image_info(list->frames.front().depth_path);
    if (!info) return info.status();
    list->cameras.depth = scaled_camera(colour, info->width, info->height);
    return {};
}

Status read_frames(const std::string& folder, FileList* list, int* rows) {
    std::string text;
    BURIN_TRY(read_text(folder + "/odometry.csv", &text));
    const Result<std::vector<StrayPose>> poses = parse_stray_odometry(text, folder + "/odometry.csv");
    if (!poses) return poses.status();
    int row = 0, without_depth = 0, without_confidence = 0;
    for (const StrayPose& pose : *poses) {
        FrameFiles frame;
        frame.video_picture = row++;
        frame.depth_path = numbered(folder, "depth", pose.frame);
        frame.confidence_path = numbered(folder, "confidence", pose.frame);
        frame.t_ns = frame.colour_t_ns = pose.t_ns;
        frame.has_pose = true;
        frame.T_world_camera = pose.T_world_camera;
        if (!is_file(frame.depth_path)) {
            ++without_depth;
            continue;
        }
        if (!is_file(frame.confidence_path)) {
            ++without_confidence;
            frame.confidence_path.clear();
        }
        list->frames.push_back(std::move(frame));
    }
    *rows = row;
    const std::string of = " of " + std::to_string(poses->size());
    if (without_depth > 0)
        list->notes += std::to_string(without_depth) + of + " frames left out: no depth image\n";
    if (without_confidence > 0)
        list->notes += std::to_string(without_confidence) + of + " frames have no confidence image\n";
    if (list->frames.empty())
        return Status::error(Code::format,
                             "%s: none of %zu frames has a depth image, expected depth/%%06d.png",
                             folder.c_str(), poses->size());
    return {};
}

}  // namespace

bool looks_like_stray(const std::string& folder) {
    return is_file(folder + "/odometry.csv") && is_file(folder + "/camera_matrix.csv");
}

Result<std::unique_ptr<Dataset>> open_stray(const std::string& folder) {
    FileList list;
    list.format = "stray";
    list.folder = folder;
    int rows = 0;
    BURIN_TRY(read_frames(folder, &list, &rows));
    BURIN_TRY(read_cameras(&list));
    if (list.video && list.video->frame_count() > rows)
        list.notes += "rgb.mp4 has " + std::to_string(list.video->frame_count()) + " pictures for " +
                      std::to_string(rows) + " rows of odometry.csv: the first ones are taken\n";
    if (!list.video)
        for (FrameFiles& frame : list.frames) frame.video_picture = -1;
    if (list.video && list.frames.back().video_picture >= list.video->frame_count())
        return Status::error(Code::format,
                             "%s/rgb.mp4: %d pictures, expected one for each of the %d rows of odometry.csv",
                             folder.c_str(), list.video->frame_count(), list.frames.back().video_picture + 1);
    if (const std::string path = folder + "/imu.csv"; is_file(path)) {
        std::string text;
        BURIN_TRY(read_text(path, &text));
        Result<StrayImu> imu = parse_stray_imu(text, path);
        if (!imu) return imu.status();
        list.imu = std::move(imu->samples);
        list.notes += imu->note;
        list.cameras.T_camera_imu.R = kR_camera_imu;
    }
    return make_file_dataset(std::move(list));
}

}  // namespace burin
