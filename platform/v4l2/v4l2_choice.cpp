// SPDX-License-Identifier: MIT
#include "platform/v4l2/v4l2_choice.h"

#include <linux/videodev2.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "platform/v4l2/v4l2_node.h"

namespace burin {
namespace {

// Nobody has more (vivid counts to some 120 formats); a driver that counts on without end must not hold us
// up.
constexpr std::uint32_t kMostFormats = 256, kMostSizes = 64, kMostRates = 32;

bool shows(const V4l2Format& f, StreamKind kind, const char* wanted) {
    if (*wanted && std::strcmp(wanted, f.name) != 0) return false;
    if (f.kind == kind) return true;
    if (kind == StreamKind::depth) return *wanted && may_be_depth(f);
    return false;
}

// Left and right infrared share a format of twice the bandwidth: last, unless both are wanted.
int rank_of(const V4l2Format& f, const SourceOptions& o) {
    const bool both = f.way == V4l2Way::y8i || f.way == V4l2Way::y12i || f.way == V4l2Way::y16i;
    return v4l2_format_rank(f) + (both && !(o.streams & stream_bit(StreamKind::infrared_right)) ? 1000 : 0);
}

struct Size {
    int width = 0, height = 0;
};

// VGA is what every depth sensor has and what tracking was measured with; else the nearest to it.
double distance(const Size& s) {
    return std::fabs(std::log(static_cast<double>(s.width) * s.height / (640.0 * 480.0)));
}

bool choose_size(int fd, std::uint32_t code, Size wanted, Size* chosen) {
    bool any = false;
    for (std::uint32_t i = 0; i < kMostSizes; ++i) {
        v4l2_frmsizeenum e = {};
        e.index = i;
        e.pixel_format = code;
        if (v4l2_call(fd, VIDIOC_ENUM_FRAMESIZES, &e) < 0) break;
        Size s;
        if (e.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
            s = {static_cast<int>(e.discrete.width), static_cast<int>(e.discrete.height)};
        } else {
            // A range: what is asked for, else VGA, if it lies within.
            s = wanted.width > 0 ? wanted : Size{640, 480};
            const auto w = static_cast<std::uint32_t>(s.width), h = static_cast<std::uint32_t>(s.height);
            if (w < e.stepwise.min_width || w > e.stepwise.max_width || h < e.stepwise.min_height ||
                h > e.stepwise.max_height)
                s = {static_cast<int>(e.stepwise.max_width), static_cast<int>(e.stepwise.max_height)};
        }
        if (s.width < 1 || s.height < 1 || s.width > kMaxImageSide || s.height > kMaxImageSide) continue;
        if (wanted.width > 0 && (s.width != wanted.width || s.height != wanted.height)) continue;
        if (!any || distance(s) < distance(*chosen)) *chosen = s;
        any = true;
    }
    return any;
}

double best_rate(int fd, std::uint32_t code, Size size, double wanted) {
    double best = 0;
    for (std::uint32_t i = 0; i < kMostRates; ++i) {
        v4l2_frmivalenum e = {};
        e.index = i;
        e.pixel_format = code;
        e.width = static_cast<std::uint32_t>(size.width);
        e.height = static_cast<std::uint32_t>(size.height);
        if (v4l2_call(fd, VIDIOC_ENUM_FRAMEINTERVALS, &e) < 0) break;
        if (e.type != V4L2_FRMIVAL_TYPE_DISCRETE) return wanted;  // a range: any, or nothing said
        if (e.discrete.numerator == 0) continue;
        const double fps = static_cast<double>(e.discrete.denominator) / e.discrete.numerator;
        if (wanted > 0 ? std::fabs(fps - wanted) < 0.5 : fps > best) best = fps;
    }
    return best;
}

}  // namespace

Status choose_v4l2_format(int fd, const char* node, StreamKind kind, const SourceOptions& o,
                          V4l2Choice* choice) {
    *choice = V4l2Choice();
    const bool colour = kind == StreamKind::colour;
    const char* name = colour ? o.colour_format : kind == StreamKind::depth ? o.depth_format : "";
    const Size wanted = colour ? Size{o.colour_width, o.colour_height} : Size{o.depth_width, o.depth_height};
    bool any_of_kind = false;
    for (std::uint32_t i = 0; i < kMostFormats; ++i) {
        v4l2_fmtdesc e = {};
        e.index = i;
        e.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
        if (v4l2_call(fd, VIDIOC_ENUM_FMT, &e) < 0) break;
        const V4l2Format* f = find_v4l2_format(e.pixelformat);
        if (!f || !shows(*f, kind, name)) continue;
        any_of_kind = true;
        Size size;
        if (!choose_size(fd, f->code, wanted, &size)) {
            // A driver without the question takes sizes as they are set.
            if (wanted.width == 0) continue;
            size = wanted;
        }
        const double fps = best_rate(fd, f->code, size, o.fps);
        const int rank = rank_of(*f, o);
        if (choice->format && rank >= choice->rank) continue;
        choice->format = f;
        choice->rank = rank;
        choice->width = size.width;
        choice->height = size.height;
        choice->fps = fps;
    }
    if (choice->format || !any_of_kind) return {};
    char formats[256];
    describe_v4l2_formats(fd, formats, sizeof formats);
    return Status::error(Code::unsupported, "%s: %s: no %dx%d, there are %s", node, stream_name(kind),
                         wanted.width, wanted.height, formats);
}

Status set_v4l2_format(int fd, const char* node, V4l2Choice* c) {
    v4l2_format f = {};
    f.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    f.fmt.pix.width = static_cast<std::uint32_t>(c->width);
    f.fmt.pix.height = static_cast<std::uint32_t>(c->height);
    f.fmt.pix.pixelformat = c->format->code;
    f.fmt.pix.field = V4L2_FIELD_ANY;
    if (v4l2_call(fd, VIDIOC_S_FMT, &f) < 0) return v4l2_error(node, "the format is refused (S_FMT)", errno);
    const v4l2_pix_format& p = f.fmt.pix;
    if (p.pixelformat != c->format->code || p.width != static_cast<std::uint32_t>(c->width) ||
        p.height != static_cast<std::uint32_t>(c->height))
        return Status::error(Code::unsupported, "%s: the driver makes %.4s %ux%u of %s %dx%d", node,
                             reinterpret_cast<const char*>(&p.pixelformat), p.width, p.height,
                             c->format->name, c->width, c->height);
    const std::uint64_t row = v4l2_row_bytes(*c->format, c->width);
    c->stride = p.bytesperline > row && c->format->way != V4l2Way::inzi ? p.bytesperline : row;
    c->bytes = p.sizeimage;
    const std::uint64_t wanted = v4l2_image_bytes(*c->format, c->width, c->height, c->stride);
    if (c->bytes < wanted)
        return Status::error(Code::format, "%s: images of %u bytes, expected %llu", node, p.sizeimage,
                             static_cast<unsigned long long>(wanted));
    v4l2_streamparm s = {};
    s.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (c->fps > 0) {
        s.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(std::lround(c->fps * 1000))};
        (void)v4l2_call(fd, VIDIOC_S_PARM, &s);  // what came of it is asked for below
    }
    if (v4l2_call(fd, VIDIOC_G_PARM, &s) == 0 && s.parm.capture.timeperframe.numerator > 0)
        c->fps = static_cast<double>(s.parm.capture.timeperframe.denominator) /
                 s.parm.capture.timeperframe.numerator;
    return {};
}

void describe_v4l2_formats(int fd, char* out, std::size_t room) {
    std::size_t used = 0;
    out[0] = 0;
    for (std::uint32_t i = 0; i < kMostFormats && used < room; ++i) {
        v4l2_fmtdesc e = {};
        e.index = i;
        e.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
        if (v4l2_call(fd, VIDIOC_ENUM_FMT, &e) < 0) break;
        const V4l2Format* f = find_v4l2_format(e.pixelformat);
        Size size;
        if (!f || !choose_size(fd, f->code, {}, &size)) continue;
        const double fps = best_rate(fd, f->code, size, 0);
        used +=
            static_cast<std::size_t>(std::snprintf(out + used, room - used, "%s%s %dx%d@%.0f",
                                                   used ? ", " : "", f->name, size.width, size.height, fps));
    }
}

}  // namespace burin
