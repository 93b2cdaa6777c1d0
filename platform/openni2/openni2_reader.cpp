// SPDX-License-Identifier: MIT
#include "platform/openni2/openni2_reader.h"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <new>

#include "capture/monotonic.h"

namespace burin {
namespace {

// How soon a device that is added or removed is noticed.
constexpr int kWait_ms = 5;

}  // namespace

Openni2Reader& Openni2Reader::get() {
    static auto* reader = new Openni2Reader;  // its thread outlives everything
    return *reader;
}

Status Openni2Reader::add(const Openni2& oni, Openni2Frames* frames) {
    const std::lock_guard lock(mutex_);
    oni_ = &oni;
    if (count_ == kDevices)
        return Status::error(Code::insufficient_memory, "openni2: %d devices stream already", count_);
    if (!running_) {
        pthread_t thread;
        if (::pthread_create(&thread, nullptr, enter, this) != 0)
            return Status::error(Code::insufficient_memory, "openni2: the system refused a thread");
        ::pthread_detach(thread);
        running_ = true;
    }
    frames->count = 0;
    frames->failed = false;
    devices_[count_++] = frames;
    changed_.notify_all();
    return {};
}

void Openni2Reader::remove(Openni2Frames* frames) {
    std::unique_lock lock(mutex_);
    auto* end = std::remove(devices_, devices_ + count_, frames);
    count_ = static_cast<int>(end - devices_);
    changed_.wait(lock, [&] { return !reading_; });  // its streams may be in the reader's hands
    for (int i = 0; i < frames->count; ++i) oni_->release_frame(frames->entries[i].frame);
    frames->count = 0;
}

bool Openni2Reader::next(Openni2Frames* frames, std::int64_t deadline_ns, Openni2Frames::Entry* entry) {
    std::unique_lock lock(mutex_);
    const std::int64_t left_ns = std::max<std::int64_t>(deadline_ns - monotonic_ns(), 0);
    frames->arrived.wait_for(lock, std::chrono::nanoseconds(left_ns),
                             [&] { return frames->count > 0 || frames->failed; });
    if (frames->count == 0) return false;
    *entry = frames->entries[0];
    std::copy(frames->entries + 1, frames->entries + frames->count, frames->entries);
    --frames->count;
    changed_.notify_all();
    return true;
}

void* Openni2Reader::enter(void* self) {
    static_cast<Openni2Reader*>(self)->run();
    return nullptr;
}

void Openni2Reader::run() {
    OniStreamHandle streams[kDevices * kOniStreams];
    Openni2Frames* owners[kDevices * kOniStreams];
    int indices[kDevices * kOniStreams];
    std::unique_lock lock(mutex_);
    for (;;) {
        // A device whose queue is full is left alone: what cannot be taken is not read.
        int count = 0;
        for (int d = 0; d < count_; ++d) {
            if (devices_[d]->count == Openni2Frames::kWaiting || devices_[d]->failed) continue;
            for (int s = 0; s < devices_[d]->stream_count; ++s) {
                streams[count] = devices_[d]->streams[s];
                owners[count] = devices_[d];
                indices[count++] = s;
            }
        }
        if (count == 0) {
            changed_.wait(lock);
            continue;
        }
        reading_ = true;
        lock.unlock();
        int ready = -1;
        OniFrame* frame = nullptr;
        OniStatus status = oni_->wait_for_any_stream(streams, count, &ready, kWait_ms);
        const bool any = status == ONI_STATUS_OK && ready >= 0 && ready < count;
        if (any) status = oni_->read_frame(streams[ready], &frame);
        lock.lock();
        reading_ = false;
        changed_.notify_all();
        if (status == ONI_STATUS_TIME_OUT) continue;
        if (!any || status != ONI_STATUS_OK || !frame) {
            // Which of them failed OpenNI2 does not say.
            for (int i = 0; i < count; ++i) {
                owners[i]->failed = true;
                owners[i]->arrived.notify_all();
            }
            continue;
        }
        Openni2Frames* owner = owners[ready];
        if (std::find(devices_, devices_ + count_, owner) == devices_ + count_) {
            oni_->release_frame(frame);  // removed meanwhile
            continue;
        }
        owner->entries[owner->count++] = {indices[ready], frame};
        owner->arrived.notify_all();
    }
}

}  // namespace burin
