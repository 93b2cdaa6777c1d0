// SPDX-License-Identifier: MIT
// The recorder: frames of a source into an append-only file, on a thread of its own. Killed at any byte, the
// file opens to its last whole record; a disk that is full ends the recording, not the source. The bytes:
// docs/recording.md.
#pragma once

#include <pthread.h>

#include <condition_variable>
#include <memory>
#include <mutex>

#include "capture/recording_file.h"
#include "capture/recording_images.h"
#include "capture/recording_queue.h"
#include "capture/rolling.h"

namespace burin {

struct RecordingOptions {
    // add() waits for room; else a frame that finds none is dropped and counted.
    bool lossless = false;
    // That may wait for the thread, 1..256. At 30 a second half a second of a disk that does not answer; a
    // VGA pair takes 1.5 MB.
    int queue_frames = 15;
    RecordedColour colour = RecordedColour::jpeg;
    // 1..100. At 90 the mean error in a sensor's image is below its noise.
    int jpeg_quality = 90;
    // For whoever replays it: depth with less confidence counts as none (FrameView::min_confidence).
    std::uint8_t min_confidence = 0;
    // The disk is made to hold what was written every so long, so a power cut loses no more. 0: only at the
    // end. A process that is killed loses what waits in the queue, whatever this is.
    std::int64_t sync_ns = 2'000'000'000;
};

enum class RecordingState : std::uint8_t {
    closed,
    recording,
    full,    // the disk has no room: the file ends with its last whole record; still so once it is closed
    failed,  // the disk refused otherwise: the same
};
const char* state_name(RecordingState state);

struct RecordingStatistics {
    RecordingState state = RecordingState::closed;
    std::uint64_t frames = 0;   // written
    std::uint64_t dropped = 0;  // found no room in the queue, or came after the disk had refused
    std::uint64_t imu_samples = 0, imu_lost = 0;
    std::uint64_t file_bytes = 0;
    std::uint64_t image_bytes = 0, coded_bytes = 0;  // of the images written: their pixels, and in the file
    std::uint64_t queue_bytes = 0;
    int queue_high_water = 0;  // frames
    // Of the last 256 frames: to code and write one, milliseconds.
    double write_p50_ms = 0, write_p95_ms = 0, write_max_ms = 0;
};

class RecordingWriter {
  public:
    RecordingWriter() = default;
    ~RecordingWriter() { (void)close(); }
    RecordingWriter(const RecordingWriter&) = delete;
    RecordingWriter& operator=(const RecordingWriter&) = delete;

    // A new recording in `folder`, which is made when its parent is there. source: where the frames come
    // from, for people. Allocates everything; after it nothing is (but by libjpeg: jpeg_codec.h). Errors:
    // invalid_argument, io (there is one already, or the disk refuses), insufficient_memory.
    Status open(const char* folder, const char* source, const DeviceInfo& info,
                const RecordingOptions& options);
    // The same into a file of the caller's that is empty and outlives close(). `name` stands for it in
    // messages.
    Status open(RecordingFile* file, const char* name, const char* source, const DeviceInfo& info,
                const RecordingOptions& options);

    // Copies the frame and returns; waits only in lossless mode. By one thread at a time. An image that the
    // frame before had too (same sequence and stamps) is written once. ok also when the frame is dropped.
    // Errors: state (not open); io: the line that says why recording has ended.
    Status add(const CapturedFrame& frame, const Se3* T_world_camera = nullptr);
    // A line of the source's log, by any thread.
    void log(LogLevel level, const char* line);

    RecordingStatistics statistics() const;
    // Writes what waits, an end record, and waits for the disk. The first error of the recording, if any.
    Status close();

  private:
    Status begin(const char* source, const RecordingOptions& options);
    static void* enter(void* self);
    void run();
    bool write_lines();
    bool write_imu(std::uint64_t end);
    bool write_frame(RecordingQueue::Frame& frame);
    bool write_image(RecordingQueue::Frame& frame, int kind, std::uint64_t* offset);
    bool write_mark(RecordKind kind);
    // The payload lies behind the head in record_.
    bool write_record(RecordHead head, std::size_t payload);
    bool sync();
    void refuse(int error);

    std::uint8_t* payload() { return record_.get() + sizeof(RecordHead); }

    DiskFile disk_;
    RecordingFile* file_ = nullptr;
    char name_[300] = "";
    DeviceInfo info_;
    RecordingOptions options_;

    // The thread's own.
    ImageEncoder encoder_;
    std::unique_ptr<std::uint8_t[]> record_;
    std::uint64_t end_ = 0;  // of the last whole record
    std::uint64_t last_offset_[kStreamKinds] = {};
    std::uint64_t unflushed_ = 0, dropped_written_ = 0;
    std::int64_t synced_ns_ = 0;
    std::uint64_t synced_end_ = 0;

    mutable std::mutex mutex_;  // of all below
    std::condition_variable work_, room_;
    RecordingQueue queue_;
    RecordingStatistics statistics_;
    Rolling write_ms_;
    Status failure_;
    std::uint64_t frames_ = 0;  // numbers, which are those of frames taken
    bool pending_ = false;      // readings of frames that were dropped go to the next
    std::uint64_t pending_first_ = 0;
    bool stopping_ = false, running_ = false;
    pthread_t thread_ = {};
};

}  // namespace burin
