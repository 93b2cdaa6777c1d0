// SPDX-License-Identifier: MIT
// What waits for the recorder's thread, in memory fixed at the opening: frames, readings of the IMU, lines.
// No locks of its own. A frame is filled by the producer alone and read by the consumer alone.
#pragma once

#include <cstdint>
#include <memory>

#include "capture/live_source.h"
#include "capture/recording_format.h"

namespace burin {

class RecordingQueue {
  public:
    struct Frame {
        std::int64_t t_ns = 0;
        // Pixels packed, in this frame's own memory; null: none. `again`: the same image as in the frame
        // before.
        CapturedImage images[kStreamKinds];
        bool again[kStreamKinds] = {};
        std::uint64_t imu_first = 0;
        std::uint32_t imu_count = 0;
        bool has_pose = false;
        Se3 T_world_camera;
        std::uint64_t dropped = 0;  // frames that found no room, until this one
        std::uint8_t* memory[kStreamKinds] = {};
    };
    struct Line {
        std::int64_t host_ns = 0;
        LogLevel level = LogLevel::info;
        char text[256] = "";
    };

    // False: there is not enough memory.
    bool allocate(const DeviceInfo& info, int frames);
    std::uint64_t bytes() const { return bytes_; }
    int capacity() const { return capacity_; }

    int frames() const { return static_cast<int>(filled_ - emptied_); }
    bool full() const { return frames() == capacity_; }
    // The frame to fill; only when not full().
    Frame& back() { return frames_[filled_ % static_cast<std::uint64_t>(capacity_)]; }
    void push() { ++filled_; }
    Frame& front() { return frames_[emptied_ % static_cast<std::uint64_t>(capacity_)]; }
    void pop() { ++emptied_; }

    // Copies a frame's images into back(). Those of the last frame that was copied are not copied again.
    void copy_images(const DeviceInfo& info, const CapturedFrame& frame);

    // Takes the readings that are new (frames share the one past each) and tells which are this frame's.
    // Those that find no room are counted.
    void add_imu(const ImuSample* samples, int count, std::uint64_t* first, std::uint32_t* frame_count);
    std::uint64_t imu_end() const { return imu_end_; }
    std::uint64_t imu_lost() const { return imu_lost_; }
    // Reading `number`, imu_taken() <= number < imu_end().
    const ImuSample& imu(std::uint64_t number) const { return imu_[number % kImu]; }
    std::uint64_t imu_taken() const { return imu_taken_; }
    void take_imu(std::uint64_t end) { imu_taken_ = end; }

    // Of any thread's lines the last kLines; more are dropped.
    void add_line(std::int64_t host_ns, LogLevel level, const char* text);
    bool take_line(Line* line);

  private:
    static constexpr int kLines = 64;
    static constexpr std::uint64_t kImu = 8192;  // eight seconds of the fastest sensor at hand (1 kHz)

    std::unique_ptr<Frame[]> frames_;
    std::unique_ptr<std::uint8_t[]> memory_;
    std::unique_ptr<ImuSample[]> imu_;
    std::uint64_t bytes_ = 0;
    int capacity_ = 0;
    std::uint64_t filled_ = 0, emptied_ = 0;
    CapturedImage last_[kStreamKinds];  // that were copied
    std::uint64_t imu_end_ = 0, imu_taken_ = 0, imu_lost_ = 0;
    std::int64_t last_imu_ns_ = INT64_MIN;
    Line lines_[kLines];
    int first_line_ = 0, line_count_ = 0;
};

}  // namespace burin
