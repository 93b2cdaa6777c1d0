// SPDX-License-Identifier: MIT
// The log of Kintinuous and ElasticFusion (Whelan et al.). Facts from github.com/mp3guy/Logger2
// (src/Logger2.cpp, the writer) and github.com/mp3guy/ElasticFusion (GUI/src/Tools/RawLogReader.cpp,
// JPEGLoader.h): i32 frames (written when the log is closed, 0 before), then each frame: i64 stamp in
// microseconds, i32 bytes of depth, i32 bytes of colour, depth, colour. Depth is u16 millimetres, raw when it
// has just the bytes of the pixels, else zlib; colour RGB likewise, else JPEG, into which the writer puts red
// and blue the wrong way round. The log says no size, no intrinsics and no poses:
//   camera.txt beside the log (Burin's own), else ElasticFusion's default 528 528 320 240 at 640x480;
//   NAME.klg.freiburg, the trajectory that ElasticFusion leaves there, in TUM's form.
#include "datasets/klg.h"

#include <cmath>
#include <cstring>
#include <utility>

#include "datasets/arkit.h"
#include "datasets/file.h"
#include "datasets/formats.h"
#include "datasets/image_file.h"
#include "datasets/trajectory_file.h"

namespace burin {
namespace {

constexpr double kDepthScale = 1000;
constexpr Camera kDefaultCamera{640, 480, 528, 528, 320, 240};  // ElasticFusion, GUI/src/MainController.cpp
constexpr std::size_t kFrameBytes = 16;
constexpr std::int64_t kMostMicroseconds = 9'200'000'000'000'000;  // what fits int64 nanoseconds

// False when the rest of the file is shorter than the frame.
Result<bool> read_frame(PackedList* list, std::size_t index, std::uint64_t* at) {
    const RandomFile& file = list->file;
    if (file.size() - *at < kFrameBytes) return false;
    char bytes[kFrameBytes];
    BURIN_TRY(file.read(*at, sizeof bytes, bytes));
    std::int64_t t_us;
    std::int32_t depth, colour;
    std::memcpy(&t_us, bytes, 8);
    std::memcpy(&depth, bytes + 8, 4);
    std::memcpy(&colour, bytes + 12, 4);
    if (depth <= 0 || colour < 0 || static_cast<std::uint32_t>(depth) > kMaxPackedImage ||
        static_cast<std::uint32_t>(colour) > kMaxPackedImage || t_us < 0 || t_us > kMostMicroseconds)
        return Status::error(
            Code::format,
            "%s: frame %zu at byte %llu: stamp %lld, %d bytes of depth, %d of colour, expected "
            "microseconds and sizes of images",
            file.path().c_str(), index, static_cast<unsigned long long>(*at), static_cast<long long>(t_us),
            depth, colour);
    PackedFrame frame;
    frame.depth = {*at + kFrameBytes, static_cast<std::uint32_t>(depth)};
    frame.colour = {frame.depth.offset + frame.depth.bytes, static_cast<std::uint32_t>(colour)};
    frame.t_ns = frame.colour_t_ns = t_us * 1000;
    const std::uint64_t end = frame.colour.offset + frame.colour.bytes;
    if (end > file.size()) return false;
    *at = end;
    list->frames.push_back(frame);
    return true;
}

Status fill_sizes(PackedList* list) {
    CameraFile& cameras = list->cameras;
    if (cameras.depth.width == 0) {
        const PackedFrame& first = list->frames.front();
        int width = 640, height = 480;
        if (first.colour.bytes == 320u * 240 * 3 || first.depth.bytes == 320u * 240 * 2)
            width = 320, height = 240;
        std::string bytes;
        if (first.colour.bytes > 0) {
            BURIN_TRY(list->file.read(first.colour.offset, first.colour.bytes, &bytes));
            if (const Result<ImageInfo> info = decode_image_info(bytes, list->file.path()); info.ok())
                width = info->width, height = info->height;
        }
        cameras.depth.width = width;
        cameras.depth.height = height;
    }
    if (cameras.colour.width == 0) {
        cameras.colour.width = cameras.depth.width;
        cameras.colour.height = cameras.depth.height;
    }
    return {};
}

Status read_cameras(const std::string& path, PackedList* list) {
    const std::size_t slash = path.rfind('/');
    const std::string beside = (slash == std::string::npos ? "" : path.substr(0, slash + 1)) + "camera.txt";
    if (is_file(beside)) {
        Result<CameraFile> file = read_camera_text(beside);
        if (!file) return file.status();
        list->cameras = *file;
    } else {
        list->notes += "no camera.txt beside the log: ElasticFusion's default 528 528 320 240\n";
    }
    if (list->cameras.depth_scale == 0) list->cameras.depth_scale = kDepthScale;
    return {};
}

Status read_poses(const std::string& path, PackedList* list) {
    if (!is_file(path)) {
        note_missing_poses(list, "no .klg.freiburg beside the log");
        return {};
    }
    Result<Trajectory> trajectory = read_tum_trajectory(path);
    if (!trajectory) return trajectory.status();
    for (PackedFrame& frame : list->frames) {
        const MaybePose pose = pose_at(*trajectory, frame.t_ns);
        frame.has_pose = pose.known;
        frame.T_world_camera = pose.T_world_camera;
    }
    note_missing_poses(list, "outside the trajectory, or in a gap of more than 100 ms");
    return {};
}

}  // namespace

Status read_klg(PackedList* list) {
    const RandomFile& file = list->file;
    std::int32_t count;
    BURIN_TRY(file.read(0, sizeof count, &count));
    if (count < 0 || static_cast<std::uint64_t>(count) > (file.size() - 4) / kFrameBytes)
        return Status::error(Code::format, "%s: %d frames cannot lie in %llu bytes, expected a whole log",
                             file.path().c_str(), count, static_cast<unsigned long long>(file.size()));
    std::uint64_t at = 4;
    const bool closed = count > 0;
    while (!closed || list->frames.size() < static_cast<std::size_t>(count)) {
        const Result<bool> got = read_frame(list, list->frames.size(), &at);
        if (!got) return got.status();
        if (*got) continue;
        if (closed)
            return Status::error(Code::format, "%s: ends at byte %llu in frame %zu, expected %d frames",
                                 file.path().c_str(), static_cast<unsigned long long>(file.size()),
                                 list->frames.size(), count);
        break;
    }
    if (list->frames.empty())
        return Status::error(Code::format, "%s: holds 0 frames, expected at least 1", file.path().c_str());
    if (!closed) {
        list->notes += "the log was not closed: it ends with its last whole frame\n";
        if (at < file.size())
            list->notes += std::to_string(file.size() - at) + " bytes of an unfinished frame are left out\n";
    }
    list->raw_depth_by_size = list->raw_colour = list->swap_red_blue = true;
    BURIN_TRY(fill_sizes(list));
    return {};
}

bool looks_like_klg(const std::string& path) { return has_ending(path, ".klg") && is_file(path); }

Result<std::unique_ptr<Dataset>> open_klg(const std::string& path) {
    PackedList list;
    list.format = "klg";
    BURIN_TRY(list.file.open(path));
    BURIN_TRY(read_cameras(path, &list));
    BURIN_TRY(read_klg(&list));
    if (list.cameras.depth.fx == 0)
        list.cameras.depth = list.cameras.colour =
            scaled_camera(kDefaultCamera, list.cameras.depth.width, list.cameras.depth.height);
    mend_stamps(&list);
    BURIN_TRY(read_poses(path + ".freiburg", &list));
    return make_packed_dataset(std::move(list));
}

}  // namespace burin
