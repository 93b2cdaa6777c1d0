// SPDX-License-Identifier: MIT
// The video nodes of the system and how they belong together, from /sys/class/video4linux.
#pragma once

#include <cstddef>
#include <cstdint>

namespace burin {

struct V4l2Found {
    char node[24] = "";  // "/dev/video0"
    char name[64] = "";  // the driver's, of the card
    char driver[32] = "";
    char device[200] = "";                  // folder of the interface or platform device in sysfs
    char parent[200] = "";                  // of all nodes of one sensor: the USB device, else `device`
    int index = 0;                          // among the nodes of `device`
    int interface = -1;                     // of USB
    std::uint32_t vendor = 0, product = 0;  // of USB
    char serial[64] = "";
    char location[64] = "";  // the last part of `parent`: "1-2.3" of USB
};

inline constexpr int kMaxV4l2Nodes = 64;

// At most kMaxV4l2Nodes, by their numbers.
int find_v4l2_nodes(V4l2Found* found);

// The USB descriptors of the sensor; bytes read.
std::size_t read_usb_descriptors(const V4l2Found& found, std::uint8_t* out, std::size_t room);

}  // namespace burin
