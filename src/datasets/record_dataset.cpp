// SPDX-License-Identifier: MIT
#include "datasets/record_dataset.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <vector>

#include "datasets/prefetch.h"

namespace burin {
namespace {

// Of floating-point depth: what TUM and ICL-NUIM use in their PNG files, 13.1 m in 16 bits.
constexpr double kUnit_m = 1.0 / 5000;
// Frames in which a data set must show its colour and its IMU; they come with the first everywhere known.
constexpr int kLook = 30;

StreamInfo stream_of(StreamKind kind, const Camera& camera, int width, int height) {
    StreamInfo s;
    s.kind = kind;
    s.pixels = kind == StreamKind::depth    ? StreamPixels::u16
               : kind == StreamKind::colour ? StreamPixels::colour
                                            : StreamPixels::u8;
    std::snprintf(s.format, sizeof s.format, "%s",
                  kind == StreamKind::depth    ? "Z16"
                  : kind == StreamKind::colour ? "RGB8"
                                               : "levels");
    s.width = width;
    s.height = height;
    s.calibrated = true;
    s.camera = camera;
    s.camera.width = width;
    s.camera.height = height;
    set_image_bytes(&s);
    return s;
}

bool same_pose(const Se3& a, const Se3& b) {
    return std::equal(a.R.m, a.R.m + 9, b.R.m) && a.t.x == b.t.x && a.t.y == b.t.y && a.t.z == b.t.z;
}

// The device that would have delivered these frames.
Status describe(const Dataset& dataset, int begin, int end, DeviceInfo* info, std::uint8_t* min_confidence) {
    Frame frame;
    std::int64_t first_ns = 0;
    std::snprintf(info->name, sizeof info->name, "%s data set", dataset.format());
    for (int i = begin; i < std::min(end, begin + kLook); ++i) {
        BURIN_TRY(dataset.load(i, &frame));
        if (i == begin) {
            first_ns = frame.t_ns;
            const bool metres = frame.depth_u16.empty();
            StreamInfo s = stream_of(StreamKind::depth, frame.depth_camera,
                                     metres ? frame.depth_f32.width : frame.depth_u16.width,
                                     metres ? frame.depth_f32.height : frame.depth_u16.height);
            s.unit_m = metres ? kUnit_m : frame.depth_unit_m;
            info->at(StreamKind::depth) = s;
        } else if (i == begin + 1 && frame.t_ns > first_ns) {
            for (StreamInfo& s : info->streams)
                s.fps = std::min(1e9 / static_cast<double>(frame.t_ns - first_ns), 1e6);
        }
        if (!frame.colour.empty() && !info->has(StreamKind::colour)) {
            StreamInfo s =
                stream_of(StreamKind::colour, frame.colour_camera, frame.colour.width, frame.colour.height);
            s.T_stream_depth = frame.T_colour_depth;
            s.fps = info->at(StreamKind::depth).fps;
            info->at(StreamKind::colour) = s;
        }
        if (!frame.confidence.empty() && !info->has(StreamKind::confidence)) {
            info->at(StreamKind::confidence) = stream_of(StreamKind::confidence, frame.depth_camera,
                                                         frame.confidence.width, frame.confidence.height);
            *min_confidence = frame.min_confidence;
        }
        info->has_imu = info->has_imu || !frame.imu.empty();
        info->T_camera_imu = frame.T_camera_imu;
        if (i > begin && info->has(StreamKind::colour)) break;
    }
    return {};
}

class FrameOfDataset {
  public:
    explicit FrameOfDataset(const DeviceInfo& info) : info_(info) {}

    Status take(const Frame& frame, int index) {
        captured_ = CapturedFrame();
        captured_.t_ns = frame.t_ns;
        BURIN_TRY(check(frame, index));
        if (frame.depth_u16.empty()) {
            round_depth(frame.depth_f32);
            put(StreamKind::depth, depth_.data(), frame.depth_camera, frame.t_ns, index);
        } else {
            put(StreamKind::depth, frame.depth_u16.pixels.data(), frame.depth_camera, frame.t_ns, index);
        }
        if (!frame.colour.empty())
            put(StreamKind::colour, frame.colour.pixels.data(), frame.colour_camera, frame.colour_t_ns,
                index);
        if (!frame.confidence.empty())
            put(StreamKind::confidence, frame.confidence.pixels.data(), frame.depth_camera, frame.t_ns,
                index);
        captured_.imu = frame.imu.data();
        captured_.imu_count = static_cast<int>(frame.imu.size());
        return {};
    }
    const CapturedFrame& captured() const { return captured_; }

