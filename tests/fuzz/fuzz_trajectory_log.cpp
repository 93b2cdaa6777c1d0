// SPDX-License-Identifier: MIT
#include "datasets/trajectory_file.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto poses = parse_log_trajectory(fuzz::text_of(data, size), fuzz::kName);
    if (!poses) {
        fuzz::check_error(poses.status());
        return 0;
    }
    int before = -1;
    for (const LogPose& pose : *poses) {
        fuzz::check(pose.ids[0] > before);
        before = pose.ids[0];
        fuzz::check_rigid(pose.T_world_camera);
    }
    return 0;
}
