// SPDX-License-Identifier: MIT
#include "datasets/camera_file.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

namespace {

void take(const Result<CameraFile>& file, bool flipped) {
    if (!file) return fuzz::check_error(file.status());
    fuzz::check(file->depth.fx > 0 && file->colour.fx > 0 && file->colour.fy > 0);
    fuzz::check(file->depth.fy > 0 || (flipped && file->depth.fy < 0));
    fuzz::check(file->depth_scale >= 0 && std::isfinite(file->depth_scale));
    fuzz::check(file->depth.width >= 0 && file->depth.width <= kMaxImageSide);
    fuzz::check_rigid(file->T_colour_depth);
    fuzz::check_rigid(file->T_camera_imu);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text = fuzz::text_of(data, size);
    take(parse_camera_text(text, fuzz::kName), false);
    take(parse_camera_text(text, fuzz::kName, true), true);
    take(parse_intrinsic_matrix(text, fuzz::kName), false);
    return 0;
}
