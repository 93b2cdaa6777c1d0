// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include "core/jobs.h"

namespace burin {

// Rows an item: 640 pixels take a kernel less than a microsecond, about as long as handing out an item.
inline constexpr int kRowBlock = 16;

// body(y) for every row, in blocks of rows over the threads.
template <class Body>
void for_row_blocks(int height, Jobs& jobs, Body&& body) {
    jobs.run((height + kRowBlock - 1) / kRowBlock, [&](int block, int) {
        for (int y = block * kRowBlock; y < std::min(height, (block + 1) * kRowBlock); ++y) body(y);
    });
}

}  // namespace burin
