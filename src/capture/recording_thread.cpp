// SPDX-License-Identifier: MIT
// The recorder's thread: takes frames from the queue, codes them and appends records. Only it touches the
// file.
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>

#include "capture/crc32.h"
#include "capture/monotonic.h"
#include "capture/recording_writer.h"

namespace burin {
namespace {

// So much goes to the disk at a time; the sync every few seconds then finds little left to wait for.
constexpr std::uint64_t kFlush = 1 << 20;
constexpr std::uint64_t kImuOfRecord = 1000;  // samples: within the buffer of a record

double ms(std::int64_t ns) { return static_cast<double>(ns) * 1e-6; }

bool same_camera(const Camera& a, const Camera& b) {
    const RecordedCamera x = recorded_camera(a), y = recorded_camera(b);
    return std::memcmp(&x, &y, sizeof x) == 0;
}

}  // namespace

void* RecordingWriter::enter(void* self) {
    static_cast<RecordingWriter*>(self)->run();
    return nullptr;
}

void RecordingWriter::run() {
    for (;;) {
        RecordingQueue::Frame* frame = nullptr;
        bool stop = false;
        {
            std::unique_lock lock(mutex_);
            // Looks up four times a second: for lines, and for the sync that is due.
            work_.wait_for(lock, std::chrono::milliseconds(250),
                           [&] { return stopping_ || queue_.frames() > 0; });
            if (queue_.frames() > 0) frame = &queue_.front();
            stop = stopping_ && !frame;
        }
        bool ok = statistics_.state == RecordingState::recording && write_lines();
        if (frame) {
            const std::int64_t began_ns = monotonic_ns();
            ok = ok && write_frame(*frame);
            const std::lock_guard lock(mutex_);
            queue_.pop();
            ok ? ++statistics_.frames : ++statistics_.dropped;
            write_ms_.add(ms(monotonic_ns() - began_ns));
        }
        room_.notify_one();
        if (ok && !stop && options_.sync_ns > 0 && end_ > synced_end_ &&
            monotonic_ns() - synced_ns_ >= options_.sync_ns)
            ok = sync() && write_mark(RecordKind::mark);
        if (!stop) continue;
        std::uint64_t readings;
        {
            const std::lock_guard lock(mutex_);
            readings = queue_.imu_end();
        }
        if (ok && write_imu(readings) && write_mark(RecordKind::end)) (void)sync();
        return;
    }
}

bool RecordingWriter::write_lines() {
    RecordingQueue::Line line;
    for (;;) {
        {
            const std::lock_guard lock(mutex_);
            if (!queue_.take_line(&line)) return true;
        }
        RecordHead head;
        head.kind = RecordKind::log;
        head.host_ns = line.host_ns;
        head.parameter = static_cast<std::uint32_t>(line.level);
        const std::size_t bytes = std::strlen(line.text);
        std::memcpy(payload(), line.text, bytes);
        if (!write_record(head, bytes)) return false;
    }
}

bool RecordingWriter::write_imu(std::uint64_t end) {
    for (std::uint64_t first = queue_.imu_taken(); first < end;) {
        const std::uint64_t count = std::min(end - first, kImuOfRecord);
        std::memcpy(payload(), &first, sizeof first);
        for (std::uint64_t i = 0; i < count; ++i) {
            const ImuSample& s = queue_.imu(first + i);  // the producer writes elsewhere in the ring
            const RecordedImuSample recorded = {s.t_ns,
                                                {s.gyro_rad_s.x, s.gyro_rad_s.y, s.gyro_rad_s.z},
                                                {s.accel_m_s2.x, s.accel_m_s2.y, s.accel_m_s2.z}};
            std::memcpy(payload() + sizeof first + i * sizeof recorded, &recorded, sizeof recorded);
        }
        RecordHead head;
        head.kind = RecordKind::imu;
        head.host_ns = monotonic_ns();
        if (!write_record(head, sizeof first + count * sizeof(RecordedImuSample))) return false;
        first += count;
        const std::lock_guard lock(mutex_);
        queue_.take_imu(first);
        statistics_.imu_samples = first;
    }
    return true;
}

bool RecordingWriter::write_image(RecordingQueue::Frame& frame, int kind, std::uint64_t* offset) {
    const StreamInfo& stream = info_.streams[kind];
    const CapturedImage& image = frame.images[kind];
    RecordHead head;
    head.kind = RecordKind::image;
    head.stream = static_cast<std::uint8_t>(kind);
    head.sequence = image.stamp.sequence;
    head.device_ns = image.stamp.device_ns;
    head.host_ns = image.stamp.host_ns;
    head.t_ns = image.t_ns;
    head.lost = image.lost;
    if (image.stamp.has_device_time) head.flags |= kRecordDeviceTime;
    if (image.stamp.damaged) head.flags |= kRecordDamaged;
    std::size_t bytes = 0;
    if (!same_camera(image.camera, stream.camera)) {
        head.flags |= kRecordCamera;
        const RecordedCamera camera = recorded_camera(image.camera);
        std::memcpy(payload(), &camera, sizeof camera);
        bytes = sizeof camera;
    }
    const std::size_t coded =
        encoder_.encode(stream, image.pixels, payload() + bytes, &head.codec, &head.parameter);
    *offset = end_;
    if (!write_record(head, bytes + coded)) return false;
    const std::lock_guard lock(mutex_);
    statistics_.image_bytes += stream.image_bytes;
    statistics_.coded_bytes += coded;
    return true;
}

bool RecordingWriter::write_frame(RecordingQueue::Frame& frame) {
    if (!write_imu(frame.imu_first + frame.imu_count)) return false;
    if (frame.dropped > dropped_written_) {
        RecordHead loss;
        loss.kind = RecordKind::loss;
        loss.host_ns = monotonic_ns();
        loss.t_ns = frame.t_ns;
        loss.sequence = frame.dropped;
        if (!write_record(loss, 0)) return false;
        dropped_written_ = frame.dropped;
    }
    RecordedFrame recorded;
    for (int k = 0; k < kStreamKinds; ++k) {
        if (!frame.images[k].pixels) continue;
        if (!frame.again[k] && !write_image(frame, k, &last_offset_[k])) return false;
        recorded.images[k] = last_offset_[k];
    }
    recorded.imu_first = frame.imu_first;
    recorded.imu_count = frame.imu_count;
    recorded.has_pose = frame.has_pose;
    recorded.T_world_camera = recorded_pose(frame.T_world_camera);
    std::memcpy(payload(), &recorded, sizeof recorded);
    RecordHead head;
    head.kind = RecordKind::frame;
    head.host_ns = monotonic_ns();
    head.t_ns = frame.t_ns;
    head.sequence = frames_++;
    return write_record(head, sizeof recorded);
}

bool RecordingWriter::write_mark(RecordKind kind) {
    RecordHead head;
    head.kind = kind;
    head.host_ns = monotonic_ns();
    head.sequence = frames_;
    const bool ok = write_record(head, 0);
    if (kind == RecordKind::mark) synced_end_ = end_;  // a mark alone is no reason for the next
    return ok;
}

bool RecordingWriter::write_record(RecordHead head, std::size_t payload_bytes) {
    head.payload_bytes = static_cast<std::uint32_t>(payload_bytes);
    head.payload_crc = crc32(payload(), payload_bytes);
    seal_head(&head);
    std::memcpy(record_.get(), &head, sizeof head);
    const std::uint64_t whole = record_bytes(head.payload_bytes);
    std::memset(payload() + payload_bytes, 0, whole - sizeof head - payload_bytes);
    for (std::uint64_t done = 0; done < whole;) {
        const std::int64_t put = file_->write(end_ + done, record_.get() + done, whole - done);
        if (put == -EINTR) continue;
        if (put <= 0) {
            refuse(put < 0 ? static_cast<int>(-put) : ENOSPC);
            return false;
        }
        done += static_cast<std::uint64_t>(put);
    }
    end_ += whole;
    if (end_ - unflushed_ >= kFlush) {
        file_->flush_soon(end_);
        unflushed_ = end_;
    }
    const std::lock_guard lock(mutex_);
    statistics_.file_bytes = end_;
    return true;
}

bool RecordingWriter::sync() {
    const int error = -file_->sync();
    synced_ns_ = monotonic_ns();
    synced_end_ = end_;
    if (error != 0) refuse(error);
    return error == 0;
}

// The disk wants no more: the file is cut to its last whole record, and what comes is counted as dropped.
void RecordingWriter::refuse(int error) {
    (void)file_->truncate(end_);
    const bool full = error == ENOSPC || error == EDQUOT || error == EFBIG;
    {
        const std::lock_guard lock(mutex_);
        statistics_.state = full ? RecordingState::full : RecordingState::failed;
        failure_ = Status::error(Code::io, "%s: %s (%s); the recording ends after %llu frames", name_,
                                 full ? "the disk is full" : "the disk refused", std::strerror(error),
                                 static_cast<unsigned long long>(frames_));
    }
    room_.notify_one();
}

}  // namespace burin
