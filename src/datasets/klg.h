// SPDX-License-Identifier: MIT
// Inside of the room: the headers of a .klg file, for the fuzzer.
#pragma once

#include "datasets/packed_dataset.h"

namespace burin {

// Reads list->file: where each frame's images lie, and stamps. Sizes of images that list->cameras does not
// say are taken from the first frame.
Status read_klg(PackedList* list);

}  // namespace burin
