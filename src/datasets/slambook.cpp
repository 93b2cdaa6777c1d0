// SPDX-License-Identifier: MIT
// The example data of "14 Lectures on Visual SLAM" (Gao, Zhang): color/%d.png, depth/%d.pgm from 1, and
// pose.txt with `tx ty tz qx qy qz qw` (camera to world) a line. Depth in millimetres.
#include <utility>

#include "datasets/file.h"
#include "datasets/file_dataset.h"
#include "datasets/formats.h"

namespace burin {
namespace {

constexpr double kDepthScale = 1000;
constexpr Camera kCamera{640, 480, 518, 519, 325.5, 253.5};  // ch5 of the book's second edition

}  // namespace

bool looks_like_slambook(const std::string& folder) {
    return is_file(folder + "/pose.txt") && is_folder(folder + "/color") && is_folder(folder + "/depth");
}

Result<std::unique_ptr<Dataset>> open_slambook(const std::string& folder) {
    FileList list;
    list.format = "slambook";
    list.folder = folder;
    list.cameras.depth = list.cameras.colour = kCamera;
    list.cameras.depth_scale = kDepthScale;
    const std::string path = folder + "/pose.txt";
    std::string text;
    BURIN_TRY(read_file(path, kMaxTextBytes, &text));
    LineReader lines(text);
    std::string_view line;
    while (lines.next_content(&line)) {
        std::string_view words[7];
        double v[7];
        bool ok = split_words(line, words, 7) == 7;
        for (int i = 0; ok && i < 7; ++i) ok = parse_number(words[i], &v[i]);
        if (!ok)
            return Status::error(Code::format, "%s:%d: '%s', expected tx ty tz qx qy qz qw", path.c_str(),
                                 lines.number(), printable(line).c_str());
        Result<Se3> T = se3_from_quaternion({v[0], v[1], v[2]}, {v[3], v[4], v[5], v[6]});
        if (!T)
            return Status::error(Code::format, "%s:%d: %s, expected a rigid camera-to-world pose",
                                 path.c_str(), lines.number(), T.status().text());
        FrameFiles frame;
        const std::string number = std::to_string(list.frames.size() + 1);
        frame.depth_path = folder + "/depth/" + number + ".pgm";
        frame.colour_path = folder + "/color/" + number + ".png";
        frame.t_ns = frame.colour_t_ns = stamp_at_30_hz(static_cast<std::int64_t>(list.frames.size()));
        frame.has_pose = true;
        frame.T_world_camera = *T;
        list.frames.push_back(std::move(frame));
    }
    return make_file_dataset(std::move(list));
}

}  // namespace burin
