// SPDX-License-Identifier: MIT
// The depth extension unit of a RealSense D4xx, through the kernel's UVCIOC_CTRL_QUERY.
#pragma once

#include "capture/source.h"
#include "core/status.h"

namespace burin {

// Does the camera behind this node have the unit? (USB product ids say little: new ones come every year.)
bool has_d4xx_unit(int fd);

// Serial number, intrinsics and extrinsic of the streams that info has. What the device tells wrongly or not
// at all is logged by the status and left nominal: streams work without.
Status read_d4xx(int fd, DeviceInfo* info);

// unsupported: no control of the unit.
Status get_d4xx_control(int fd, SourceControl control, ControlRange* range);
Status set_d4xx_control(int fd, SourceControl control, double value);

}  // namespace burin
