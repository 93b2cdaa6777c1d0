// SPDX-License-Identifier: MIT
// The streams of one OpenNI2 device: modes, frames.
#pragma once

#include <atomic>

#include "capture/source.h"
#include "platform/openni2/openni2_library.h"
#include "platform/openni2/openni2_reader.h"

namespace burin {

struct Openni2Stream {
    StreamKind kind;
    OniStreamHandle handle = nullptr;
    StreamInfo info;
};

struct Openni2Device {
    const Openni2* oni = nullptr;
    OniDeviceHandle handle = nullptr;
    OniCallbackHandle callbacks = nullptr;
    char uri[ONI_MAX_STR] = "";
    DeviceInfo info;
    Openni2Stream streams[kOniStreams];
    int stream_count = 0;
    bool recording = false, lend = true, streaming = false;
    SourceSink* sink = nullptr;
    Openni2Frames frames;
    std::atomic<bool> gone{false}, over{false};
};

// Creates the stream with the best mode that fits the options and fills its StreamInfo. ok with
// d->stream_count as it was: the device has no such sensor.
Status add_openni2_stream(Openni2Device* d, StreamKind kind, const SourceOptions& options);

// Hands one frame of the stream to the sink.
void take_openni2_frame(Openni2Device* d, const Openni2Stream& stream, OniFrame* frame);

}  // namespace burin
