// SPDX-License-Identifier: MIT
#include "core/camera.h"
#include "datasets/image_file.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view bytes = fuzz::text_of(data, size);
    const Result<ImageInfo> info = decode_image_info(bytes, fuzz::kName);
    if (!info) fuzz::check_error(info.status());
    Image<std::uint16_t> depth;
    if (const Status status = decode_depth(bytes, fuzz::kName, &depth)) {
        fuzz::check(info.ok() && depth.width == info->width && depth.height == info->height &&
                    depth.channels == 1);
        fuzz::check(depth.pixels.size() == std::size_t(depth.width) * depth.height);
        // What we write we read back.
        std::string again;
        Image<std::uint16_t> same;
        fuzz::check(encode_png(depth.view(), &again).ok() && decode_depth(again, fuzz::kName, &same).ok());
        fuzz::check(same.pixels == depth.pixels);
    } else {
        fuzz::check_error(status);
        fuzz::check(depth.empty() && depth.width == 0);
    }
    Image<std::uint8_t> rgb;
    if (const Status status = decode_rgb(bytes, fuzz::kName, &rgb)) {
        fuzz::check(info.ok() && rgb.width == info->width && rgb.height == info->height && rgb.channels == 3);
        fuzz::check(rgb.width <= kMaxImageSide && rgb.height <= kMaxImageSide);
        fuzz::check(rgb.pixels.size() == std::size_t(rgb.width) * rgb.height * 3);
    } else {
        fuzz::check_error(status);
        fuzz::check(rgb.empty() && rgb.width == 0);
    }
    return 0;
}
