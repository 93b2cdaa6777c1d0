// SPDX-License-Identifier: MIT
// Sizes of tests under emulation (./dev cross), where floating point is a hundred times slower: the same
// checks on fewer frames, voxels or rounds. What runs there proves the code that the cross compiler made;
// that the numbers hold on the full size is proven where the machine is its own.
#pragma once

namespace burin {

#if defined(BURIN_EMULATED)
constexpr bool kEmulated = true;
#else
constexpr bool kEmulated = false;
#endif

template <class T>
constexpr T sized(T full, T emulated) {
    return kEmulated ? emulated : full;
}

}  // namespace burin
