// SPDX-License-Identifier: MIT
// Which format, size and rate of a node.
#pragma once

#include "capture/source.h"
#include "platform/v4l2/v4l2_formats.h"

namespace burin {

struct V4l2Choice {
    const V4l2Format* format = nullptr;
    int rank = 0;  // the less the better, among formats of all nodes
    int width = 0, height = 0;
    double fps = 0;
    std::uint64_t stride = 0;  // bytes of a row, as set
    std::uint64_t bytes = 0;   // of an image buffer, as set
};

// The best format of the node that shows `kind`, by the options' sizes, rate and names. choice->format stays
// null where the node has none. Does not change the node.
Status choose_v4l2_format(int fd, const char* node, StreamKind kind, const SourceOptions& options,
                          V4l2Choice* choice);

// Sets it; fills stride, bytes and the rate that there is. unsupported: the driver makes something else of
// it.
Status set_v4l2_format(int fd, const char* node, V4l2Choice* choice);

// Names, sizes and rates of all formats that we read, as text: "Z16 640x480@30, YUYV 640x480@30".
void describe_v4l2_formats(int fd, char* out, std::size_t room);

}  // namespace burin
