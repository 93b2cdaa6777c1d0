// SPDX-License-Identifier: MIT
#include "capture/calibration.h"

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace burin {
namespace {

struct Key {
    const char* name;
    double Camera::*field;
};
constexpr Key kKeys[] = {{"fx", &Camera::fx}, {"fy", &Camera::fy}, {"cx", &Camera::cx},
                         {"cy", &Camera::cy}, {"k1", &Camera::k1}, {"k2", &Camera::k2},
                         {"p1", &Camera::p1}, {"p2", &Camera::p2}, {"k3", &Camera::k3}};

struct Calibration {
    Camera depth, colour;
    bool has_colour = false, has_extrinsic = false, has_imu = false;
    double depth_scale = 0;
    Se3 T_colour_depth, T_camera_imu;
};

// Up to `most` numbers behind the key; how many there are, -1 when something else is.
int numbers_of(const char* text, double* out, int most) {
    int count = 0;
    for (;;) {
        text += std::strspn(text, " \t\r");
        if (*text == 0) return count;
        char* end = nullptr;
        const double value = std::strtod(text, &end);
        if (end == text || count == most || !std::isfinite(value)) return -1;
        out[count++] = value;
        text = end;
    }
}

Status pose_of(const double* v, int count, const char* name, int line, Se3* T) {
    if (count == 7)
        if (const Result<Se3> pose = se3_from_quaternion({v[0], v[1], v[2]}, {v[3], v[4], v[5], v[6]});
            pose.ok()) {
            *T = *pose;
            return {};
        }
    return Status::error(Code::format, "%s:%d: expected tx ty tz qx qy qz qw with a unit quaternion", name,
                         line);
}

Status take_line(char* text, const char* name, int line, Calibration* c) {
    text += std::strspn(text, " \t\r");
    text[std::strcspn(text, "#")] = 0;
    const std::size_t length = std::strcspn(text, " \t\r");
    if (length == 0) return {};
    char* rest = text + length + (text[length] != 0);
    text[length] = 0;
    double v[8];
    const int count = numbers_of(rest, v, 8);
    if (std::strcmp(text, "T_colour_depth") == 0)
        return c->has_extrinsic = true, pose_of(v, count, name, line, &c->T_colour_depth);
    if (std::strcmp(text, "T_camera_imu") == 0)
        return c->has_imu = true, pose_of(v, count, name, line, &c->T_camera_imu);
    if (count != 1) return Status::error(Code::format, "%s:%d: %.40s: expected one number", name, line, text);
    if (std::strcmp(text, "depth_scale") == 0) {
        if (!(v[0] >= 1 && v[0] <= 1e6))
            return Status::error(Code::format, "%s:%d: depth_scale %g, expected 1..1e6", name, line, v[0]);
        c->depth_scale = v[0];
        return {};
    }
    const bool colour = std::strncmp(text, "colour_", 7) == 0;
    const char* key = colour ? text + 7 : text;
    Camera& camera = colour ? c->colour : c->depth;
    c->has_colour = c->has_colour || colour;
    if (std::strcmp(key, "width") == 0 || std::strcmp(key, "height") == 0) {
        if (!(v[0] >= 1 && v[0] <= kMaxImageSide) || v[0] != std::floor(v[0]))
            return Status::error(Code::format, "%s:%d: %s %g, expected 1..%d", name, line, text, v[0],
                                 kMaxImageSide);
        (*key == 'w' ? camera.width : camera.height) = static_cast<int>(v[0]);
        return {};
    }
    for (const Key& k : kKeys)
        if (std::strcmp(key, k.name) == 0) {
            camera.*k.field = v[0];
            return {};
        }
    return Status::error(Code::format, "%s:%d: '%.40s' is no key of a calibration", name, line, text);
}

Status fit(const Camera& from, const char* what, const char* name, StreamInfo* s) {
    Camera c = from;
    if (c.width > 0 && c.height > 0 && (c.width != s->width || c.height != s->height)) {
        if (c.width * s->height != c.height * s->width)
            return Status::error(Code::format, "%s: %s is calibrated at %dx%d, the stream is %dx%d", name,
                                 what, c.width, c.height, s->width, s->height);
        const double scale = static_cast<double>(s->width) / c.width;
        c.fx *= scale, c.fy *= scale;
        c.cx = (c.cx + 0.5) * scale - 0.5, c.cy = (c.cy + 0.5) * scale - 0.5;  // pixel centres are whole
    }
    c.width = s->width;
    c.height = s->height;
    if (const Status checked = check_camera(c, what); !checked.ok())
        return Status::error(Code::format, "%s: %.400s", name, checked.text());
    s->camera = c;
    s->calibrated = true;
    return {};
}

}  // namespace

Status parse_calibration(const char* text, const char* name, DeviceInfo* info) {
    Calibration c;
    char line[256];
    for (int number = 1; *text; ++number) {
        const std::size_t length = std::strcspn(text, "\n");
        if (length >= sizeof line)
            return Status::error(Code::format, "%s:%d: a line of %zu characters", name, number, length);
        std::memcpy(line, text, length);
        line[length] = 0;
        BURIN_TRY(take_line(line, name, number, &c));
        text += length + (text[length] != 0);
    }
    DeviceInfo changed = *info;
    for (int k = 0; k < kStreamKinds; ++k) {
        StreamInfo& s = changed.streams[k];
        if (s.width == 0) continue;
        const bool colour = s.kind == StreamKind::colour && c.has_colour;
        BURIN_TRY(
            fit(colour ? c.colour : c.depth, colour ? "the colour camera" : "the depth camera", name, &s));
        if (s.kind == StreamKind::depth && c.depth_scale > 0) s.unit_m = 1 / c.depth_scale;
        if (s.kind == StreamKind::colour && c.has_extrinsic) s.T_stream_depth = c.T_colour_depth;
    }
    if (c.has_imu) changed.T_camera_imu = c.T_camera_imu;
    *info = changed;
    return {};
}

Status read_calibration(const char* path, DeviceInfo* info) {
    constexpr std::size_t kMost = 65536;  // a calibration is some twenty lines
    std::FILE* file = std::fopen(path, "rbe");
    if (!file) return Status::error(Code::io, "%s: %s", path, std::strerror(errno));
    char text[kMost];
    const std::size_t got = std::fread(text, 1, sizeof text - 1, file);
    const bool refused = std::ferror(file) != 0, more = std::fgetc(file) != EOF;
    std::fclose(file);
    if (refused) return Status::error(Code::io, "%s: cannot be read", path);
    if (more || std::memchr(text, 0, got))
        return Status::error(Code::format, "%s: is no calibration, expected text of some lines", path);
    text[got] = 0;
    return parse_calibration(text, path, info);
}

}  // namespace burin
