// SPDX-License-Identifier: MIT
#include "datasets/file_dataset.h"
#include "datasets/icl_nuim.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text = fuzz::text_of(data, size);
    if (const Result<Se3> pose = parse_povray_camera(text, fuzz::kName))
        fuzz::check_rigid(*pose);
    else
        fuzz::check_error(pose.status());
    const Camera small{4, 2, 3, 3, 1.5, 0.5};
    Image<float> depth_m;
    if (const Status status = parse_povray_depth(text, fuzz::kName, small, &depth_m)) {
        fuzz::check(depth_m.width == 4 && depth_m.height == 2 && depth_m.pixels.size() == 8);
        for (const float z : depth_m.pixels) fuzz::check(z >= 0 && z <= 100);
    } else {
        fuzz::check_error(status);
        fuzz::check(depth_m.empty());
    }
    return 0;
}
