// SPDX-License-Identifier: MIT
// Inside of the room: a data set that is a list of image files with poses. Each format fills the list;
// reading, checking and decoding are the same for all.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/dataset.h"
#include "core/imu.h"
#include "datasets/arkit.h"
#include "datasets/camera_file.h"
#include "datasets/video.h"

namespace burin {

struct FrameCameras {
    Camera depth, colour;
};

struct FrameFiles {
    std::string depth_path;
    std::string colour_path;              // empty: the frame has no colour
    int video_picture = -1;               // not negative: colour is this picture of FileList::video
    std::string confidence_path;          // empty: none; an 8-bit image of the size of the depth image
    std::optional<FrameCameras> cameras;  // of this frame alone; otherwise those of the list
    std::int64_t t_ns = 0, colour_t_ns = 0;
    bool has_pose = false;
    Se3 T_world_camera;
};

struct FileList {
    const char* format = "";
    std::string folder;  // for messages
    std::vector<FrameFiles> frames;
    CameraFile cameras;  // sizes left 0 are taken from the first frame; depth_scale must be set
    // What the confidence image's values stand for, and what counts as depth.
    ConfidenceScale confidence_scale = ConfidenceScale::levels;
    std::uint8_t min_confidence = kDefaultMinConfidence;
    std::vector<ImuSample> imu;  // of the whole recording, stamps rising; frames' stamps must rise too
    std::shared_ptr<Video> video;
    std::string notes;  // lines, each ended by '\n'
};

// Checks that there are frames, that every file named is there, and the cameras. Images are decoded frame by
// frame in load(). A depth path that ends in ".depth" is POV-Ray's text of ray lengths in metres (ICL-NUIM).
Result<std::unique_ptr<Dataset>> make_file_dataset(FileList list);

// Stamps for formats that have none: all recorded or rendered at 30 Hz. Exact in integers, no drift.
std::int64_t stamp_at_30_hz(std::int64_t index);

// Says in the notes how many frames have no pose, when that is so.
void note_missing_poses(FileList* list, const char* why);

// ASCII ray lengths to depth along the optical axis: z = length / |ray with z = 1|, metres. Pure, for the
// fuzzer.
Status parse_povray_depth(std::string_view text, const std::string& name, const Camera& camera,
                          Image<float>* depth_m);

}  // namespace burin
