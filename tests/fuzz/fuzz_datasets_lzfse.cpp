// SPDX-License-Identifier: MIT
#include "datasets/lzfse.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    constexpr std::size_t kRoom = 1 << 20;
    std::string out, again;
    const Status status = decode_lzfse(fuzz::text_of(data, size), fuzz::kName, kRoom, &out);
    if (!status.ok()) {
        fuzz::check_error(status);
        fuzz::check(out.empty());
        return 0;
    }
    fuzz::check(out.size() <= kRoom);
    // Just the room it needs is enough, a byte less is not.
    fuzz::check(decode_lzfse(fuzz::text_of(data, size), fuzz::kName, out.size(), &again).ok() &&
                again == out);
    fuzz::check(out.empty() ||
                !decode_lzfse(fuzz::text_of(data, size), fuzz::kName, out.size() - 1, &again).ok());
    return 0;
}
