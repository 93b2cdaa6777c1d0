// SPDX-License-Identifier: MIT
#include "capture/registered_frames.h"

#include <cstring>
#include <new>

#include "capture/live_source.h"
#include "capture/raw_image.h"

namespace burin {
namespace {

// Where red, green and blue lie in a pixel, and how many bytes it has; 0: not pixel by pixel.
struct Layout {
    int bytes, r, g, b;
};
Layout layout_of(PixelFormat format) {
    switch (format) {
        case PixelFormat::rgb8:
            return {3, 0, 1, 2};
        case PixelFormat::bgr8:
            return {3, 2, 1, 0};
        case PixelFormat::rgba8:
            return {4, 0, 1, 2};
        case PixelFormat::bgra8:
            return {4, 2, 1, 0};
        case PixelFormat::grey8:
            return {1, 0, 0, 0};
        default:
            return {0, 0, 0, 0};
    }
}

bool equal(const Camera& a, const Camera& b) {
    return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx &&
           a.cy == b.cy && a.k1 == b.k1 && a.k2 == b.k2 && a.p1 == b.p1 && a.p2 == b.p2 && a.k3 == b.k3;
}

// Everything seen from the colour camera in place of the depth camera.
void move_to_colour(DeviceInfo* info, const Se3& T_colour_depth) {
    const Se3 T_depth_colour = T_colour_depth.inverse();
    for (StreamInfo& s : info->streams) s.T_stream_depth = s.T_stream_depth * T_depth_colour;
    info->T_camera_imu = T_colour_depth * info->T_camera_imu;
    StreamInfo& depth = info->at(StreamKind::depth);
    const StreamInfo& colour = info->at(StreamKind::colour);
    depth.width = colour.width;
    depth.height = colour.height;
    depth.camera = colour.camera;
    depth.T_stream_depth = Se3();
    info->at(StreamKind::colour).T_stream_depth = Se3();
    set_image_bytes(&depth);
}

void move_to_depth(DeviceInfo* info) {
    const StreamInfo& depth = info->at(StreamKind::depth);
    StreamInfo& colour = info->at(StreamKind::colour);
    colour.width = depth.width;
    colour.height = depth.height;
    colour.camera = depth.camera;
    colour.colour_format = PixelFormat::rgb8;
    colour.T_stream_depth = Se3();
    set_image_bytes(&colour);
}

}  // namespace

Status RegisteredFrames::configure(RegistrationMode mode, DeviceInfo* info) {
    mode_ = RegistrationMode::none;
    if (mode == RegistrationMode::none) return {};
    if (!info->has(StreamKind::depth) || !info->has(StreamKind::colour))
        return Status::error(Code::unsupported,
                             "registration needs depth and colour, the device delivers no %s",
                             info->has(StreamKind::depth) ? "colour" : "depth");
    depth_ = info->at(StreamKind::depth);
    colour_ = info->at(StreamKind::colour);
    const bool yuyv = colour_.colour_format == PixelFormat::yuyv;
    if (mode == RegistrationMode::colour_to_depth && !yuyv && layout_of(colour_.colour_format).bytes == 0)
        return Status::error(Code::unsupported,
                             "registration of colour to depth: expected RGB, BGR, grey or YUYV colour");
    T_colour_depth_ = colour_.T_stream_depth;
    BURIN_TRY(use(depth_.camera, colour_.camera));
    const std::size_t colour_pixels =
                          static_cast<std::size_t>(colour_.width) * static_cast<std::size_t>(colour_.height),
                      depth_pixels =
                          static_cast<std::size_t>(depth_.width) * static_cast<std::size_t>(depth_.height);
    depth_out_.reset(new (std::nothrow) std::uint16_t[colour_pixels]);
    bool room = depth_out_ != nullptr;
    if (mode == RegistrationMode::colour_to_depth) {
        rgb_.reset(new (std::nothrow) std::uint8_t[3 * colour_pixels]);
        colour_out_.reset(new (std::nothrow) std::uint8_t[3 * depth_pixels]);
        mask_.reset(new (std::nothrow) std::uint8_t[depth_pixels]);
        room = room && rgb_ && colour_out_ && mask_;
    }
    if (!room) return Status::error(Code::insufficient_memory, "no memory for registered images");
    mode_ = mode;
    if (mode == RegistrationMode::depth_to_colour)
        move_to_colour(info, T_colour_depth_);
    else
        move_to_depth(info);
    return {};
}

Status RegisteredFrames::use(const Camera& depth, const Camera& colour) {
    if (registration_.configured() && equal(depth, used_depth_) && equal(colour, used_colour_)) return {};
    used_depth_ = depth;
    used_colour_ = colour;
    return registration_.configure(depth, depth_.unit_m, colour, T_colour_depth_);
}

View<const std::uint8_t> RegisteredFrames::rgb_of(const CapturedImage& image) {
    const auto width = static_cast<std::ptrdiff_t>(colour_.width);
    if (colour_.colour_format == PixelFormat::rgb8)
        return {image.pixels, colour_.width, colour_.height, static_cast<std::ptrdiff_t>(image.stride_bytes),
                3};
    const View<std::uint8_t> rgb = {rgb_.get(), colour_.width, colour_.height, width * 3, 3};
    if (colour_.colour_format == PixelFormat::yuyv) {
        const std::size_t rows = static_cast<std::size_t>(colour_.height - 1);
        (void)unpack_yuv422(simd::Yuv422::yuyv,
                            {image.pixels, image.stride_bytes * rows + colour_.row_bytes, image.stride_bytes},
                            rgb);
        return rgb;
    }
    const Layout l = layout_of(colour_.colour_format);
    for (int y = 0; y < colour_.height; ++y) {
        const std::uint8_t* in = image.pixels + static_cast<std::size_t>(y) * image.stride_bytes;
        std::uint8_t* out = rgb.row(y);
        for (int x = 0; x < colour_.width; ++x, in += l.bytes, out += 3)
            out[0] = in[l.r], out[1] = in[l.g], out[2] = in[l.b];
    }
    return rgb;
}

Status RegisteredFrames::apply(CapturedFrame* frame) {
    CapturedImage& depth = frame->images[static_cast<int>(StreamKind::depth)];
    CapturedImage& colour = frame->images[static_cast<int>(StreamKind::colour)];
    if (!active() || !depth.pixels) return {};
    if (mode_ == RegistrationMode::colour_to_depth && !colour.pixels) return {};
    BURIN_TRY(use(depth.camera, colour.pixels ? colour.camera : colour_.camera));
    const View<const std::uint16_t> in = {reinterpret_cast<const std::uint16_t*>(depth.pixels), depth_.width,
                                          depth_.height, static_cast<std::ptrdiff_t>(depth.stride_bytes / 2)};
    const View<std::uint16_t> out = {depth_out_.get(), colour_.width, colour_.height, colour_.width};
    BURIN_TRY(registration_.depth_to_colour(in, out));
    if (mode_ == RegistrationMode::depth_to_colour) {
        depth.pixels = reinterpret_cast<const std::uint8_t*>(depth_out_.get());
        depth.stride_bytes = static_cast<std::size_t>(colour_.width) * 2;
        depth.camera = used_colour_;
        depth.dmabuf_fd = -1;
        return {};
    }
    const View<std::uint8_t> registered = {colour_out_.get(), depth_.width, depth_.height,
                                           static_cast<std::ptrdiff_t>(depth_.width) * 3, 3};
    BURIN_TRY(registration_.colour_to_depth(rgb_of(colour), in, out, registered,
                                            {mask_.get(), depth_.width, depth_.height, depth_.width}));
    colour.pixels = colour_out_.get();
    colour.stride_bytes = static_cast<std::size_t>(depth_.width) * 3;
    colour.camera = used_depth_;
    colour.dmabuf_fd = -1;
    return {};
}

}  // namespace burin
