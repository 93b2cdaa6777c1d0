// SPDX-License-Identifier: MIT
// A recording (docs/recording.md) in place of a sensor. Addresses: "DIR" or "DIR?option&option" with
//     pace=real   images come when they did (the default). host_ns is the moment of delivery, decoded before,
//                 so latencies are those of a sensor. Pauses of more than half a second are cut to that: a
//                 silent device would be restarted
//     pace=fast   as fast as they are taken. host_ns keeps the recording's pace, since drift and delays are
//                 worked out from it; the latencies told say nothing
//     loop=1      begins again after the last frame; sequence numbers and stamps go on rising
// Device stamps are the recording's shared clock (t_ns), moved so that it begins now. Stopped and started
// again it goes on where it was. What is damaged is counted as that.
#pragma once

#include "capture/source.h"

namespace burin {

extern const SourceBackend kReplayBackend;

}  // namespace burin
