// SPDX-License-Identifier: MIT
// The recorder's own format, docs/recording.md: frames as they were paired when they were recorded.
#include <algorithm>
#include <mutex>
#include <utility>

#include "capture/recording_reader.h"
#include "datasets/file.h"
#include "datasets/formats.h"

namespace burin {
namespace {

class Recording final : public Dataset {
  public:
    Status open(const std::string& folder);
    const char* format() const override { return "recording"; }
    int frame_count() const override { return static_cast<int>(frames_.size()); }
    Status load(int index, Frame* out) const override;
    std::string notes() const override;

  private:
    // What decodes, one for each thread that loads at a time.
    struct Worker {
        RecordedImages images;
        std::vector<std::uint8_t> pixels;  // of colour, and of depth before it is copied
    };
    Result<std::unique_ptr<Worker>> take_worker() const;
    Status load(int index, Worker* worker, Frame* out) const;
    Status load_colour(std::uint64_t offset, Worker* worker, Frame* out) const;
    Status load_confidence(std::uint64_t offset, Worker* worker, Frame* out) const;

    RecordingReader reader_;
    std::vector<int> frames_;  // those with depth
    mutable std::mutex mutex_;
    mutable std::vector<std::unique_ptr<Worker>> idle_;
};

constexpr int kDepth = static_cast<int>(StreamKind::depth), kColour = static_cast<int>(StreamKind::colour),
              kConfidence = static_cast<int>(StreamKind::confidence);

template <class T>
void clear(Image<T>* image) {
    image->pixels.clear();  // keeps the buffer
    image->width = image->height = 0;
}

template <class T>
void resize(Image<T>* image, int width, int height, int channels) {
    image->width = width;
    image->height = height;
    image->channels = channels;
    image->pixels.resize(std::size_t(width) * static_cast<std::size_t>(height) *
                         static_cast<std::size_t>(channels));
}

Status Recording::open(const std::string& folder) {
    BURIN_TRY(reader_.open(folder.c_str()));
    if (!reader_.info().has(StreamKind::depth))
        return Status::error(Code::format, "%s: was recorded without depth", reader_.path());
    for (int i = 0; i < reader_.frame_count(); ++i)
        if (reader_.frame(i).recorded.images[kDepth] != 0) frames_.push_back(i);
    if (frames_.empty())
        return Status::error(Code::format, "%s: holds 0 frames with depth, expected at least 1",
                             reader_.path());
    return {};
}

Result<std::unique_ptr<Recording::Worker>> Recording::take_worker() const {
    {
        const std::lock_guard lock(mutex_);
        if (!idle_.empty()) {
            auto worker = std::move(idle_.back());
            idle_.pop_back();
            return worker;
        }
    }
    auto worker = std::make_unique<Worker>();
    BURIN_TRY(worker->images.reserve(reader_));
    return worker;
}

Status Recording::load(int index, Frame* out) const {
    if (index < 0 || index >= frame_count())
        return Status::error(Code::invalid_argument, "%s: frame %d, expected 0..%d", reader_.path(), index,
                             frame_count() - 1);
    Status status;
    try {
        auto worker = take_worker();
        if (!worker.ok()) return worker.status();
        status = load(frames_[static_cast<std::size_t>(index)], worker->get(), out);
        const std::lock_guard lock(mutex_);
        idle_.push_back(std::move(*worker));
    } catch (...) {
        status = Status::error(Code::insufficient_memory, "%s: no memory to decode frame %d", reader_.path(),
                               index);
    }
    if (!status) {  // never half a frame
        clear(&out->depth_u16);
        clear(&out->confidence);
        clear(&out->colour);
        out->imu.clear();
    }
    return status;
}

Status Recording::load_colour(std::uint64_t offset, Worker* worker, Frame* out) const {
    const StreamInfo& s = reader_.info().at(StreamKind::colour);
    worker->pixels.resize(RecordedImages::image_room(s));
    RecordHead head;
    BURIN_TRY(worker->images.read(reader_, offset, StreamKind::colour, &head, &out->colour_camera,
                                  worker->pixels.data()));
    const ColourRows rows = packed_colour(decoded_stream(s, head.codec), worker->pixels.data());
    resize(&out->colour, s.width, s.height, 3);
    for (int y = 0; y < s.height; ++y)
        row_to_rgb(rows, y,
                   out->colour.pixels.data() + 3 * std::size_t(s.width) * static_cast<std::size_t>(y));
    out->colour_t_ns = head.t_ns;
    out->T_colour_depth = s.T_stream_depth;
    return {};
}

// A level a depth pixel; of another size it says nothing about them and is left out.
Status Recording::load_confidence(std::uint64_t offset, Worker* worker, Frame* out) const {
    const StreamInfo& s = reader_.info().at(StreamKind::confidence);
    if (s.width != out->depth_u16.width || s.height != out->depth_u16.height || s.pixels != StreamPixels::u8)
        return {};
    resize(&out->confidence, s.width, s.height, 1);
    RecordHead head;
    Camera camera;
    out->min_confidence = reader_.header().streams[kConfidence].min_confidence;
    return worker->images.read(reader_, offset, StreamKind::confidence, &head, &camera,
                               out->confidence.pixels.data());
}

Status Recording::load(int index, Worker* worker, Frame* out) const {
    const RecordingReader::Frame& frame = reader_.frame(index);
    const RecordedFrame& recorded = frame.recorded;
    const StreamInfo& s = reader_.info().at(StreamKind::depth);
    clear(&out->depth_f32);
    clear(&out->confidence);
    resize(&out->depth_u16, s.width, s.height, 1);
    RecordHead head;
    BURIN_TRY(
        worker->images.read(reader_, recorded.images[kDepth], StreamKind::depth, &head, &out->depth_camera,
                            static_cast<std::uint8_t*>(static_cast<void*>(out->depth_u16.pixels.data()))));
    out->t_ns = frame.t_ns;
    out->depth_unit_m = s.unit_m;
    if (recorded.images[kColour] != 0) {
        BURIN_TRY(load_colour(recorded.images[kColour], worker, out));
    } else {
        clear(&out->colour);
        out->colour_camera = s.camera;
        out->colour_t_ns = frame.t_ns;
        out->T_colour_depth = Se3();
    }
    out->has_pose = recorded.has_pose == 1;
    out->T_world_camera = Se3();
    if (out->has_pose) {
        // Its bits are those that were recorded; the check is for what a damaged writer may have left.
        out->T_world_camera = pose_of(recorded.T_world_camera);
        if (!pose_is_rigid(recorded.T_world_camera))
            return Status::error(Code::format, "%s: frame %d: its pose is no rigid motion", reader_.path(),
                                 index);
    }
    if (recorded.images[kConfidence] != 0)
        BURIN_TRY(load_confidence(recorded.images[kConfidence], worker, out));
    int count = 0;
    const ImuSample* samples = reader_.imu(recorded, &count);
    out->imu.assign(samples, samples + count);
    out->T_camera_imu = reader_.info().T_camera_imu;
    return {};
}

std::string Recording::notes() const {
    const RecordingReader::Findings& f = reader_.findings();
    std::string notes;
    const auto note = [&](std::uint64_t count, const char* text) {
        if (count > 0) notes += std::to_string(count) + " " + text + "\n";
    };
    if (!f.closed) notes += "the recording was not closed: it ends with its last whole record\n";
    note(f.torn_bytes, "bytes of an unfinished record at the end are left out");
    note(f.damaged_bytes, "bytes in the middle are damaged and left out");
    note(f.incomplete_frames, "frames are incomplete and left out");
    note(f.dropped_frames, "frames were dropped by the recorder");
    note(f.lost_images[kDepth], "depth images were lost by the sensor");
    note(f.lost_images[kColour], "colour images were lost by the sensor");
    note(static_cast<std::uint64_t>(reader_.frame_count()) - frames_.size(), "frames have no depth");
    return notes;
}

}  // namespace

bool looks_like_recording(const std::string& folder) { return is_file(folder + "/" + kRecordingName); }

Result<std::unique_ptr<Dataset>> open_recording(const std::string& folder) {
    auto recording = std::make_unique<Recording>();
    BURIN_TRY(recording->open(folder));
    return std::unique_ptr<Dataset>(std::move(recording));
}

}  // namespace burin
