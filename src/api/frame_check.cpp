// SPDX-License-Identifier: MIT
#include "api/frame_check.h"

#include <cmath>

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
    if (f.rgb) {
        BURIN_TRY(checked_camera(f.colour_camera, "colour", &v.colour_camera));
        BURIN_TRY(check_stride("frame: rgb_stride_bytes", f.rgb_stride_bytes,
                               std::uint64_t{3} * f.colour_camera.width, f.colour_camera.height, 1));
        BURIN_TRY(checked_pose(f.T_colour_depth, "T_colour_depth", &v.T_colour_depth));
        v.colour = {f.rgb, v.colour_camera.width, v.colour_camera.height,
                    static_cast<std::ptrdiff_t>(f.rgb_stride_bytes), 3};
    }
    *out = v;
    return {};
}

}  // namespace burin
