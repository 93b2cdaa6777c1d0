// SPDX-License-Identifier: MIT
#include "datasets/imu_file.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

namespace {

bool finite(Vec3d v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const Result<std::vector<ImuSample>> read = parse_imu_text(fuzz::text_of(data, size), fuzz::kName);
    if (!read) {
        fuzz::check_error(read.status());
        return 0;
    }
    for (std::size_t i = 0; i < read->size(); ++i) {
        fuzz::check(finite((*read)[i].gyro_rad_s) && finite((*read)[i].accel_m_s2));
        fuzz::check(i == 0 || (*read)[i - 1].t_ns < (*read)[i].t_ns);
    }
    // Written and read again it is the same to the last digit that is written.
    const Result<std::vector<ImuSample>> again = parse_imu_text(format_imu(*read), fuzz::kName);
    fuzz::check(again.ok() && again->size() == read->size());
    for (std::size_t i = 0; i < read->size(); ++i) {
        fuzz::check((*again)[i].t_ns == (*read)[i].t_ns);
        fuzz::check(norm((*again)[i].gyro_rad_s - (*read)[i].gyro_rad_s) < 2e-9);
        fuzz::check(norm((*again)[i].accel_m_s2 - (*read)[i].accel_m_s2) < 2e-9);
    }
    // Two frames at any stamps: what they get together is one run of samples, bracketing where it can.
    const std::int64_t a = read->front().t_ns / 2 + read->back().t_ns / 2, b = read->back().t_ns;
    const std::vector<ImuSample> first = imu_of_frame(*read, nullptr, a), next = imu_of_frame(*read, &a, b);
    fuzz::check(!first.empty() && first.back().t_ns >= a);
    fuzz::check(a >= b || (!next.empty() && next.front().t_ns > a && next.back().t_ns == b));
    return 0;
}
