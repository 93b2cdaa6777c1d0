// SPDX-License-Identifier: MIT
// The way of an image through a live source: in from the back end, paired, ready, out to the consumer.
#include <algorithm>

#include "capture/live_source.h"
#include "capture/monotonic.h"

namespace burin {
namespace {

double ms(std::int64_t ns) { return static_cast<double>(ns) * 1e-6; }

}  // namespace

void LiveSource::drop(StreamKind kind, int slot) {
    if (!pool_.drop(kind, slot)) return;
    if (backend_->give_back) backend_->give_back(device_, pool_.at(kind, slot).token);
}

void LiveSource::drop_bundle(const Bundle& bundle, bool count) {
    for (int k = 0; k < kStreamKinds; ++k) {
        if (bundle.slots[k] < 0) continue;
        drop(static_cast<StreamKind>(k), bundle.slots[k]);
        statistics_.streams[k].dropped += count;
    }
}

// A frame goes so that a newer one has room: the oldest that waits, else what is not paired yet.
bool LiveSource::make_room() {
    if (ready_count_ > 0) {
        drop_bundle(ready_[0], true);
        std::copy(ready_ + 1, ready_ + ready_count_, ready_);
        --ready_count_;
        return true;
    }
    Pairing::Dropped waiting;
    if (!pairing_.give_up(&waiting)) return false;
    drop(waiting.kind, waiting.slot);
    ++statistics_.streams[static_cast<int>(waiting.kind)].dropped;
    return true;
}

void LiveSource::flush() {
    while (make_room()) {
    }
}

int LiveSource::free_slot(StreamKind kind) {
    int slot = pool_.take(kind);
    while (slot < 0 && make_room()) slot = pool_.take(kind);
    if (slot < 0) ++statistics_.streams[static_cast<int>(kind)].dropped;
    return slot;
}

void LiveSource::wait_for_consumer(std::unique_lock<std::mutex>& lock) {
    if (!options_.lossless || ready_count_ < options_.waiting_frames) return;
    changed_.wait(lock, [&] { return stopping_ || ready_count_ < options_.waiting_frames; });
    last_image_ns_ = monotonic_ns();  // the silence was ours
}

std::uint8_t* LiveSource::acquire(StreamKind kind) {
    std::unique_lock lock(mutex_);
    wait_for_consumer(lock);
    const int slot = free_slot(kind);
    if (slot < 0) return nullptr;
    ImagePool::Slot& s = pool_.at(kind, slot);
    s.image.pixels = s.memory;
    s.image.stride_bytes = info_.at(kind).row_bytes;
    return s.memory;
}

void LiveSource::commit(StreamKind kind, std::uint8_t* image, const ImageStamp& stamp) {
    const std::lock_guard lock(mutex_);
    const int slot = pool_.find(kind, image);
    if (slot >= 0) take_in(kind, slot, stamp);
}

void LiveSource::abandon(StreamKind kind, std::uint8_t* image) {
    const std::lock_guard lock(mutex_);
    const int slot = pool_.find(kind, image);
    if (slot < 0) return;
    drop(kind, slot);
    ++statistics_.streams[static_cast<int>(kind)].damaged;
}

void LiveSource::count_damaged(StreamKind kind, int images) {
    const std::lock_guard lock(mutex_);
    statistics_.streams[static_cast<int>(kind)].damaged += static_cast<std::uint64_t>(images);
}

void LiveSource::lend(StreamKind kind, const std::uint8_t* image, std::size_t stride_bytes,
                      std::uint64_t token, int dmabuf_fd, const ImageStamp& stamp) {
    std::unique_lock lock(mutex_);
    wait_for_consumer(lock);
    const int slot = free_slot(kind);
    if (slot < 0) {
        if (backend_->give_back) backend_->give_back(device_, token);
        return;
    }
    ImagePool::Slot& s = pool_.at(kind, slot);
    s.lent = true;
    s.token = token;
    s.image.pixels = image;
    s.image.stride_bytes = stride_bytes;
    s.image.dmabuf_fd = dmabuf_fd;
    take_in(kind, slot, stamp);
}

void LiveSource::imu(const ImuSample& sample) {
    const std::lock_guard lock(mutex_);
    ImuSample mapped = sample;
    mapped.t_ns = clock_.host_ns(sample.t_ns);  // before the first image: as it is; take_in() will
    imu_.add(mapped);
}

void LiveSource::take_in(StreamKind kind, int slot, const ImageStamp& stamp) {
    const int k = static_cast<int>(kind);
    StreamStatistics& counts = statistics_.streams[k];
    CapturedImage& image = pool_.at(kind, slot).image;
    image.stamp = stamp;
    image.stamp.camera = nullptr;
    image.camera = stamp.camera ? *stamp.camera : info_.at(kind).camera;
    // A sequence that falls is a device that began anew, no loss.
    if (sequence_known_[k] && stamp.sequence > next_sequence_[k])
        image.lost = stamp.sequence - next_sequence_[k];
    counts.lost += image.lost;
    next_sequence_[k] = stamp.sequence + 1;
    sequence_known_[k] = true;
    last_image_ns_ = monotonic_ns();
    if (stamp.has_device_time) {
        if (clock_.add(stamp.device_ns, stamp.host_ns)) {
            if (!clock_known_)
                imu_.map(clock_);
            else
                imu_.reset();  // the device began anew: its readings so far are of another epoch
            clock_known_ = true;
        }
        image.t_ns = clock_.host_ns(stamp.device_ns);
        delay_ms_.add(ms(stamp.host_ns - image.t_ns));
    } else {
        image.t_ns = stamp.host_ns;
    }
    if (stamp.damaged) {
        ++counts.damaged;
        if (!options_.keep_damaged) return drop(kind, slot);
    } else {
        ++counts.captured;
    }
    int spill;
    pairing_.add(kind, slot, stamp.has_device_time ? stamp.device_ns : stamp.host_ns, &spill);
    if (spill >= 0) {
        drop(kind, spill);
        ++counts.dropped;
    }
    emit(last_image_ns_);
}

void LiveSource::emit(std::int64_t now_ns) {
    Bundle bundle;
    Pairing::Dropped dropped[Pairing::kMaxDropped];
    int dropped_count = 0;
    while (pairing_.next(pool_, now_ns, &bundle, dropped, &dropped_count)) {
        for (int i = 0; i < dropped_count; ++i) drop(dropped[i].kind, dropped[i].slot);
        while (!options_.lossless && ready_count_ >= options_.waiting_frames) make_room();
        ready_[ready_count_++] = bundle;
        changed_.notify_all();
    }
}

void LiveSource::hand_out(const Bundle& bundle, CapturedFrame* frame) {
    const std::int64_t now_ns = monotonic_ns();
    std::int64_t last_byte_ns = 0;
    for (int k = 0; k < kStreamKinds; ++k) {
        if (bundle.slots[k] < 0) continue;
        const CapturedImage& image = pool_.at(static_cast<StreamKind>(k), bundle.slots[k]).image;
        frame->images[k] = image;
        last_byte_ns = std::max(last_byte_ns, image.stamp.host_ns);
        ++statistics_.streams[k].delivered;
    }
    wait_ms_.add(ms(now_ns - last_byte_ns));
    // The clocks' relation is learned as it goes; a correction must not turn time back.
    frame->t_ns = std::max(frame->at(pairing_.leading()).t_ns, last_frame_ns_ + 1);
    last_frame_ns_ = frame->t_ns;
    frame->imu = imu_of_frame_;
    frame->imu_count = imu_.take(frame->t_ns, imu_of_frame_);
    ++statistics_.frames;
}

}  // namespace burin
