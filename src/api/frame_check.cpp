// SPDX-License-Identifier: MIT
#include "api/frame_check.h"

#include <cmath>
#include <cstddef>

#include "map/chunk.h"

namespace burin {
namespace {

// Beyond this from the origin a chunk's coordinates would leave the key: see kChunkLimit.
Status check_reach(const Se3& T, const burin_config& config) {
    const double limit_m =
        (static_cast<double>(kChunkLimit) - 4) * kChunkSide * config.voxel_m - 2 * config.max_depth_m;
    if (std::fabs(T.t.x) < limit_m && std::fabs(T.t.y) < limit_m && std::fabs(T.t.z) < limit_m) return {};
    return Status::error(Code::invalid_argument,
                         "T_world_camera: translation is %g %g %g m, expected below %g m at this voxel size",
                         T.t.x, T.t.y, T.t.z, limit_m);
}

Status check_stride(const char* what, std::uint64_t stride, std::uint64_t row_bytes, std::uint64_t rows,
                    std::uint64_t unit) {
    // Kernels reach pixels by 32-bit offsets; and a stride that large is a negative number in disguise.
    const std::uint64_t most = ((std::uint64_t{1} << 31) - 1) / rows;
    if (stride >= row_bytes && stride % unit == 0 && stride <= most) return {};
    return Status::error(Code::invalid_argument,
                         "%s is %llu bytes, expected %llu to %llu and a multiple of %llu", what,
                         static_cast<unsigned long long>(stride), static_cast<unsigned long long>(row_bytes),
                         static_cast<unsigned long long>(most), static_cast<unsigned long long>(unit));
}

Status check_confidence(const burin_frame& f, FrameView* v) {
    if (f.min_confidence > 255)
        return Status::error(Code::invalid_argument, "frame: min_confidence is %u, expected 0 to 255",
                             f.min_confidence);
    BURIN_TRY(check_stride("frame: confidence_stride_bytes", f.confidence_stride_bytes, f.depth_camera.width,
                           f.depth_camera.height, 1));
    v->confidence = {f.confidence, v->depth_camera.width, v->depth_camera.height,
                     static_cast<std::ptrdiff_t>(f.confidence_stride_bytes)};
    v->min_confidence = static_cast<std::uint8_t>(f.min_confidence);
    return {};
}

Status check_colour(const burin_frame& f, FrameView* v) {
    constexpr std::uint8_t kPixelBytes[] = {3, 3, 4, 4, 1, 2, 1, 1};  // by burin_pixel_format
    if (f.colour_format > BURIN_PIXEL_NV21)
        return Status::error(Code::invalid_argument, "frame: colour_format is %u, expected 0 to %d",
                             f.colour_format, BURIN_PIXEL_NV21);
    BURIN_TRY(checked_camera(f.colour_camera, "colour", &v->colour_camera));
    const std::uint64_t width = f.colour_camera.width, height = f.colour_camera.height;
    const std::uint64_t even_width = f.colour_format == BURIN_PIXEL_YUYV ? (width + 1) & ~1u : width;
    BURIN_TRY(check_stride("frame: colour_stride_bytes", f.colour_stride_bytes,
                           kPixelBytes[f.colour_format] * even_width, height, 1));
    if (f.colour_format >= BURIN_PIXEL_NV12) {
        if (!f.chroma) return Status::error(Code::invalid_argument, "frame: chroma is null");
        BURIN_TRY(check_stride("frame: chroma_stride_bytes", f.chroma_stride_bytes, (width + 1) / 2 * 2,
                               (height + 1) / 2, 1));
        v->chroma = {f.chroma, (v->colour_camera.width + 1) / 2, (v->colour_camera.height + 1) / 2,
                     static_cast<std::ptrdiff_t>(f.chroma_stride_bytes), 2};
    }
    BURIN_TRY(checked_pose(f.T_colour_depth, "T_colour_depth", &v->T_colour_depth));
    v->colour_format = static_cast<PixelFormat>(f.colour_format);
    v->colour = {f.colour, v->colour_camera.width, v->colour_camera.height,
                 static_cast<std::ptrdiff_t>(f.colour_stride_bytes), kPixelBytes[f.colour_format]};
    return {};
}

static_assert(sizeof(burin_imu_sample) == sizeof(ImuSample) && offsetof(ImuSample, gyro_rad_s) == 8 &&
              offsetof(ImuSample, accel_m_s2) == 32);

Status check_imu(const burin_frame& f, FrameView* v) {
    if (f.imu_count > 65536)
        return Status::error(Code::invalid_argument, "frame: imu_count is %u, expected at most 65536",
                             f.imu_count);
    BURIN_TRY(checked_pose(f.T_camera_imu, "T_camera_imu", &v->T_camera_imu));
    v->imu = reinterpret_cast<const ImuSample*>(f.imu);  // the same layout, see above
    v->imu_count = static_cast<int>(f.imu_count);
    return {};
}

}  // namespace

Status checked_camera(const burin_camera& c, const char* what, Camera* out) {
    const std::uint32_t side = kMaxImageSide + 1;  // keeps the conversion to int in range
    *out = {static_cast<int>(c.width < side ? c.width : side),
            static_cast<int>(c.height < side ? c.height : side),
            c.fx,
            c.fy,
            c.cx,
            c.cy,
            c.k1,
            c.k2,
            c.p1,
            c.p2,
            c.k3};
    return check_camera(*out, what);
}

Status checked_pose(const burin_pose& pose, const char* what, Se3* out) {
    const Result<Se3> T =
        se3_from_quaternion({pose.tx, pose.ty, pose.tz}, {pose.qx, pose.qy, pose.qz, pose.qw});
    if (!T.ok()) return Status::error(T.status().code(), "%s: %s", what, T.status().text());
    *out = *T;
    return {};
}

Status checked_world_pose(const burin_pose& pose, const burin_config& config, Se3* out) {
    BURIN_TRY(checked_pose(pose, "T_world_camera", out));
    return check_reach(*out, config);
}

Status checked_frame(const burin_frame& f, const burin_config& config, FrameView* out) {
    if (f.struct_size != sizeof(burin_frame))
        return Status::error(Code::invalid_argument,
                             "frame: size %u, expected %zu (start from burin_frame_default())", f.struct_size,
                             sizeof(burin_frame));
    for (const std::uint32_t reserved : f.reserved)
        if (reserved != 0)
            return Status::error(Code::invalid_argument, "frame: a reserved field is %u, expected 0",
                                 reserved);
    if (!f.depth) return Status::error(Code::invalid_argument, "frame: depth is null");
    if (f.depth_type > BURIN_DEPTH_F32)
        return Status::error(Code::invalid_argument, "frame: depth_type is %u, expected 0 or 1",
                             f.depth_type);
    if (!(f.depth_unit_m > 1e-6 && f.depth_unit_m < 1e3))
        return Status::error(Code::invalid_argument, "frame: depth_unit_m is %g, expected 1e-6 to 1000",
                             f.depth_unit_m);
    FrameView v;
    v.t_ns = f.t_ns;
    v.depth_unit_m = f.depth_unit_m;
    BURIN_TRY(checked_camera(f.depth_camera, "depth", &v.depth_camera));
    if (f.depth_camera.width > config.max_width || f.depth_camera.height > config.max_height)
        return Status::error(Code::invalid_argument,
                             "frame: depth is %ux%u, expected at most %ux%u (config.max_width, max_height)",
                             f.depth_camera.width, f.depth_camera.height, config.max_width,
                             config.max_height);
    const std::uint64_t sample = f.depth_type == BURIN_DEPTH_U16 ? 2 : 4;
    BURIN_TRY(check_stride("frame: depth_stride_bytes", f.depth_stride_bytes, sample * f.depth_camera.width,
                           f.depth_camera.height, sample));
    if (reinterpret_cast<std::uintptr_t>(f.depth) % sample != 0)
        return Status::error(Code::invalid_argument, "frame: depth is not aligned to its %d-byte samples",
                             static_cast<int>(sample));
    const auto stride = static_cast<std::ptrdiff_t>(f.depth_stride_bytes / sample);
    if (f.depth_type == BURIN_DEPTH_U16)
        v.depth_u16 = {static_cast<const std::uint16_t*>(f.depth), v.depth_camera.width,
                       v.depth_camera.height, stride};
    else
        v.depth_f32 = {static_cast<const float*>(f.depth), v.depth_camera.width, v.depth_camera.height,
                       stride};
    BURIN_TRY(checked_world_pose(f.T_world_camera, config, &v.T_world_camera));
    if (f.confidence) BURIN_TRY(check_confidence(f, &v));
    if (f.colour) BURIN_TRY(check_colour(f, &v));
    if (f.imu) BURIN_TRY(check_imu(f, &v));
    *out = v;
    return {};
}

}  // namespace burin