  private:
    Status check(const Frame& frame, int index) const {
        const StreamInfo &d = info_.at(StreamKind::depth), &c = info_.at(StreamKind::colour);
        const bool metres = frame.depth_u16.empty();
        const int width = metres ? frame.depth_f32.width : frame.depth_u16.width;
        const int height = metres ? frame.depth_f32.height : frame.depth_u16.height;
        if (width != d.width || height != d.height)
            return Status::error(Code::format, "frame %d: depth of %dx%d, expected %dx%d as in the first",
                                 index, width, height, d.width, d.height);
        if (!metres && frame.depth_unit_m != d.unit_m)
            return Status::error(Code::format, "frame %d: a depth unit of %g m, expected %g as in the first",
                                 index, frame.depth_unit_m, d.unit_m);
        const StreamInfo& levels = info_.at(StreamKind::confidence);
        if (!frame.confidence.empty() &&
            (frame.confidence.width != levels.width || frame.confidence.height != levels.height))
            return Status::error(Code::format, "frame %d: confidence of %dx%d, expected %dx%d as before",
                                 index, frame.confidence.width, frame.confidence.height, levels.width,
                                 levels.height);
        if (frame.colour.empty()) return {};
        if (frame.colour.width != c.width || frame.colour.height != c.height || frame.colour.channels != 3)
            return Status::error(Code::format, "frame %d: colour of %dx%d, expected %dx%d as before", index,
                                 frame.colour.width, frame.colour.height, c.width, c.height);
        if (!same_pose(frame.T_colour_depth, c.T_stream_depth))
            return Status::error(Code::format,
                                 "frame %d: its colour camera has moved against the depth camera, expected "
                                 "one extrinsic for all",
                                 index);
        return {};
    }

    void put(StreamKind kind, const void* pixels, const Camera& camera, std::int64_t t_ns, int index) {
        CapturedImage& image = captured_.images[static_cast<int>(kind)];
        const StreamInfo& s = info_.at(kind);
        image.pixels = static_cast<const std::uint8_t*>(pixels);
        image.stride_bytes = s.row_bytes;
        image.camera = camera;
        image.t_ns = t_ns;
        image.stamp.sequence = static_cast<std::uint64_t>(index);
        image.stamp.host_ns = t_ns;
    }

    void round_depth(const Image<float>& metres) {
        depth_.resize(metres.pixels.size());
        for (std::size_t i = 0; i < depth_.size(); ++i) {
            const double steps = std::round(static_cast<double>(metres.pixels[i]) / kUnit_m);
            depth_[i] = steps > 0 && steps < 65535 ? static_cast<std::uint16_t>(steps) : std::uint16_t{0};
        }
    }

    const DeviceInfo& info_;
    CapturedFrame captured_;
    std::vector<std::uint16_t> depth_;
};

Status record_frames(const Dataset& dataset, int begin, int end, const DeviceInfo& info,
                     RecordingWriter& writer, const std::function<bool(int, int)>& progress) {
    FramePrefetcher prefetcher(dataset, begin, end, 4, 1);
    FrameOfDataset captured(info);
    Frame frame;
    for (int done = 1;; ++done) {
        const Result<bool> got = prefetcher.next(&frame);
        if (!got.ok()) return got.status();
        if (!*got) return {};
        BURIN_TRY(captured.take(frame, prefetcher.index()));
        BURIN_TRY(writer.add(captured.captured(), frame.has_pose ? &frame.T_world_camera : nullptr));
        if (!progress(done, end - begin)) return {};
    }
}

}  // namespace

Status record_dataset(const Dataset& dataset, const std::string& folder, const std::string& source,
                      const RecordDatasetOptions& options, const std::function<bool(int, int)>& progress,
                      RecordingStatistics* statistics) {
    const int end = std::min(options.end, dataset.frame_count());
    if (options.begin < 0 || options.begin >= end)
        return Status::error(Code::invalid_argument, "%s: %d frames, asked for are those from %d on",
                             source.c_str(), dataset.frame_count(), options.begin);
    DeviceInfo info;
    RecordingOptions recording;
    BURIN_TRY(describe(dataset, options.begin, end, &info, &recording.min_confidence));
    recording.lossless = true;
    recording.colour = options.colour;
    recording.jpeg_quality = options.jpeg_quality;
    RecordingWriter writer;
    BURIN_TRY(writer.open(folder.c_str(), source.c_str(), info, recording));
    const Status status = record_frames(dataset, options.begin, end, info, writer, progress);
    const Status closed = writer.close();
    *statistics = writer.statistics();
    return status.ok() ? closed : status;
}

}  // namespace burin
