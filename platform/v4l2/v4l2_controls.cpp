// SPDX-License-Identifier: MIT
#include <linux/videodev2.h>

#include <cerrno>

#include "platform/v4l2/d4xx.h"
#include "platform/v4l2/v4l2_device.h"

namespace burin {
namespace {

struct Control {
    SourceControl ours;
    StreamKind stream;
    std::uint32_t id;
    double scale;  // ours = theirs * scale
};

// V4L2's absolute exposure is in steps of 100 us; its automatic exposure is a menu, seen to below.
constexpr Control kControls[] = {
    {SourceControl::depth_exposure_us, StreamKind::depth, V4L2_CID_EXPOSURE_ABSOLUTE, 100},
    {SourceControl::depth_gain, StreamKind::depth, V4L2_CID_GAIN, 1},
    {SourceControl::depth_auto_exposure, StreamKind::depth, V4L2_CID_EXPOSURE_AUTO, 1},
    {SourceControl::colour_exposure_us, StreamKind::colour, V4L2_CID_EXPOSURE_ABSOLUTE, 100},
    {SourceControl::colour_gain, StreamKind::colour, V4L2_CID_GAIN, 1},
    {SourceControl::colour_auto_exposure, StreamKind::colour, V4L2_CID_EXPOSURE_AUTO, 1},
    {SourceControl::mirror, StreamKind::depth, V4L2_CID_HFLIP, 1},
};

// The node of the control's stream, or of the only one there is.
V4l2Stream* stream_of(V4l2Device* d, const Control& c) {
    for (int i = 0; i < d->count; ++i)
        if (d->streams[i].kind == c.stream) return &d->streams[i];
    return nullptr;
}

const Control* control_of(SourceControl ours) {
    for (const Control& c : kControls)
        if (c.ours == ours) return &c;
    return nullptr;
}

Status none() { return Status::error(Code::unsupported, "v4l2: the camera has no such control"); }

Status find(V4l2Device* d, SourceControl ours, const Control** control, V4l2Stream** stream,
            v4l2_queryctrl* query) {
    *control = control_of(ours);
    if (!*control || !(*stream = stream_of(d, **control))) return none();
    *query = {};
    query->id = (*control)->id;
    if (v4l2_call((*stream)->node.fd(), VIDIOC_QUERYCTRL, query) < 0 ||
        (query->flags & V4L2_CTRL_FLAG_DISABLED))
        return errno == ENODEV ? v4l2_error((*stream)->node.path(), "controls", ENODEV) : none();
    return {};
}

bool is_auto(const Control& c) { return c.id == V4L2_CID_EXPOSURE_AUTO; }

}  // namespace

Status get_v4l2_control(V4l2Device* d, SourceControl ours, ControlRange* range) {
    if (d->unit && get_d4xx_control(d->streams[0].node.fd(), ours, range).ok()) return {};
    const Control* c = nullptr;
    V4l2Stream* s = nullptr;
    v4l2_queryctrl q;
    BURIN_TRY(find(d, ours, &c, &s, &q));
    v4l2_control value = {q.id, 0};
    if (v4l2_call(s->node.fd(), VIDIOC_G_CTRL, &value) < 0)
        return v4l2_error(s->node.path(), "a control cannot be read", errno);
    if (is_auto(*c)) {
        *range = {value.value == V4L2_EXPOSURE_MANUAL ? 0.0 : 1.0, 0, 1, 1,
                  q.default_value == V4L2_EXPOSURE_MANUAL ? 0.0 : 1.0};
        return {};
    }
    *range = {value.value * c->scale, q.minimum * c->scale, q.maximum * c->scale, q.step * c->scale,
              q.default_value * c->scale};
    return {};
}

Status set_v4l2_control(V4l2Device* d, SourceControl ours, double value) {
    if (d->unit) {
        const Status set = set_d4xx_control(d->streams[0].node.fd(), ours, value);
        if (set.code() != Code::unsupported) return set;
    }
    const Control* c = nullptr;
    V4l2Stream* s = nullptr;
    v4l2_queryctrl q;
    BURIN_TRY(find(d, ours, &c, &s, &q));
    const double least = is_auto(*c) ? 0 : q.minimum * c->scale,
                 most = is_auto(*c) ? 1 : q.maximum * c->scale;
    if (!(value >= least && value <= most))
        return Status::error(Code::invalid_argument, "v4l2: %g, expected %g..%g", value, least, most);
    if (!is_auto(*c)) {
        v4l2_control v = {q.id, static_cast<std::int32_t>(value / c->scale)};
        return v4l2_call(s->node.fd(), VIDIOC_S_CTRL, &v) < 0
                   ? v4l2_error(s->node.path(), "a control is refused", errno)
                   : Status();
    }
    // "Automatic" goes by one of two names.
    for (const int mode : {value == 0 ? V4L2_EXPOSURE_MANUAL : V4L2_EXPOSURE_APERTURE_PRIORITY,
                           value == 0 ? V4L2_EXPOSURE_SHUTTER_PRIORITY : V4L2_EXPOSURE_AUTO}) {
        v4l2_control v = {q.id, mode};
        if (v4l2_call(s->node.fd(), VIDIOC_S_CTRL, &v) == 0) return {};
    }
    return v4l2_error(s->node.path(), "a control is refused", errno);
}

}  // namespace burin
