// SPDX-License-Identifier: MIT
// The header of a PLY file: which elements follow, with which properties, in which encoding.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/status.h"

namespace burin {

enum class PlyEncoding { ascii, little_endian, big_endian };
enum class PlyType : std::uint8_t { i8, u8, i16, u16, i32, u32, f32, f64 };

inline constexpr std::size_t ply_bytes(PlyType type) {
    constexpr std::uint8_t kBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    return kBytes[static_cast<int>(type)];
}
inline constexpr bool ply_is_float(PlyType type) { return type == PlyType::f32 || type == PlyType::f64; }

struct PlyProperty {
    std::string name;
    PlyType type = PlyType::f32;
    bool is_list = false;
    PlyType count_type = PlyType::u8;  // lists only
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties;
};

struct PlyHeader {
    PlyEncoding encoding = PlyEncoding::ascii;
    std::vector<PlyElement> elements;
    std::size_t body = 0;  // offset of the first byte after "end_header" and its line end
};

// `name` stands for the file in messages. Lines may end in LF or CR LF.
Result<PlyHeader> parse_ply_header(std::string_view bytes, const char* name);

}  // namespace burin
