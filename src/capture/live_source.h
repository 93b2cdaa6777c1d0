// SPDX-License-Identifier: MIT
// A sensor that streams: one back end's device with what all of them share. A thread pumps the device; images
// wait in fixed memory until next() hands them out in pairs. A cable that is pulled is a state; when the
// device comes back (same serial or same port) it streams again by itself.
#pragma once

#include <pthread.h>

#include <condition_variable>
#include <memory>
#include <mutex>

#include "capture/clock_map.h"
#include "capture/image_pool.h"
#include "capture/imu_queue.h"
#include "capture/pairing.h"
#include "capture/registered_frames.h"
#include "capture/rolling.h"
#include "capture/source.h"

namespace burin {

// The numeric values are those of burin_source_state.
enum class SourceState : std::uint8_t { closed, open, streaming, unplugged, ended, failed };
const char* state_name(SourceState state);

struct LiveOptions {
    SourceOptions device;
    // Nothing is dropped by us: a consumer too slow holds up the device, whose driver then loses images (gaps
    // in their sequence numbers). Otherwise the newest frames win.
    bool lossless = false;
    int waiting_frames =
        3;  // frames that may wait for next(), 1..32: at 30 a second a tenth of a second of hiccups
    bool reconnect = true;
    RegistrationMode registration = RegistrationMode::none;
    bool keep_damaged = false;  // deliver images whose stamp says damaged
    void (*log)(void* user, LogLevel level, const char* line) = nullptr;  // from any thread of the source
    void* log_user = nullptr;
};

struct StreamStatistics {
    std::uint64_t captured = 0;   // whole images that came
    std::uint64_t delivered = 0;  // handed out by next()
    std::uint64_t lost = 0;       // gaps in the device's or driver's sequence
    std::uint64_t damaged = 0;
    std::uint64_t dropped = 0;  // by us: no room, or newer ones won
};

struct SourceStatistics {
    SourceState state = SourceState::closed;
    StreamStatistics streams[kStreamKinds];
    std::uint64_t frames = 0, reconnects = 0, restarts = 0;
    std::uint64_t ring_bytes = 0;
    // Of the last 256 frames, milliseconds: from the last byte's arrival until next() returned it; and from
    // the device's stamp until the last byte's arrival, above the least there was.
    double wait_p50_ms = 0, wait_p95_ms = 0, wait_max_ms = 0;
    double delay_p50_ms = 0, delay_p95_ms = 0, delay_max_ms = 0;
    double drift_ppm = 0;  // of the device's clock against the host's
};

struct CapturedFrame {
    std::int64_t t_ns = 0;  // of the leading image
    CapturedImage images[kStreamKinds];
    const ImuSample* imu = nullptr;  // as Frame::imu, on the clock of t_ns
    int imu_count = 0;

    bool has(StreamKind kind) const { return images[static_cast<int>(kind)].pixels != nullptr; }
    const CapturedImage& at(StreamKind kind) const { return images[static_cast<int>(kind)]; }
};

class LiveSource final : SourceSink {
  public:
    LiveSource() = default;
    ~LiveSource() override { close(); }
    LiveSource(const LiveSource&) = delete;
    LiveSource& operator=(const LiveSource&) = delete;

    // Errors: those of the back end.
    Status open(const SourceBackend& backend, const char* address, const LiveOptions& options);
    // Of what next() hands out; registration changes what the device delivers.
    const DeviceInfo& info() const { return delivered_; }
    // The ring is allocated here; nothing is while streaming. Errors: state, insufficient_memory, the back
    // end's.
    Status start();
    // The next frame, which stays valid until the following next(), stop() or close(). The frame before is
    // given back first. timeout: none within timeout_ns (0: look only). disconnected: none, and the device is
    // away (with reconnect it may come back: call again). ended: a recording has no more. Otherwise what
    // ended streaming.
    Status next(std::int64_t timeout_ns, CapturedFrame* frame);
    Status stop();
    void close();

    Status get(SourceControl control, ControlRange* range);
    Status set(SourceControl control, double value);
    SourceState state() const;
    SourceStatistics statistics() const;

  private:
    // SourceSink
    std::uint8_t* acquire(StreamKind kind) override;
    void commit(StreamKind kind, std::uint8_t* image, const ImageStamp& stamp) override;
    void abandon(StreamKind kind, std::uint8_t* image) override;
    void lend(StreamKind kind, const std::uint8_t* image, std::size_t stride_bytes, std::uint64_t token,
              int dmabuf_fd, const ImageStamp& stamp) override;
    void imu(const ImuSample& sample) override;
    void count_damaged(StreamKind kind, int images) override;
    void log(LogLevel level, const char* format, ...) override __attribute__((format(printf, 3, 4)));

    static constexpr std::int64_t kLongestWait_ns =
        3'600'000'000'000;  // an hour: no overflow, and nobody waits longer

    static void* enter(void* self);
    void run();
    bool run_device(Status* ended);  // pumps until told to stop (false) or the device ended
    bool wait_for_return();          // looks for the device until it streams again; false: told to stop
    Status reopen();
    void let_go();  // stops and closes the device
    void give_up_images();
    bool lent(const Bundle& bundle);

    void take_in(StreamKind kind, int slot, const ImageStamp& stamp);
    void emit(std::int64_t now_ns);
    void drop(StreamKind kind, int slot);
    void drop_bundle(const Bundle& bundle, bool count);
    bool make_room();
    int free_slot(StreamKind kind);                              // -1: none; counted
    void wait_for_consumer(std::unique_lock<std::mutex>& lock);  // in lossless mode
    void flush();
    void hand_out(const Bundle& bundle, CapturedFrame* frame);

    const SourceBackend* backend_ = nullptr;
    char address_[4096] = "";  // PATH_MAX: of a recording it is a path
    LiveOptions options_;
    void* device_ = nullptr;
    DeviceInfo info_, delivered_;  // the device's; what is handed out
    RegisteredFrames registered_;

    mutable std::mutex device_mutex_;  // of calls into the back end beside pump and give_back
    mutable std::mutex mutex_;         // of all below
    std::condition_variable changed_;  // a frame is ready, room was made, the state is another
    SourceState state_ = SourceState::closed;
    Status failure_;
    bool stopping_ = false, running_ = false;
    pthread_t thread_ = {};

    ImagePool pool_;
    Pairing pairing_;
    // In lossless mode what was being paired joins those that wait.
    static constexpr int kMaxReady = 32;
    Bundle ready_[kMaxReady + Pairing::kWaiting];
    int ready_count_ = 0;
    Bundle held_;  // the consumer's
    bool holding_ = false;
    ClockMap clock_;
    bool clock_known_ = false;  // an image with device time has come since the device began
    ImuQueue imu_;
    ImuSample imu_of_frame_[ImuQueue::kSamples];
    std::uint64_t next_sequence_[kStreamKinds] = {};
    bool sequence_known_[kStreamKinds] = {};
    std::int64_t last_image_ns_ = 0, last_frame_ns_ = 0;
    SourceStatistics statistics_;
    Rolling wait_ms_, delay_ms_;
};

}  // namespace burin
