// SPDX-License-Identifier: MIT
// ScanNet's .sens, version 4 (Dai, Chang, Savva, Halber, Funkhouser, Niessner, CVPR 2017). Facts from
// github.com/ScanNet/ScanNet, SensReader/README.md and SensReader/python/SensorData.py. Little-endian,
// packed:
//   u32 version, u64 length + name of the sensor,
//   float[16] each: intrinsic and extrinsic of colour, intrinsic and extrinsic of depth (4x4, row by row),
//   i32 colour coding (0 raw, 1 PNG, 2 JPEG), i32 depth coding (0 raw, 1 zlib, 2 OCCI, all u16),
//   u32 colour width and height, depth width and height, float depth units a metre, u64 frames,
//   then each frame: float[16] camera to world (-inf: lost), u64 stamps of colour and depth in microseconds,
//   u64 bytes of colour and of depth, colour, depth; then IMU frames, which are not read.
#include "datasets/sens.h"

#include <cmath>
#include <cstring>
#include <utility>

#include "datasets/file.h"
#include "datasets/formats.h"

namespace burin {
namespace {

constexpr std::uint64_t kMostName = 4096;  // bytes; released scans say "StructureSensor"
constexpr std::size_t kFixedBytes = 4 * 64 + 2 * 4 + 4 * 4 + 4 + 8;
constexpr std::size_t kFrameBytes = 64 + 4 * 8;
constexpr std::uint64_t kMostMicroseconds = 9'200'000'000'000'000;  // what fits int64 nanoseconds

template <class T>
T take(const char** at) {
    T value;
    std::memcpy(&value, *at, sizeof value);
    *at += sizeof value;
    return value;
}

struct Matrix {
    double m[16];
};
Matrix take_matrix(const char** at) {
    Matrix out;
    for (double& value : out.m) value = static_cast<double>(take<float>(at));
    return out;
}

bool is_identity(const Matrix& a) {
    for (int i = 0; i < 16; ++i)
        if (!(std::fabs(a.m[i] - (i % 5 == 0 ? 1 : 0)) < 1e-6)) return false;
    return true;
}

Status take_camera(const Matrix& K, std::uint32_t width, std::uint32_t height, const char* what,
                   const char* path, Camera* camera) {
    if (width < 1 || width > kMaxImageSide || height < 1 || height > kMaxImageSide)
        return Status::error(Code::format, "%s: %s images of %ux%u, expected 1 to %d pixels a side", path,
                             what, width, height, kMaxImageSide);
    *camera = {static_cast<int>(width), static_cast<int>(height), K.m[0], K.m[5], K.m[2], K.m[6]};
    if (const Status status = check_camera(*camera, what); !status)
        return Status::error(Code::format, "%s: %s", path, status.text());
    return {};
}

Status read_header(PackedList* list, std::uint64_t* at, std::uint64_t* count) {
    const char* path = list->file.path().c_str();
    char begin[12], fixed[kFixedBytes];
    BURIN_TRY(list->file.read(0, sizeof begin, begin));
    const char* p = begin;
    const auto version = take<std::uint32_t>(&p);
    const auto name_bytes = take<std::uint64_t>(&p);
    if (version != 4 || name_bytes > kMostName)
        return Status::error(Code::format,
                             "%s: version %u with a name of %llu bytes, expected a .sens file of version 4",
                             path, version, static_cast<unsigned long long>(name_bytes));
    BURIN_TRY(list->file.read(12 + name_bytes, sizeof fixed, fixed));
    *at = 12 + name_bytes + sizeof fixed;
    p = fixed;
    const Matrix colour = take_matrix(&p), colour_moved = take_matrix(&p);
    const Matrix depth = take_matrix(&p), depth_moved = take_matrix(&p);
    const auto colour_coding = take<std::int32_t>(&p), depth_coding = take<std::int32_t>(&p);
    if (colour_coding < 0 || colour_coding > 2)
        return Status::error(Code::format, "%s: colour coding %d, expected 0 raw, 1 PNG or 2 JPEG", path,
                             colour_coding);
    if (depth_coding == 2)
        return Status::error(Code::unsupported, "%s: depth coding 2 (OCCI), expected 0 raw or 1 zlib", path);
    if (depth_coding < 0 || depth_coding > 1)
        return Status::error(Code::format, "%s: depth coding %d, expected 0 raw or 1 zlib", path,
                             depth_coding);
    list->raw_colour = colour_coding == 0;
    list->raw_depth = depth_coding == 0;
    std::uint32_t side[4];
    for (std::uint32_t& value : side) value = take<std::uint32_t>(&p);
    list->cameras.depth_scale = static_cast<double>(take<float>(&p));
    if (!(list->cameras.depth_scale > 0 && list->cameras.depth_scale <= 1e6))
        return Status::error(Code::format, "%s: %g depth units a metre, expected up to a million", path,
                             list->cameras.depth_scale);
    *count = take<std::uint64_t>(&p);
    BURIN_TRY(take_camera(depth, side[2], side[3], "depth", path, &list->cameras.depth));
    // Scans without colour have none of its numbers.
    if (side[0] == 0 && side[1] == 0)
        list->cameras.colour = list->cameras.depth;
    else
        BURIN_TRY(take_camera(colour, side[0], side[1], "colour", path, &list->cameras.colour));
    if (!is_identity(colour_moved) || !is_identity(depth_moved))
        list->notes +=
            "an extrinsic in the file is not the identity and is not applied: which way it maps is not "
            "documented\n";
    return {};
}

Status read_frame(PackedList* list, std::uint64_t index, std::uint64_t* at) {
    const RandomFile& file = list->file;
    char bytes[kFrameBytes];
    BURIN_TRY(file.read(*at, sizeof bytes, bytes));
    const char* p = bytes;
    const Matrix T = take_matrix(&p);
    const auto colour_us = take<std::uint64_t>(&p), depth_us = take<std::uint64_t>(&p);
    const auto colour_bytes = take<std::uint64_t>(&p), depth_bytes = take<std::uint64_t>(&p);
    *at += sizeof bytes;
    if (depth_bytes == 0 || depth_bytes > kMaxPackedImage || colour_bytes > kMaxPackedImage ||
        colour_bytes + depth_bytes > file.size() - *at)
        return Status::error(
            Code::format,
            "%s: frame %llu has %llu bytes of colour and %llu of depth, expected them in the %llu that "
            "follow",
            file.path().c_str(), static_cast<unsigned long long>(index),
            static_cast<unsigned long long>(colour_bytes), static_cast<unsigned long long>(depth_bytes),
            static_cast<unsigned long long>(file.size() - *at));
    if (colour_us > kMostMicroseconds || depth_us > kMostMicroseconds)
        return Status::error(Code::format,
                             "%s: frame %llu has a stamp above 9.2e15 us, expected microseconds",
                             file.path().c_str(), static_cast<unsigned long long>(index));
    PackedFrame frame;
    frame.colour = {*at, static_cast<std::uint32_t>(colour_bytes)};
    frame.depth = {*at + colour_bytes, static_cast<std::uint32_t>(depth_bytes)};
    frame.t_ns = static_cast<std::int64_t>(depth_us) * 1000;
    frame.colour_t_ns = static_cast<std::int64_t>(colour_us) * 1000;
    *at += colour_bytes + depth_bytes;
    if (!std::isinf(T.m[0])) {
        Result<Se3> pose = se3_from_matrix(T.m, 4);
        if (!pose)
            return Status::error(Code::format, "%s: frame %llu: %s", file.path().c_str(),
                                 static_cast<unsigned long long>(index), pose.status().text());
        frame.has_pose = true;
        frame.T_world_camera = *pose;
    }
    list->frames.push_back(frame);
    return {};
}

}  // namespace

Status read_sens(PackedList* list) {
    std::uint64_t at = 0, count = 0;
    BURIN_TRY(read_header(list, &at, &count));
    if (count > (list->file.size() - at) / kFrameBytes)
        return Status::error(
            Code::format, "%s: %llu frames cannot lie in the %llu bytes that follow, expected a whole file",
            list->file.path().c_str(), static_cast<unsigned long long>(count),
            static_cast<unsigned long long>(list->file.size() - at));
    for (std::uint64_t i = 0; i < count; ++i) BURIN_TRY(read_frame(list, i, &at));
    mend_stamps(list);
    note_missing_poses(list, "marked as lost");
    return {};
}

bool looks_like_sens(const std::string& path) { return has_ending(path, ".sens") && is_file(path); }

Result<std::unique_ptr<Dataset>> open_sens(const std::string& path) {
    PackedList list;
    list.format = "sens";
    BURIN_TRY(list.file.open(path));
    BURIN_TRY(read_sens(&list));
    return make_packed_dataset(std::move(list));
}

}  // namespace burin
