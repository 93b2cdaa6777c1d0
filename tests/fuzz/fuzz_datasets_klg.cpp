// SPDX-License-Identifier: MIT
#include "datasets/klg.h"
#include "fuzz/fuzz_packed.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    burin::fuzz::check_packed(burin::read_klg, data, size);
    return 0;
}
