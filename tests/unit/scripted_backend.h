// SPDX-License-Identifier: MIT
// A back end that does what a test tells it: the one thing about a live source that no real device can be
// made to do at will. Stands in for the device only; everything above it is real.
#pragma once

#include <atomic>
#include <cstring>
#include <mutex>
#include <set>

#include "capture/monotonic.h"
#include "capture/source.h"

namespace burin {

struct Script {
    // Set by the test, also while it streams.
    std::atomic<bool> plugged{true}, silent{false}, fail_pump{false}, damaged{false};
    std::atomic<int> colour_every{1};  // a colour image with every n-th depth image; 0: none
    std::atomic<int> skip{0};          // sequence numbers to leave out next
    std::atomic<std::int64_t> period_ns{5'000'000};
    std::atomic<int> end_after{-1};  // images, then ended
    std::int64_t clock_ns = 77;      // the device's, at its first image
    bool lend = false, imu = false, camera = false;
    // Told to the test.
    std::atomic<int> opens{0}, closes{0}, starts{0}, stops{0}, lent{0}, given_back{0};
    std::mutex mutex;
    std::set<std::uint64_t> out;  // tokens that were lent and not given back
};
inline Script* script = nullptr;

inline constexpr int kScriptWidth = 16, kScriptHeight = 8;
inline constexpr std::uint16_t kScriptDepth_mm = 1500;  // of every pixel but the first, with `camera`

struct ScriptedDevice {
    DeviceInfo info;
    SourceSink* sink = nullptr;
    std::uint64_t sequence = 0;
    std::int64_t next_ns = 0;
    std::uint16_t memory[32][kScriptWidth * kScriptHeight];
};

inline Status scripted_list(DeviceVisit visit, void* user) {
    if (!script->plugged) return {};
    DeviceEntry e;
    std::snprintf(e.address, sizeof e.address, "it");
    std::snprintf(e.serial, sizeof e.serial, "S1");
    visit(user, e);
    return {};
}

inline Status scripted_open(const char*, const SourceOptions& options, void** device, DeviceInfo* info) {
    if (!script->plugged) return Status::error(Code::disconnected, "scripted: not there");
    auto* d = new ScriptedDevice();
    std::snprintf(d->info.serial, sizeof d->info.serial, "S1");
    for (const StreamKind kind : {StreamKind::depth, StreamKind::colour}) {
        if (!(options.streams & stream_bit(kind))) continue;
        StreamInfo& s = d->info.at(kind);
        s.kind = kind;
        s.pixels = kind == StreamKind::depth ? StreamPixels::u16 : StreamPixels::colour;
        s.colour_format = PixelFormat::grey8;
        s.width = kScriptWidth;
        s.height = kScriptHeight;
        s.fps = 1e9 / static_cast<double>(script->period_ns.load());
        if (script->camera) s.camera = {kScriptWidth, kScriptHeight, 16, 16, 7.5, 3.5};
        set_image_bytes(&s);
    }
    d->info.has_imu = script->imu;
    *info = d->info;
    *device = d;
    ++script->opens;
    return {};
}

inline Status scripted_start(void* device, SourceSink* sink) {
    auto* d = static_cast<ScriptedDevice*>(device);
    if (!script->plugged) return Status::error(Code::disconnected, "scripted: not there");
    d->sink = sink;
    d->next_ns = monotonic_ns() + script->period_ns;
    ++script->starts;
    return {};
}

// Pixel 0 of a depth image is its sequence number.
inline Status scripted_pump(void* device, std::int64_t deadline_ns) {
    auto* d = static_cast<ScriptedDevice*>(device);
    if (!script->plugged) return Status::error(Code::disconnected, "scripted: pulled out");
    if (script->fail_pump) return Status::error(Code::format, "scripted: nonsense from the device");
    if (script->end_after >= 0 && d->sequence >= static_cast<std::uint64_t>(script->end_after))
        return Status::error(Code::ended, "scripted: over");
    if (script->silent || deadline_ns < d->next_ns) {
        sleep_until_ns(deadline_ns);
        return {};
    }
    sleep_until_ns(d->next_ns);
    d->next_ns += script->period_ns;
    d->sequence += static_cast<std::uint64_t>(script->skip.exchange(0));
    ImageStamp stamp;
    stamp.sequence = d->sequence;
    stamp.device_ns = script->clock_ns + static_cast<std::int64_t>(d->sequence) * script->period_ns;
    stamp.has_device_time = true;
    stamp.host_ns = monotonic_ns();
    stamp.damaged = script->damaged;
    if (script->imu)
        for (int i = 0; i < 4; ++i) d->sink->imu({stamp.device_ns + i * script->period_ns / 4, {}, {}});
    const int every = script->colour_every;
    if (d->info.has(StreamKind::colour) && every > 0 && d->sequence % static_cast<std::uint64_t>(every) == 0)
        if (std::uint8_t* image = d->sink->acquire(StreamKind::colour)) {
            std::memset(image, static_cast<int>(d->sequence & 255), kScriptWidth * kScriptHeight);
            d->sink->commit(StreamKind::colour, image, stamp);
        }
    const auto first = static_cast<std::uint16_t>(d->sequence);
    if (script->lend) {
        std::uint16_t* pixels = nullptr;
        const std::uint64_t token = d->sequence;
        {
            const std::lock_guard lock(script->mutex);
            if (script->out.size() < 32 && !script->out.count(token)) {
                pixels = d->memory[token % 32];
                script->out.insert(token);
            }
        }
        if (pixels) {
            pixels[0] = first;
            ++script->lent;
            d->sink->lend(StreamKind::depth, reinterpret_cast<std::uint8_t*>(pixels), 2 * kScriptWidth, token,
                          -1, stamp);
        }
    } else if (std::uint8_t* image = d->sink->acquire(StreamKind::depth)) {
        std::memcpy(image, &first, 2);
        for (int i = 1; i < kScriptWidth * kScriptHeight && script->camera; ++i)
            std::memcpy(image + 2 * i, &kScriptDepth_mm, 2);
        d->sink->commit(StreamKind::depth, image, stamp);
    }
    ++d->sequence;
    return {};
}

inline Status scripted_stop(void*) {
    ++script->stops;
    return {};
}
inline void scripted_close(void* device) {
    ++script->closes;
    delete static_cast<ScriptedDevice*>(device);
}
inline void scripted_give_back(void*, std::uint64_t token) {
    const std::lock_guard lock(script->mutex);
    script->given_back += static_cast<int>(script->out.erase(token));
}

inline const SourceBackend kScriptedBackend = {
    "scripted",    "for tests",    scripted_list,      scripted_open, scripted_start, scripted_pump,
    scripted_stop, scripted_close, scripted_give_back, nullptr,       nullptr};

}  // namespace burin
