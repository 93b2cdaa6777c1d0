// SPDX-License-Identifier: MIT
// A recording to read: its index is made by going through the heads of its records, so that a file whose
// writer was killed, or that is being written, opens to its last whole record. Damage in the middle costs the
// frames it lies in.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>

#include "capture/recording_images.h"

namespace burin {

// A list that tells when there is no memory.
template <class T>
class RecordedList {
  public:
    RecordedList() = default;
    ~RecordedList() { std::free(items_); }
    RecordedList(const RecordedList&) = delete;
    RecordedList& operator=(const RecordedList&) = delete;

    bool add(const T& item) {
        if (count_ == room_) {
            const std::size_t room = room_ < 64 ? 64 : 2 * room_;
            auto* grown = static_cast<T*>(std::realloc(static_cast<void*>(items_), room * sizeof(T)));
            if (!grown) return false;
            items_ = grown;
            room_ = room;
        }
        new (items_ + count_++) T(item);
        return true;
    }
    void clear() { count_ = 0; }
    void cut(std::size_t count) { count_ = count < count_ ? count : count_; }
    std::size_t size() const { return count_; }
    const T& operator[](std::size_t i) const { return items_[i]; }

  private:
    static_assert(std::is_trivially_copyable_v<T>);
    T* items_ = nullptr;
    std::size_t count_ = 0, room_ = 0;
};

class RecordingReader {
  public:
    struct Frame {
        std::int64_t t_ns = 0;
        RecordedFrame recorded;
    };
    // What opening found beside whole frames.
    struct Findings {
        bool closed = false;                  // it ends as close() left it
        std::uint64_t torn_bytes = 0;         // behind the last whole record
        std::uint64_t damaged_bytes = 0;      // passed over in the middle
        std::uint64_t incomplete_frames = 0;  // whose images are in none of the whole records
        std::uint64_t dropped_frames = 0;     // by the recorder, as it says
        std::uint64_t lost_images[kStreamKinds] = {};
    };

    RecordingReader() = default;
    ~RecordingReader();
    RecordingReader(const RecordingReader&) = delete;
    RecordingReader& operator=(const RecordingReader&) = delete;

    // A file, or a folder that holds one of the usual name. Errors: io (not there), format (no recording, of
    // another version, its header is damaged or absurd), insufficient_memory.
    Status open(const char* path);
    void close();
    const char* path() const { return path_; }

    const RecordedHeader& header() const { return header_; }
    // As the device was; jpeg colour is decoded to RGB (decoded_stream).
    const DeviceInfo& info() const { return info_; }
    int frame_count() const { return static_cast<int>(frames_.size()); }
    const Frame& frame(int index) const { return frames_[static_cast<std::size_t>(index)]; }
    const Findings& findings() const { return findings_; }
    // The frame's readings, or none when some of them are in no whole record.
    const ImuSample* imu(const RecordedFrame& frame, int* count) const;

    // The next lines of the log: *offset is 0 at first. False after the last.
    bool next_line(std::uint64_t* offset, LogLevel* level, char (&line)[257]) const;

    // The image record at an offset that a frame names: its head, and its payload behind the camera into
    // `out` (room for max_payload()). Safe on several threads at once. Errors: io, format (damaged).
    Status read_image(std::uint64_t offset, RecordHead* head, Camera* camera, std::uint8_t* out,
                      std::size_t* bytes) const;
    bool read_head(std::uint64_t offset, RecordHead* head) const;
    std::size_t max_payload() const { return max_payload_; }

  private:
    struct Image {
        std::uint64_t offset;
        std::uint32_t stream;
    };
    Status read_header();
    Status check_header();
    Status scan();
    bool take(std::uint64_t at, const RecordHead& head, const std::uint8_t* payload);
    bool take_imu(const std::uint8_t* payload, std::size_t bytes);
    bool take_frame(const RecordHead& head, const std::uint8_t* payload);
    bool payload_is_whole(std::uint64_t at, const RecordHead& head) const;
    std::uint64_t find_record(std::uint64_t from) const;
    bool read(std::uint64_t at, void* to, std::size_t bytes) const;

    int fd_ = -1;
    std::uint64_t size_ = 0;
    char path_[1024] = "";
    RecordedHeader header_;
    DeviceInfo info_;
    Findings findings_;
    RecordedList<Frame> frames_;
    RecordedList<Image> images_;
    RecordedList<ImuSample> imu_;
    RecordedList<std::uint64_t> lines_;
    std::uint64_t imu_gap_ = 0;  // readings that are in no whole record
    std::size_t max_payload_ = 0;
};

// Images of a recording to pixels: a reader's payloads and a decoder. One thread at a time; nothing is
// allocated after reserve() (but by libjpeg).
class RecordedImages {
  public:
    Status reserve(const RecordingReader& reader);
    // Into `out`, packed as decoded_stream(info().at(kind), head->codec) says.
    Status read(const RecordingReader& reader, std::uint64_t offset, StreamKind kind, RecordHead* head,
                Camera* camera, std::uint8_t* out);
    // Room for one image of any kind of this recording.
    static std::size_t image_room(const StreamInfo& stream);

  private:
    std::unique_ptr<std::uint8_t[]> payload_;
    ImageDecoder decoder_;
};

}  // namespace burin
