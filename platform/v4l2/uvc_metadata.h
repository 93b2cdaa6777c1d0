// SPDX-License-Identifier: MIT
// What the metadata node of uvcvideo tells of a frame: the payload headers as they came (V4L2_META_FMT_UVC,
// 'UVCH'), for RealSense with the metadata behind them ('D4XX'). Sources:
// Documentation/userspace-api/media/v4l/metafmt-uvc.rst and metafmt-d4xx.rst of Linux; USB Video
// Class 1.5, 2.4.3.3. All of it is untrusted.
#pragma once

#include <cstddef>
#include <cstdint>

namespace burin {

struct UvcFrameMetadata {
    bool any = false;       // at least one whole header
    bool has_pts = false;   // presentation time stamp: the device's clock when the frame's capture began
    std::uint32_t pts = 0;  // ticks of the device's clock
    bool error = false;     // a header with its error bit
    // Of D4XX only.
    bool has_counter = false;
    std::uint32_t counter = 0;  // of frames
    bool has_depth_control = false;
    std::uint32_t laser_power_mw = 0, exposure_us = 0;
};

// Reads no byte beyond `bytes`; what does not fit together ends the reading.
UvcFrameMetadata parse_uvc_metadata(const std::uint8_t* data, std::size_t bytes, bool d4xx);

// The clock frequency of a video control interface (Hz) out of a device's descriptors (as in sysfs), 0 when
// it is not there. interface_number: of the control interface or of one of its streaming interfaces.
std::uint32_t uvc_clock_hz(const std::uint8_t* descriptors, std::size_t bytes, int interface_number);

// Ticks of 32 bits that wrap around, as ns that do not.
class TickClock {
  public:
    explicit TickClock(double hz = 1e6) : ns_a_tick_(hz > 0 ? 1e9 / hz : 1000) {}
    std::int64_t ns(std::uint32_t ticks) {
        if (!any_) last_ = ticks;
        // The nearer way round: stamps of two streams may come a little out of order.
        total_ += static_cast<std::int32_t>(ticks - last_);
        any_ = true;
        last_ = ticks;
        return static_cast<std::int64_t>(static_cast<double>(total_) * ns_a_tick_) + kStart_ns;
    }

  private:
    static constexpr std::int64_t kStart_ns = 1'000'000'000'000;  // so that nothing is negative
    double ns_a_tick_;
    std::int64_t total_ = 0;
    std::uint32_t last_ = 0;
    bool any_ = false;
};

}  // namespace burin
