// SPDX-License-Identifier: MIT
#include "datasets/camera_file.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

namespace {

void take(const Result<CameraFile>& file) {
    if (!file) return fuzz::check_error(file.status());
    fuzz::check(check_camera(file->depth, "depth").ok() && check_camera(file->colour, "colour").ok());
    fuzz::check(file->depth_scale >= 0 && std::isfinite(file->depth_scale));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text = fuzz::text_of(data, size);
    take(parse_cam_params_json(text, fuzz::kName));
    take(parse_open3d_intrinsic_json(text, fuzz::kName));
    return 0;
}
