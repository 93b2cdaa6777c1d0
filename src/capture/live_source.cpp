// SPDX-License-Identifier: MIT
// What the consumer calls. The thread that captures: live_capture.cpp; the way of an image: live_images.cpp.
#include "capture/live_source.h"

#include <algorithm>
#include <chrono>
#include <cstdarg>
#include <cstdio>

#include "capture/monotonic.h"

namespace burin {

const char* state_name(SourceState state) {
    constexpr const char* kNames[] = {"closed", "open", "streaming", "unplugged", "ended", "failed"};
    return kNames[static_cast<int>(state)];
}

Status LiveSource::open(const SourceBackend& backend, const char* address, const LiveOptions& options) {
    if (device_) return Status::error(Code::state, "the source is open already");
    if (options.waiting_frames < 1 || options.waiting_frames > kMaxReady)
        return Status::error(Code::invalid_argument, "waiting_frames: %d, expected 1..%d",
                             options.waiting_frames, kMaxReady);
    backend_ = &backend;
    std::snprintf(address_, sizeof address_, "%s", address);
    options_ = options;
    // Lent images are the kernel's own buffers: those that wait, one with the consumer, two being paired, and
    // two for the driver to fill.
    options_.device.buffers = std::clamp(std::max(options.device.buffers, options.waiting_frames + 5), 2, 32);
    info_ = DeviceInfo();
    BURIN_TRY(backend.open(address_, options_.device, &device_, &info_));
    unsigned delivered = 0;
    for (int k = 0; k < kStreamKinds; ++k)
        if (info_.streams[k].width > 0) delivered |= 1u << k;
    if (delivered == 0) {
        backend.close(device_);
        device_ = nullptr;
        return Status::error(Code::unsupported, "%s:%s delivers none of the streams asked for", backend.name,
                             address_);
    }
    delivered_ = info_;
    if (const Status registered = registered_.configure(options.registration, &delivered_);
        !registered.ok()) {
        backend.close(device_);
        device_ = nullptr;
        return registered;
    }
    statistics_ = SourceStatistics();
    state_ = SourceState::open;
    return {};
}

Status LiveSource::start() {
    if (!device_ || state_ != SourceState::open)
        return Status::error(Code::state, "the source is %s, expected open", state_name(state_));
    const int slots = options_.waiting_frames + 2 + (options_.lossless ? Pairing::kWaiting : 3);
    if (!pool_.allocate(info_, slots))
        return Status::error(Code::insufficient_memory, "no memory for %d images of each stream", slots);
    pairing_.reset(info_);
    clock_.reset();
    clock_known_ = false;
    imu_.reset();
    ready_count_ = 0;
    holding_ = stopping_ = false;
    failure_ = Status();
    std::fill(std::begin(sequence_known_), std::end(sequence_known_), false);
    statistics_ = SourceStatistics();
    statistics_.ring_bytes = pool_.bytes();
    last_image_ns_ = monotonic_ns();
    last_frame_ns_ = 0;
    BURIN_TRY(backend_->start(device_, this));
    state_ = SourceState::streaming;
    if (::pthread_create(&thread_, nullptr, enter, this) != 0) {
        (void)backend_->stop(device_);
        state_ = SourceState::open;
        return Status::error(Code::insufficient_memory, "the system refused a thread for the source");
    }
    running_ = true;
    return {};
}

Status LiveSource::next(std::int64_t timeout_ns, CapturedFrame* frame) {
    std::unique_lock lock(mutex_);
    *frame = CapturedFrame();
    if (holding_) {
        drop_bundle(held_, false);
        holding_ = false;
        changed_.notify_all();
    }
    if (!running_)
        return Status::error(Code::state, "the source is %s, expected streaming", state_name(state_));
    const auto deadline = std::chrono::steady_clock::now() +
                          std::chrono::nanoseconds(std::clamp<std::int64_t>(timeout_ns, 0, kLongestWait_ns));
    const auto over = [&] {
        return ready_count_ > 0 || state_ == SourceState::ended || state_ == SourceState::failed ||
               (state_ == SourceState::unplugged && !options_.reconnect);
    };
    changed_.wait_until(lock, deadline, over);
    if (ready_count_ > 0) {
        held_ = ready_[0];
        holding_ = true;
        std::copy(ready_ + 1, ready_ + ready_count_, ready_);
        --ready_count_;
        changed_.notify_all();
        hand_out(held_, frame);
        lock.unlock();
        return registered_.active() ? registered_.apply(frame) : Status();
    }
    switch (state_) {
        case SourceState::ended:
            return Status::error(Code::ended, "%s:%s has no more frames", backend_->name, address_);
        case SourceState::failed:
            return failure_;
        case SourceState::unplugged:
            return Status::error(Code::disconnected, "%s:%s (%s) is unplugged", backend_->name, address_,
                                 info_.name);
        default:
            return Status::error(Code::timeout, "%s:%s: no frame within %.0f ms", backend_->name, address_,
                                 static_cast<double>(timeout_ns) * 1e-6);
    }
}

Status LiveSource::stop() {
    if (!running_) return {};
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
        changed_.notify_all();
    }
    ::pthread_join(thread_, nullptr);
    const std::lock_guard lock(mutex_);
    running_ = false;
    if (holding_) drop_bundle(held_, false);
    holding_ = false;
    flush();
    const Status stopped = device_ ? backend_->stop(device_) : Status();
    // Unplugged or failed, the device is closed: it has to be opened anew.
    state_ = device_ ? SourceState::open : SourceState::closed;
    return stopped;
}

void LiveSource::close() {
    (void)stop();
    if (device_) backend_->close(device_);
    device_ = nullptr;
    state_ = SourceState::closed;
}

Status LiveSource::get(SourceControl control, ControlRange* range) {
    const std::lock_guard lock(device_mutex_);
    if (!device_)
        return Status::error(Code::state, "the source is %s, expected open or streaming",
                             state_name(state()));
    if (!backend_->get)
        return Status::error(Code::unsupported, "%s devices have no controls", backend_->name);
    return backend_->get(device_, control, range);
}

Status LiveSource::set(SourceControl control, double value) {
    const std::lock_guard lock(device_mutex_);
    if (!device_)
        return Status::error(Code::state, "the source is %s, expected open or streaming",
                             state_name(state()));
    if (!backend_->set)
        return Status::error(Code::unsupported, "%s devices have no controls", backend_->name);
    return backend_->set(device_, control, value);
}

SourceState LiveSource::state() const {
    const std::lock_guard lock(mutex_);
    return state_;
}

SourceStatistics LiveSource::statistics() const {
    const std::lock_guard lock(mutex_);
    SourceStatistics s = statistics_;
    s.state = state_;
    s.wait_p50_ms = wait_ms_.quantile(0.5);
    s.wait_p95_ms = wait_ms_.quantile(0.95);
    s.wait_max_ms = wait_ms_.quantile(1);
    s.delay_p50_ms = delay_ms_.quantile(0.5);
    s.delay_p95_ms = delay_ms_.quantile(0.95);
    s.delay_max_ms = delay_ms_.quantile(1);
    s.drift_ppm = clock_.drift_ppm();
    return s;
}

void LiveSource::log(LogLevel level, const char* format, ...) {
    if (!options_.log) return;
    char line[512];
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    options_.log(options_.log_user, level, line);
}

}  // namespace burin
