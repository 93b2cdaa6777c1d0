// SPDX-License-Identifier: MIT
// The index of a recording.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "capture/crc32.h"
#include "capture/recording_reader.h"

namespace burin {
namespace {

// One read brings a head and, of all but images, its payload.
constexpr std::size_t kPeek = 4096;
// Readings that damaged stretches may have swallowed: a quarter of an hour at 1 kHz.
constexpr std::uint64_t kMaxGap = 1 << 20;
// Payloads of the small kinds; a thousand readings are 56 KB.
constexpr std::uint32_t kMaxSmall = 1 << 20;

bool is_small(RecordKind kind) { return kind != RecordKind::image; }

}  // namespace

Status RecordingReader::scan() {
    const auto no_memory = [&] {
        return Status::error(Code::insufficient_memory, "%s: no memory for the index", path_);
    };
    std::uint8_t peek[kPeek];
    std::unique_ptr<std::uint8_t[]> longer;  // for readings
    std::uint64_t marked = 0;  // all before this was on the disk, whatever happened to the power
    std::uint64_t at = record_bytes(sizeof header_);
    std::size_t frames_at_mark = 0;
    while (at + sizeof(RecordHead) <= size_) {
        const std::size_t there = static_cast<std::size_t>(std::min<std::uint64_t>(kPeek, size_ - at));
        if (!read(at, peek, there)) break;
        RecordHead head;
        std::memcpy(&head, peek, sizeof head);
        bool whole = head_is_whole(head) && (!is_small(head.kind) || head.payload_bytes <= kMaxSmall);
        if (whole && at + sizeof head + head.payload_bytes > size_) break;  // the writer's last breath
        const std::uint8_t* payload = peek + sizeof head;
        if (whole && is_small(head.kind)) {
            if (sizeof head + head.payload_bytes > there) {
                if (!longer) longer.reset(new (std::nothrow) std::uint8_t[kMaxSmall]);
                if (!longer) return no_memory();
                whole = read(at + sizeof head, longer.get(), head.payload_bytes);
                payload = longer.get();
            }
            whole = whole && crc32(payload, head.payload_bytes) == head.payload_crc;
        }
        if (!whole) {
            const std::uint64_t next = find_record(at + kRecordAlign);
            if (next >= size_) break;
            findings_.damaged_bytes += next - at;
            at = next;
            continue;
        }
        findings_.closed = head.kind == RecordKind::end;
        if (head.kind == RecordKind::mark || head.kind == RecordKind::end) {
            marked = at;
            frames_at_mark = frames_.size();
        }
        if (!take(at, head, payload)) return no_memory();
        at += record_bytes(head.payload_bytes);
    }
    findings_.torn_bytes = at < size_ ? size_ - at : 0;
    if (findings_.closed) return {};
    // What came after the last mark may, after a power cut, have heads without their payloads.
    for (std::size_t i = frames_at_mark; i < frames_.size(); ++i)
        for (const std::uint64_t offset : frames_[i].recorded.images) {
            RecordHead head;
            if (offset < marked || offset == 0) continue;
            if (read(offset, &head, sizeof head) && payload_is_whole(offset, head)) continue;
            findings_.incomplete_frames += frames_.size() - i;
            findings_.torn_bytes = std::max(findings_.torn_bytes, size_ - offset);
            frames_.cut(i);
            return {};
        }
    return {};
}

// The next head that is whole, at or after `from`; size_ when there is none.
std::uint64_t RecordingReader::find_record(std::uint64_t from) const {
    constexpr std::size_t kBlock = 1 << 16;
    const std::unique_ptr<std::uint8_t[]> block(new (std::nothrow) std::uint8_t[kBlock]);
    if (!block) return size_;
    while (from + sizeof(RecordHead) <= size_) {
        const std::size_t there = static_cast<std::size_t>(std::min<std::uint64_t>(kBlock, size_ - from));
        if (!read(from, block.get(), there)) return size_;
        std::size_t i = 0;
        for (; i + sizeof(RecordHead) <= there; i += kRecordAlign) {
            RecordHead head;
            std::memcpy(&head, block.get() + i, sizeof head);
            if (head.magic == kRecordMagic && head_is_whole(head)) return from + i;
        }
        from += i;
    }
    return size_;
}

bool RecordingReader::payload_is_whole(std::uint64_t at, const RecordHead& head) const {
    std::uint8_t block[kPeek];
    std::uint32_t crc = 0;
    at += sizeof head;
    for (std::size_t left = head.payload_bytes; left > 0;) {
        const std::size_t some = std::min(left, sizeof block);
        if (!read(at, block, some)) return false;
        crc = crc32(block, some, crc);
        at += some;
        left -= some;
    }
    return crc == head.payload_crc;
}

// False: no memory.
bool RecordingReader::take(std::uint64_t at, const RecordHead& head, const std::uint8_t* payload) {
    switch (head.kind) {
        case RecordKind::image:
            if (head.stream >= kStreamKinds || info_.streams[head.stream].width == 0) return true;
            findings_.lost_images[head.stream] += head.lost;
            max_payload_ = std::max<std::size_t>(max_payload_, head.payload_bytes);
            return images_.add({at, head.stream});
        case RecordKind::imu:
            return take_imu(payload, head.payload_bytes);
        case RecordKind::frame:
            return head.payload_bytes != sizeof(RecordedFrame) || take_frame(head, payload);
        case RecordKind::log:
            return lines_.add(at);
        case RecordKind::loss:
            findings_.dropped_frames = head.sequence;
            return true;
        default:
            return true;  // kinds to come are passed over
    }
}

bool RecordingReader::take_imu(const std::uint8_t* payload, std::size_t bytes) {
    std::uint64_t first = 0;
    if (bytes < sizeof first) return true;
    std::memcpy(&first, payload, sizeof first);
    if (first < imu_.size() || first - imu_.size() > kMaxGap - imu_gap_) return true;
    imu_gap_ += first - imu_.size();
    // Readings in a damaged stretch: their numbers stay taken.
    while (imu_.size() < first)
        if (!imu_.add(ImuSample{INT64_MIN, {}, {}})) return false;
    for (std::size_t at = sizeof first; at + sizeof(RecordedImuSample) <= bytes;
         at += sizeof(RecordedImuSample)) {
        RecordedImuSample r;
        std::memcpy(&r, payload + at, sizeof r);
        bool finite = true;
        for (const double* of : {r.gyro_rad_s, r.accel_m_s2})
            for (int i = 0; i < 3; ++i) finite = finite && std::isfinite(of[i]);
        if (!imu_.add({finite ? r.t_ns : INT64_MIN,
                       {r.gyro_rad_s[0], r.gyro_rad_s[1], r.gyro_rad_s[2]},
                       {r.accel_m_s2[0], r.accel_m_s2[1], r.accel_m_s2[2]}}))
            return false;
    }
    return true;
}

bool RecordingReader::take_frame(const RecordHead& head, const std::uint8_t* payload) {
    Frame frame;
    frame.t_ns = head.t_ns;
    std::memcpy(&frame.recorded, payload, sizeof frame.recorded);
    bool any = false;
    for (std::size_t k = 0; k < kStreamKinds; ++k) {
        const std::uint64_t offset = frame.recorded.images[k];
        if (offset == 0) continue;
        // Images stand before their frame, in the order of the file.
        std::size_t low = 0, high = images_.size();
        while (low < high) {
            const std::size_t middle = (low + high) / 2;
            images_[middle].offset < offset ? low = middle + 1 : high = middle;
        }
        if (low == images_.size() || images_[low].offset != offset || images_[low].stream != k) {
            ++findings_.incomplete_frames;
            return true;
        }
        any = true;
    }
    if (frame.recorded.has_pose > 1 || !any) {
        ++findings_.incomplete_frames;
        return true;
    }
    return frames_.add(frame);
}

const ImuSample* RecordingReader::imu(const RecordedFrame& frame, int* count) const {
    *count = 0;
    const std::uint64_t first = frame.imu_first, end = first + frame.imu_count;
    if (frame.imu_count == 0 || first >= imu_.size() || end > imu_.size()) return nullptr;
    for (std::uint64_t i = first; i < end; ++i)
        if (imu_[i].t_ns == INT64_MIN || (i > first && imu_[i].t_ns <= imu_[i - 1].t_ns)) return nullptr;
    *count = static_cast<int>(frame.imu_count);
    return &imu_[first];
}

bool RecordingReader::next_line(std::uint64_t* offset, LogLevel* level, char (&line)[257]) const {
    for (std::size_t i = 0; i < lines_.size(); ++i) {
        if (lines_[i] <= *offset) continue;
        *offset = lines_[i];
        RecordHead head;
        if (!read(*offset, &head, sizeof head)) return false;
        const std::size_t bytes = std::min<std::size_t>(head.payload_bytes, sizeof line - 1);
        if (!read(*offset + sizeof head, line, bytes)) return false;
        line[bytes] = 0;
        *level = static_cast<LogLevel>(std::min(head.parameter, 2u));
        return true;
    }
    return false;
}

}  // namespace burin
