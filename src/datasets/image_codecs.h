// SPDX-License-Identifier: MIT
// Inside of image_file: one decoder a library. Each fills rows of a buffer that image_file.cpp has allocated
// after checking the header, and reports through text, since the libraries jump out of C code and no C++
// object may be in their way.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "datasets/image_file.h"

namespace burin::codec {

inline constexpr std::size_t kReasonBytes = 160;

enum class Want { info, depth16, rgb8 };

// Called once the header is read; gives the memory for width x height pixels of the wanted kind, or null with
// the reason written.
struct Target {
    Want want = Want::info;
    void* (*allocate)(void* context, const ImageInfo& info, char* reason) = nullptr;
    void* context = nullptr;
};

// False with the reason when the bytes are no whole image of that kind.
bool decode_png(std::string_view bytes, const Target& target, ImageInfo* info, char* reason);
bool decode_jpeg(std::string_view bytes, const Target& target, ImageInfo* info, char* reason);
bool decode_pnm(std::string_view bytes, const Target& target, ImageInfo* info, char* reason);

}  // namespace burin::codec
