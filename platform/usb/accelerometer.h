// SPDX-License-Identifier: MIT
// The accelerometer in the Kinect's base (045e:02b0): asked thirty times a second, never waited for.
#pragma once

#include <cstdint>

#include "capture/source.h"
#include "platform/usb/usb_io.h"

namespace burin {

// Ten bytes, big-endian: state, error, x, y, z as 16-bit counts, angle of the base, its state. False: the
// length is another. Counts are 819 a g (Kionix KXSD9, as libfreenect reads it).
bool parse_accelerometer(const std::uint8_t* data, int bytes, Vec3d* accel_m_s2);

class Accelerometer final : public UsbReceiver {
  public:
    void start(UsbIo* motor, SourceSink* sink);
    void stop();
    // Asks again when it is time. An image of the device came last at host_ns with device_ns on its clock.
    Status pump(std::int64_t now_ns);
    void image_at(std::int64_t device_ns, std::int64_t host_ns) {
        device_ns_ = device_ns, host_ns_ = host_ns, clock_known_ = true;
    }

    void bytes(const std::uint8_t* data, int length) override;
    void lost() override;

  private:
    UsbIo* motor_ = nullptr;
    SourceSink* sink_ = nullptr;
    std::int64_t next_ns_ = 0, device_ns_ = 0, host_ns_ = 0, last_ns_ = 0;
    bool clock_known_ = false;
    int failures_ = 0;
};

}  // namespace burin
