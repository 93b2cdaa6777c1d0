// SPDX-License-Identifier: MIT
#include "platform/usb/accelerometer.h"

#include "capture/monotonic.h"
#include "platform/usb/bytes.h"

namespace burin {
namespace {

// Thirty times a second, as often as images come; the part itself is filtered at 50 Hz.
constexpr std::int64_t kPeriod_ns = 33'333'333;
constexpr std::uint8_t kReadState = 0x32;
constexpr int kStateBytes = 10;
constexpr double kCountsPerG = 819, kG_m_s2 = 9.80665;
// Then it is left alone, with one line.
constexpr int kMaxFailures = 10;

}  // namespace

bool parse_accelerometer(const std::uint8_t* data, int bytes, Vec3d* accel_m_s2) {
    if (bytes != kStateBytes) return false;
    const auto at = [&](int i) {
        return static_cast<std::int16_t>(be16(data + 2 * i)) / kCountsPerG * kG_m_s2;
    };
    *accel_m_s2 = {at(1), at(2), at(3)};
    return true;
}

void Accelerometer::start(UsbIo* motor, SourceSink* sink) {
    *this = Accelerometer();
    motor_ = motor;
    sink_ = sink;
    // The first question makes the transfer that all others use.
    if (motor_->read_later(kReadState, kStateBytes, this)) next_ns_ = monotonic_ns() + kPeriod_ns;
}

void Accelerometer::stop() {
    if (motor_) (void)motor_->close_pipes();
    motor_ = nullptr;
}

Status Accelerometer::pump(std::int64_t now_ns) {
    if (!motor_) return {};
    const Status pumped = motor_->pump(now_ns);
    if (!pumped.ok()) {
        sink_->log(LogLevel::warning, "accelerometer: %s; no more readings", pumped.text());
        stop();
        return {};
    }
    if (now_ns >= next_ns_ && motor_->read_later(kReadState, kStateBytes, this))
        next_ns_ = now_ns + kPeriod_ns;
    return {};
}

void Accelerometer::bytes(const std::uint8_t* data, int length) {
    ImuSample sample;
    if (!parse_accelerometer(data, length, &sample.accel_m_s2)) return lost();
    failures_ = 0;
    // On the images' clock, as far as they have come: the reading is of now.
    const std::int64_t now_ns = monotonic_ns();
    sample.t_ns = clock_known_ ? device_ns_ + (now_ns - host_ns_) : now_ns;
    if (sample.t_ns <= last_ns_) return;
    last_ns_ = sample.t_ns;
    sink_->imu(sample);
}

void Accelerometer::lost() {
    if (++failures_ != kMaxFailures) return;
    sink_->log(LogLevel::warning, "accelerometer: %d readings failed; no more are taken", failures_);
    next_ns_ = INT64_MAX;
}

}  // namespace burin
