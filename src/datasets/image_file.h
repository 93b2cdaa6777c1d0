// SPDX-License-Identifier: MIT
// Images from PNG (libpng), JPEG (libjpeg-turbo) and binary PGM/PPM; images to PNG. The kind is told by the
// first bytes, not by the name. A truncated or corrupt file is an error that names it: there are no half
// images. The output image keeps its buffer when the size fits, so a loop over frames does not allocate
// pixels.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/image.h"
#include "core/status.h"

namespace burin {

// What the header promises; the pixels may still be damaged.
struct ImageInfo {
    int width = 0, height = 0;  // pixels, 1..kMaxImageSide
    int channels = 0;           // 1 grey, 2 grey + alpha, 3 RGB, 4 RGBA; a palette counts as 3
    int bits = 0;               // of a channel: 1, 2, 4, 8 or 16
};
Result<ImageInfo> decode_image_info(std::string_view bytes, const std::string& name);
Result<ImageInfo> read_image_info(const std::string& path);

// 16-bit single-channel images, values as they are in the file. Error (format) for anything else: depth that
// was saved with 8 bits or as colour has lost its unit. On any error *out is empty. `name` stands for the
// file in messages.
Status decode_depth(std::string_view bytes, const std::string& name, Image<std::uint16_t>* out);
Status read_depth(const std::string& path, Image<std::uint16_t>* out);

// Everything as 8-bit RGB: grey is repeated, alpha dropped, a palette looked up, of 16 bits the upper 8 stay.
Status decode_rgb(std::string_view bytes, const std::string& name, Image<std::uint8_t>* out);
Status read_rgb(const std::string& path, Image<std::uint8_t>* out);

// 8-bit grey (1 channel) or RGB (3 channels); 16-bit grey. Rows may be strided. Atomic, see
// write_file_atomically.
Status write_png(const std::string& path, View<const std::uint8_t> image);
Status write_png(const std::string& path, View<const std::uint16_t> image);
// The same into memory.
Status encode_png(View<const std::uint8_t> image, std::string* bytes);
Status encode_png(View<const std::uint16_t> image, std::string* bytes);

}  // namespace burin
