// SPDX-License-Identifier: MIT
// The thread of a live source: pumps the device, restarts one that fell silent, waits for one that was
// unplugged.
#include <chrono>
#include <cstring>

#include "capture/live_source.h"
#include "capture/monotonic.h"

namespace burin {
namespace {

// How long one pump may wait: the longest that a companion's absence goes unnoticed and that stop() waits.
constexpr std::int64_t kPump_ns = 10'000'000;
// Silence after which a device is restarted: longer than any exposure or a projector's warm-up, and short
// enough that a hand-held scan can still be found again.
constexpr std::int64_t kSilence_ns = 1'000'000'000;
// A device that three restarts do not wake will not wake by a fourth.
constexpr int kRestarts = 3;
// Twenty looks within the two seconds in which a device that is back must stream.
constexpr std::chrono::milliseconds kLook{100};

}  // namespace

void* LiveSource::enter(void* self) {
    static_cast<LiveSource*>(self)->run();
    return nullptr;
}

void LiveSource::run() {
    for (;;) {
        Status ended;
        if (!run_device(&ended)) return;
        const bool away = ended.code() == Code::disconnected;
        {
            const std::lock_guard lock(mutex_);
            emit(INT64_MAX);  // what is left unpaired goes alone
            failure_ = ended;
            state_ = ended.code() == Code::ended ? SourceState::ended
                     : away                      ? SourceState::unplugged
                                                 : SourceState::failed;
            changed_.notify_all();
        }
        if (ended.code() == Code::ended) return;
        log(away ? LogLevel::warning : LogLevel::error, "%s", ended.text());
        if (!away || !options_.reconnect) return;
        let_go();
        if (!wait_for_return()) return;
    }
}

// True: the device ended, *ended says how. False: told to stop.
bool LiveSource::run_device(Status* ended) {
    int restarts = 0;
    std::uint64_t frames_at_restart = 0;
    for (;;) {
        Status pumped = backend_->pump(device_, monotonic_ns() + kPump_ns);
        bool silent = false;
        std::uint64_t captured = 0;
        {
            const std::lock_guard lock(mutex_);
            if (stopping_) return false;
            const std::int64_t now_ns = monotonic_ns();
            emit(now_ns);
            // A consumer that holds everything up is no silence of the device.
            const bool held_up = options_.lossless && ready_count_ >= options_.waiting_frames;
            silent = !held_up && now_ns - last_image_ns_ > kSilence_ns;
            for (const StreamStatistics& s : statistics_.streams) captured += s.captured;
        }
        if (pumped.code() == Code::disconnected || pumped.code() == Code::ended) {
            *ended = pumped;
            return true;
        }
        if (pumped.ok() && !silent) continue;
        if (pumped.ok())
            pumped = Status::error(Code::timeout, "%s:%s (%s) has sent nothing for %.1f s", backend_->name,
                                   address_, info_.name, static_cast<double>(kSilence_ns) * 1e-9);
        if (captured != frames_at_restart) restarts = 0;
        frames_at_restart = captured;
        if (++restarts > kRestarts) {
            *ended = pumped;
            return true;
        }
        log(LogLevel::warning, "%s; streaming is started again (%d of %d)", pumped.text(), restarts,
            kRestarts);
        const std::lock_guard device_lock(device_mutex_);
        (void)backend_->stop(device_);
        give_up_images();
        Status started = backend_->start(device_, this);
        const std::lock_guard lock(mutex_);
        ++statistics_.restarts;
        last_image_ns_ = monotonic_ns();
        if (started.code() == Code::disconnected) {
            *ended = started;
            return true;
        }
    }
}

// Frees all images of the device, waiting for the one that the consumer has when it is lent.
void LiveSource::give_up_images() {
    std::unique_lock lock(mutex_);
    flush();
    changed_.wait(lock, [&] { return stopping_ || !holding_ || !lent(held_); });
}

bool LiveSource::lent(const Bundle& bundle) {
    for (int k = 0; k < kStreamKinds; ++k)
        if (bundle.slots[k] >= 0 && pool_.at(static_cast<StreamKind>(k), bundle.slots[k]).lent) return true;
    return false;
}

void LiveSource::let_go() {
    const std::lock_guard device_lock(device_mutex_);
    (void)backend_->stop(device_);
    give_up_images();
    std::unique_lock lock(mutex_);
    if (holding_ && lent(held_)) return;  // told to stop: stop() and close() see to it
    lock.unlock();
    backend_->close(device_);
    device_ = nullptr;
}

bool LiveSource::wait_for_return() {
    for (;;) {
        {
            std::unique_lock lock(mutex_);
            changed_.wait_for(lock, kLook, [&] { return stopping_; });
            if (stopping_) return false;
        }
        const Status opened = reopen();
        if (opened.ok()) return true;
    }
}

Status LiveSource::reopen() {
    struct Search {
        const DeviceInfo* info;
        const char* address;
        DeviceEntry found;
        bool any;
    } search = {&info_, address_, {}, false};
    BURIN_TRY(backend_->list(
        [](void* user, const DeviceEntry& entry) {
            auto* s = static_cast<Search*>(user);
            const bool same = s->info->serial[0]     ? std::strcmp(s->info->serial, entry.serial) == 0
                              : s->info->location[0] ? std::strcmp(s->info->location, entry.location) == 0
                                                     : std::strcmp(s->address, entry.address) == 0;
            if (!same || s->any || entry.access != DeviceAccess::ready) return;
            s->found = entry;
            s->any = true;
        },
        &search));
    if (!search.any) return Status::error(Code::disconnected, "still away");
    const std::lock_guard device_lock(device_mutex_);
    DeviceInfo info;
    BURIN_TRY(backend_->open(search.found.address, options_.device, &device_, &info));
    for (int k = 0; k < kStreamKinds; ++k) {
        const StreamInfo &was = info_.streams[k], &is = info.streams[k];
        if (was.width == is.width && was.height == is.height && was.image_bytes == is.image_bytes) continue;
        backend_->close(device_);
        device_ = nullptr;
        return Status::error(Code::unsupported, "%s is %dx%d now, was %dx%d",
                             stream_name(static_cast<StreamKind>(k)), is.width, is.height, was.width,
                             was.height);
    }
    {
        const std::lock_guard lock(mutex_);
        clock_.reset();
        clock_known_ = false;
        imu_.reset();
        std::fill(std::begin(sequence_known_), std::end(sequence_known_), false);
        last_image_ns_ = monotonic_ns();
    }
    const Status started = backend_->start(device_, this);
    if (!started.ok()) {
        backend_->close(device_);
        device_ = nullptr;
        return started;
    }
    const std::lock_guard lock(mutex_);
    std::snprintf(address_, sizeof address_, "%s", search.found.address);
    ++statistics_.reconnects;
    state_ = SourceState::streaming;
    log(LogLevel::info, "%s:%s (%s) is back", backend_->name, address_, info_.name);
    changed_.notify_all();
    return {};
}

}  // namespace burin
