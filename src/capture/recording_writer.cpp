// SPDX-License-Identifier: MIT
// The caller's side of the recorder; its thread: recording_thread.cpp.
#include "capture/recording_writer.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <new>

#include "capture/monotonic.h"

namespace burin {
namespace {

constexpr int kMaxQueue = 256;

template <std::size_t N>
void copy_text(char (&to)[N], const char* from) {
    std::snprintf(to, N, "%s", from);
}

RecordedStream recorded_stream(const StreamInfo& s) {
    RecordedStream r;
    r.width = static_cast<std::uint32_t>(s.width);
    r.height = static_cast<std::uint32_t>(s.height);
    r.pixels = static_cast<std::uint8_t>(s.pixels);
    r.colour_format = static_cast<std::uint8_t>(s.colour_format);
    r.calibrated = s.calibrated;
    std::memcpy(r.format, s.format, sizeof r.format);
    r.fps = s.fps;
    r.unit_m = s.unit_m;
    r.camera = recorded_camera(s.camera);
    r.T_stream_depth = recorded_pose(s.T_stream_depth);
    return r;
}

}  // namespace

const char* state_name(RecordingState state) {
    constexpr const char* kNames[] = {"closed", "recording", "full", "failed"};
    return kNames[static_cast<int>(state)];
}

Status RecordingWriter::open(const char* folder, const char* source, const DeviceInfo& info,
                             const RecordingOptions& options) {
    if (running_) return Status::error(Code::state, "%s: is being recorded already", name_);
    BURIN_TRY(disk_.create(folder, kRecordingName));
    const Status status = open(&disk_, disk_.path(), source, info, options);
    if (!status.ok()) {
        (void)std::remove(disk_.path());
        disk_.close();
    }
    return status;
}

Status RecordingWriter::open(RecordingFile* file, const char* name, const char* source,
                             const DeviceInfo& info, const RecordingOptions& options) {
    if (running_) return Status::error(Code::state, "%s: is being recorded already", name_);
    if (options.queue_frames < 1 || options.queue_frames > kMaxQueue)
        return Status::error(Code::invalid_argument, "recording: queue_frames is %d, expected 1..%d",
                             options.queue_frames, kMaxQueue);
    if (options.jpeg_quality < 1 || options.jpeg_quality > 100)
        return Status::error(Code::invalid_argument, "recording: jpeg_quality is %d, expected 1..100",
                             options.jpeg_quality);
    if (options.sync_ns < 0)
        return Status::error(Code::invalid_argument, "recording: sync_ns is %lld, expected 0 or more",
                             static_cast<long long>(options.sync_ns));
    file_ = file;
    copy_text(name_, name);
    info_ = info;
    options_ = options;
    for (int k = 0; k < kStreamKinds; ++k) info_.streams[k].kind = static_cast<StreamKind>(k);
    BURIN_TRY(encoder_.reserve(info_, options.colour, options.jpeg_quality));
    // A record of readings has at most 1000 samples: 56 KB.
    const std::size_t most = sizeof(RecordHead) + sizeof(RecordedCamera) +
                             std::max<std::size_t>(encoder_.bound(), 65536) + kRecordAlign;
    record_.reset(new (std::nothrow) std::uint8_t[most]);
    if (!record_ || !queue_.allocate(info_, options.queue_frames))
        return Status::error(Code::insufficient_memory, "%s: no memory for a queue of %d frames", name_,
                             options.queue_frames);
    std::fill_n(record_.get(), most, std::uint8_t{0});
    return begin(source, options);
}

Status RecordingWriter::begin(const char* source, const RecordingOptions& options) {
    end_ = unflushed_ = dropped_written_ = synced_end_ = frames_ = 0;
    std::fill(std::begin(last_offset_), std::end(last_offset_), std::uint64_t{0});
    pending_ = stopping_ = false;
    failure_ = Status();
    statistics_ = RecordingStatistics();
    statistics_.state = RecordingState::recording;
    statistics_.queue_bytes = queue_.bytes();
    write_ms_ = Rolling();

    RecordedHeader header;
    timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    header.unix_ns = static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
    header.has_imu = info_.has_imu;
    copy_text(header.source, source);
    copy_text(header.name, info_.name);
    copy_text(header.serial, info_.serial);
    copy_text(header.location, info_.location);
    header.T_camera_imu = recorded_pose(info_.T_camera_imu);
    for (int k = 0; k < kStreamKinds; ++k)
        if (info_.streams[k].width > 0) header.streams[k] = recorded_stream(info_.streams[k]);
    header.streams[static_cast<int>(StreamKind::confidence)].min_confidence = options.min_confidence;
    std::memcpy(payload(), &header, sizeof header);
    RecordHead head;
    head.kind = RecordKind::header;
    head.host_ns = monotonic_ns();
    if (!write_record(head, sizeof header) || (options.sync_ns > 0 && !sync())) {
        statistics_.state = RecordingState::closed;
        return failure_;
    }
    synced_ns_ = monotonic_ns();
    if (::pthread_create(&thread_, nullptr, enter, this) != 0) {
        statistics_.state = RecordingState::closed;
        return Status::error(Code::insufficient_memory, "the system refused a thread for the recording");
    }
    running_ = true;
    return {};
}

Status RecordingWriter::add(const CapturedFrame& frame, const Se3* T_world_camera) {
    std::unique_lock lock(mutex_);
    if (!running_) return Status::error(Code::state, "no recording is open");
    std::uint64_t imu_first = 0;
    std::uint32_t imu_count = 0;
    queue_.add_imu(frame.imu, frame.imu_count, &imu_first, &imu_count);
    if (pending_) {
        imu_count += static_cast<std::uint32_t>(imu_first - pending_first_);
        imu_first = pending_first_;
    }
    const auto refused = [&] { return statistics_.state != RecordingState::recording; };
    if (options_.lossless) room_.wait(lock, [&] { return refused() || !queue_.full(); });
    if (refused() || queue_.full()) {
        ++statistics_.dropped;
        pending_ = true;
        pending_first_ = imu_first;
        return failure_;
    }
    pending_ = false;
    RecordingQueue::Frame& to = queue_.back();
    to.dropped = statistics_.dropped;
    lock.unlock();  // the frame is ours until push()
    to.t_ns = frame.t_ns;
    to.imu_first = imu_first;
    to.imu_count = imu_count;
    to.has_pose = T_world_camera != nullptr;
    if (T_world_camera) to.T_world_camera = *T_world_camera;
    queue_.copy_images(info_, frame);
    lock.lock();
    queue_.push();
    statistics_.queue_high_water = std::max(statistics_.queue_high_water, queue_.frames());
    lock.unlock();
    work_.notify_one();
    return {};
}

void RecordingWriter::log(LogLevel level, const char* line) {
    {
        const std::lock_guard lock(mutex_);
        if (statistics_.state != RecordingState::recording) return;
        queue_.add_line(monotonic_ns(), level, line);
    }
    work_.notify_one();
}

RecordingStatistics RecordingWriter::statistics() const {
    const std::lock_guard lock(mutex_);
    RecordingStatistics s = statistics_;
    s.imu_lost = queue_.imu_lost();
    s.write_p50_ms = write_ms_.quantile(0.5);
    s.write_p95_ms = write_ms_.quantile(0.95);
    s.write_max_ms = write_ms_.quantile(1);
    return s;
}

Status RecordingWriter::close() {
    if (!running_) return {};
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    work_.notify_one();
    ::pthread_join(thread_, nullptr);
    running_ = false;
    disk_.close();
    const std::lock_guard lock(mutex_);
    // Why it ended before is still told.
    if (statistics_.state == RecordingState::recording) statistics_.state = RecordingState::closed;
    return failure_;
}

}  // namespace burin
