// SPDX-License-Identifier: MIT
#include "datasets/trajectory_file.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const Result<Trajectory> read = parse_tum_trajectory(fuzz::text_of(data, size), fuzz::kName);
    if (!read) {
        fuzz::check_error(read.status());
        return 0;
    }
    for (std::size_t i = 0; i < read->size(); ++i) {
        fuzz::check_rigid((*read)[i].T_world_camera);
        if (i == 0) continue;
        const std::int64_t a = (*read)[i - 1].t_ns, b = (*read)[i].t_ns;
        fuzz::check(a < b);
        const MaybePose between = pose_at(*read, a / 2 + b / 2);
        if (between.known) fuzz::check_rigid(between.T_world_camera);
    }
    // Written and read again it is the same to the last digit that is written.
    const Result<Trajectory> again = parse_tum_trajectory(format_tum_trajectory(*read), fuzz::kName);
    fuzz::check(again.ok() && again->size() == read->size());
    for (std::size_t i = 0; i < read->size(); ++i) {
        fuzz::check((*again)[i].t_ns == (*read)[i].t_ns);
        const Vec3d d = (*again)[i].T_world_camera.t - (*read)[i].T_world_camera.t;
        fuzz::check(norm(d) < 3e-9);
    }
    return 0;
}
