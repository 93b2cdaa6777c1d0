// SPDX-License-Identifier: MIT
// An open sensor of V4L2: its nodes, one a stream or two, with their metadata nodes.
#pragma once

#include <memory>

#include "capture/demosaic.h"
#include "capture/jpeg_codec.h"
#include "capture/source.h"
#include "platform/v4l2/raw_layout.h"
#include "platform/v4l2/uvc_metadata.h"
#include "platform/v4l2/v4l2_choice.h"
#include "platform/v4l2/v4l2_node.h"
#include "platform/v4l2/v4l2_sysfs.h"

namespace burin {

struct V4l2Stream {
    StreamKind kind = StreamKind::depth;
    V4l2Choice choice;
    V4l2Node node, metadata;
    bool d4xx = false;      // the metadata's format
    double clock_hz = 1e6;  // of the device
    // The last of them by frame number, of both nodes' common count.
    static constexpr int kKept = 16;
    struct Kept {
        std::uint32_t sequence = 0;
        std::uint32_t pts = 0;
        bool any = false, damaged = false;
    };
    Kept kept[kKept];
    // When a frame's own is missing: where it was against the driver's stamp.
    TickClock ticks;
    std::int64_t last_device_ns = 0, last_stamp_ns = 0;
    bool any_device_time = false;
    std::unique_ptr<Demosaic> demosaic;
    std::unique_ptr<JpegDecoder> jpeg;
    std::unique_ptr<std::uint8_t[]> scratch;  // for the half that nobody wants
};

struct V4l2Device {
    static constexpr int kMaxStreams = 4;  // depth, colour, infrared, confidence
    SourceOptions options;
    DeviceInfo info;
    RawLayout layout;
    bool has_layout = false, unit = false;  // unit: the extension unit of D4xx
    bool device_time = false;               // all streams have metadata
    V4l2Stream streams[kMaxStreams];
    int count = 0;
    SourceSink* sink = nullptr;
    char warning[500] = "";  // told at the start
};

// Hands a filled buffer of the stream to the sink; gives it back unless it was lent.
Status hand_over_v4l2(V4l2Device* d, int stream, const V4l2Filled& filled, const ImageStamp& stamp);

// What a stream of this format delivers: pixels and the streams beside it. Allocates decoders.
Status prepare_v4l2_stream(V4l2Device* d, V4l2Stream* s);

Status get_v4l2_control(V4l2Device* d, SourceControl control, ControlRange* range);
Status set_v4l2_control(V4l2Device* d, SourceControl control, double value);

}  // namespace burin
