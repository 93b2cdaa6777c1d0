// SPDX-License-Identifier: MIT
#include "capture/recording_queue.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <new>

#include "capture/recording_images.h"

namespace burin {
namespace {

constexpr std::size_t kAlign = 64;  // a cache line
constexpr std::size_t aligned(std::size_t bytes) { return (bytes + kAlign - 1) / kAlign * kAlign; }

void copy_rows(const std::uint8_t* from, std::size_t stride, std::size_t row_bytes, int rows,
               std::uint8_t* to) {
    if (stride == row_bytes) {
        std::memcpy(to, from, row_bytes * static_cast<std::size_t>(rows));
        return;
    }
    for (int y = 0; y < rows; ++y, from += stride, to += row_bytes) std::memcpy(to, from, row_bytes);
}

void copy_image(const StreamInfo& s, const CapturedImage& image, std::uint8_t* to) {
    copy_rows(image.pixels, image.stride_bytes, s.row_bytes, s.height, to);
    if (!has_chroma_plane(s)) return;
    const auto luma_rows = static_cast<std::size_t>(s.height);
    const std::size_t row_bytes = chroma_row_bytes(s.width);
    copy_rows(image.pixels + image.stride_bytes * luma_rows, std::max(image.stride_bytes, row_bytes),
              row_bytes, (s.height + 1) / 2, to + s.row_bytes * luma_rows);
}

bool same_image(const CapturedImage& a, const CapturedImage& b) {
    return a.stamp.sequence == b.stamp.sequence && a.t_ns == b.t_ns && a.stamp.host_ns == b.stamp.host_ns;
}

}  // namespace

bool RecordingQueue::allocate(const DeviceInfo& info, int frames) {
    std::size_t total = kAlign;
    for (const StreamInfo& s : info.streams)
        if (s.width > 0) total += aligned(s.image_bytes) * static_cast<std::size_t>(frames);
    frames_.reset(new (std::nothrow) Frame[static_cast<std::size_t>(frames)]);
    memory_.reset(new (std::nothrow) std::uint8_t[total]);
    imu_.reset(new (std::nothrow) ImuSample[kImu]);
    if (!frames_ || !memory_ || !imu_) return false;
    std::fill_n(memory_.get(), total, std::uint8_t{0});  // the pages come now, not while streaming
    bytes_ = total + kImu * sizeof(ImuSample);
    capacity_ = frames;
    auto* next = memory_.get() + (kAlign - reinterpret_cast<std::uintptr_t>(memory_.get()) % kAlign) % kAlign;
    for (int i = 0; i < frames; ++i)
        for (int k = 0; k < kStreamKinds; ++k) {
            if (info.streams[k].width <= 0) continue;
            frames_[static_cast<std::size_t>(i)].memory[k] = next;
            next += aligned(info.streams[k].image_bytes);
        }
    filled_ = emptied_ = imu_end_ = imu_taken_ = imu_lost_ = 0;
    last_imu_ns_ = INT64_MIN;
    first_line_ = line_count_ = 0;
    for (CapturedImage& image : last_) image = CapturedImage();
    return true;
}

void RecordingQueue::copy_images(const DeviceInfo& info, const CapturedFrame& frame) {
    Frame& to = back();
    for (int k = 0; k < kStreamKinds; ++k) {
        const CapturedImage& image = frame.images[k];
        CapturedImage& copy = to.images[k];
        to.again[k] = false;
        copy = CapturedImage();
        if (!image.pixels || info.streams[k].width <= 0) continue;
        to.again[k] = last_[k].pixels != nullptr && same_image(last_[k], image);
        copy = image;
        copy.pixels = to.memory[k];
        if (!to.again[k]) copy_image(info.streams[k], image, to.memory[k]);
        last_[k] = copy;
    }
}

void RecordingQueue::add_imu(const ImuSample* samples, int count, std::uint64_t* first,
                             std::uint32_t* frame_count) {
    int known = 0;
    while (known < count && samples[known].t_ns <= last_imu_ns_) ++known;
    *first = imu_end_ - std::min(imu_end_, static_cast<std::uint64_t>(known));
    for (int i = known; i < count; ++i) {
        if (samples[i].t_ns <= last_imu_ns_) continue;
        last_imu_ns_ = samples[i].t_ns;
        if (imu_end_ - imu_taken_ == kImu) {
            ++imu_lost_;
            continue;
        }
        imu_[imu_end_++ % kImu] = samples[i];
    }
    *frame_count = static_cast<std::uint32_t>(imu_end_ - *first);
}

void RecordingQueue::add_line(std::int64_t host_ns, LogLevel level, const char* text) {
    if (line_count_ == kLines) return;
    Line& line = lines_[(first_line_ + line_count_++) % kLines];
    line.host_ns = host_ns;
    line.level = level;
    std::snprintf(line.text, sizeof line.text, "%s", text);
}

bool RecordingQueue::take_line(Line* line) {
    if (line_count_ == 0) return false;
    *line = lines_[first_line_];
    first_line_ = (first_line_ + 1) % kLines;
    --line_count_;
    return true;
}

}  // namespace burin
