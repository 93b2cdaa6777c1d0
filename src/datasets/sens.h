// SPDX-License-Identifier: MIT
// Inside of the room: the headers of a ScanNet .sens file, for the fuzzer.
#pragma once

#include "datasets/packed_dataset.h"

namespace burin {

// Reads list->file: cameras, where each frame's images lie, poses, stamps.
Status read_sens(PackedList* list);

}  // namespace burin
