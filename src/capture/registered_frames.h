// SPDX-License-Identifier: MIT
// Frames whose depth and colour share one camera: one of the two registered to the other
// (capture/register.h).
#pragma once

#include <memory>

#include "capture/image_pool.h"
#include "capture/register.h"
#include "capture/source.h"

namespace burin {

// The numeric values are those of burin_registration.
enum class RegistrationMode : std::uint8_t { none, depth_to_colour, colour_to_depth };

struct CapturedFrame;

class RegisteredFrames {
  public:
    // What the device delivers becomes what is handed out: *info is changed accordingly (sizes, cameras,
    // extrinsics). Allocates. unsupported: a stream is missing, or colour is of a format that cannot be
    // resampled (NV12, NV21).
    Status configure(RegistrationMode mode, DeviceInfo* info);
    bool active() const { return mode_ != RegistrationMode::none; }

    // Replaces the depth or colour image of the frame by the registered one, in memory of this object, which
    // the next apply() overwrites. Images whose intrinsics are not those of their stream reconfigure, which
    // allocates. A frame without depth, or in colour_to_depth without colour, stays as it is.
    Status apply(CapturedFrame* frame);

  private:
    Status use(const Camera& depth, const Camera& colour);
    View<const std::uint8_t> rgb_of(const CapturedImage& colour);

    RegistrationMode mode_ = RegistrationMode::none;
    StreamInfo depth_, colour_;  // as the device has them
    Se3 T_colour_depth_;
    Camera used_depth_, used_colour_;
    ImageRegistration registration_;
    std::unique_ptr<std::uint16_t[]> depth_out_;  // of the colour camera's size
    std::unique_ptr<std::uint8_t[]> rgb_, colour_out_, mask_;
};

}  // namespace burin
