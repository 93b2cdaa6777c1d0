// SPDX-License-Identifier: MIT
#include "datasets/tum_layout.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text = fuzz::text_of(data, size);
    if (const auto pairs = parse_associations(text, fuzz::kName)) {
        fuzz::check(!pairs->empty());
        for (std::size_t i = 0; i < pairs->size(); ++i) {
            fuzz::check(!(*pairs)[i].depth.file.empty() && !(*pairs)[i].colour.file.empty());
            if (i > 0) fuzz::check((*pairs)[i - 1].depth.t_ns < (*pairs)[i].depth.t_ns);
        }
    } else {
        fuzz::check_error(pairs.status());
    }
    // The two halves of the text as rgb.txt and depth.txt.
    const auto colour = parse_stamped_list(text.substr(0, size / 2), fuzz::kName);
    const auto depth = parse_stamped_list(text.substr(size / 2), fuzz::kName);
    if (!colour) fuzz::check_error(colour.status());
    if (!depth) fuzz::check_error(depth.status());
    if (!colour || !depth) return 0;
    const auto pairs = pair_by_time(*colour, *depth);
    fuzz::check(pairs.size() <= colour->size() && pairs.size() <= depth->size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        fuzz::check(std::abs(pairs[i].colour.t_ns - pairs[i].depth.t_ns) <= kMaxPairGapNs);
        if (i > 0) fuzz::check(pairs[i - 1].depth.t_ns < pairs[i].depth.t_ns);
    }
    return 0;
}
