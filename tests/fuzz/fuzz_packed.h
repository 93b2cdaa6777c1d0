// SPDX-License-Identifier: MIT
// What holds for files of frames one behind the other: .sens and .klg.
#pragma once

#include <algorithm>
#include <utility>

#include "datasets/packed_dataset.h"
#include "fuzz/fuzz_checks.h"

namespace burin::fuzz {

inline void check_packed(Status (*read)(PackedList*), const std::uint8_t* data, std::size_t size) {
    PackedList list;
    list.format = "fuzz";
    list.file = RandomFile::over(text_of(data, size), kName);
    list.cameras.depth_scale = 1000;
    const Status status = read(&list);
    if (!status.ok()) return check_error(status);
    for (const PackedFrame& frame : list.frames) {
        check(frame.depth.bytes > 0 && frame.depth.offset + frame.depth.bytes <= size);
        check(frame.colour.offset + frame.colour.bytes <= size);
        if (frame.has_pose) check_rigid(frame.T_world_camera);
    }
    if (list.cameras.depth.fx == 0) list.cameras.depth = list.cameras.colour = {64, 48, 60, 60, 32, 24};
    // Images of a size that a fuzzer can afford.
    const Camera &d = list.cameras.depth, &c = list.cameras.colour;
    if (std::int64_t{d.width} * d.height > 1 << 16 || std::int64_t{c.width} * c.height > 1 << 16) return;
    Result<std::unique_ptr<Dataset>> dataset = make_packed_dataset(std::move(list));
    if (!dataset.ok()) return check_error(dataset.status());
    Frame out;
    for (int i = 0; i < std::min((*dataset)->frame_count(), 8); ++i) {
        const Status loaded = (*dataset)->load(i, &out);
        if (!loaded.ok()) check_error(loaded);
        check(loaded.ok() != out.depth_u16.empty());
    }
}

}  // namespace burin::fuzz
