// SPDX-License-Identifier: MIT
#include "datasets/trajectory_file.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text = fuzz::text_of(data, size);
    const auto lines = parse_matrix_lines(text, fuzz::kName);
    if (!lines)
        fuzz::check_error(lines.status());
    else
        for (const MaybePose& pose : *lines)
            if (pose.known) fuzz::check_rigid(pose.T_world_camera);
    const auto one = parse_pose_file(text, fuzz::kName);
    if (!one)
        fuzz::check_error(one.status());
    else if (one->known)
        fuzz::check_rigid(one->T_world_camera);
    return 0;
}
