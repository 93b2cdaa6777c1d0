// SPDX-License-Identifier: MIT
#include "platform/usb/depth_geometry.h"

#include <cmath>

#include "platform/usb/bytes.h"

namespace burin {
namespace {

constexpr int kLengthsAt = 92, kLengthsEnd = 108;  // OpenNI2, XnFixedParams
// Pixels of the sensor that pixel_cm speaks of.
constexpr double kSensorWidth = 1280;

Status length(double value, double least, double most, const char* name, const char* what) {
    if (value >= least && value <= most) return {};
    return Status::error(Code::format, "%s tells a %s of %g cm, expected %g..%g", name, what, value, least,
                         most);
}

}  // namespace

Status parse_fixed_params(const std::uint8_t* data, int bytes, const char* name, DepthGeometry* geometry) {
    if (bytes < kLengthsEnd)
        return Status::error(Code::format, "%s: the fixed parameters have %d bytes, expected at least %d",
                             name, bytes, kLengthsEnd);
    const auto at = [&](int i) { return static_cast<double>(le_float(data + kLengthsAt + 4 * i)); };
    // Kinect: 7.5, 2.3 or 2.5, 120, 0.1042 to 0.1057. A decade either way.
    BURIN_TRY(length(at(0), 0.75, 75, name, "distance to the projector"));
    BURIN_TRY(length(at(1), 0, 50, name, "distance to the colour camera"));
    BURIN_TRY(length(at(2), 12, 1200, name, "reference distance"));
    BURIN_TRY(length(at(3), 0.01, 1, name, "pixel size"));
    // 29 to 136 degrees across: else it was no pair of a distance and a pixel.
    const double focal = at(2) / at(3);
    if (!(focal > 0.2 * kSensorWidth && focal < 2 * kSensorWidth))
        return Status::error(
            Code::format,
            "%s tells a reference distance of %g cm and a pixel of %g cm, expected their ratio "
            "within %g..%g",
            name, at(2), at(3), 0.2 * kSensorWidth, 2 * kSensorWidth);
    geometry->emitter_cm = at(0);
    geometry->colour_cm = at(1);
    geometry->reference_cm = at(2);
    geometry->pixel_cm = at(3);
    return {};
}

Status parse_const_shift(const std::uint8_t* data, int bytes, const char* name, DepthGeometry* geometry) {
    if (bytes < 2)
        return Status::error(Code::format, "%s: the depth information has %d bytes, expected 2", name, bytes);
    const int shift = le16(data);
    if (shift < 1 || shift >= kShifts / 4)
        return Status::error(Code::format, "%s tells a constant shift of %d, expected 1..%d", name, shift,
                             kShifts / 4 - 1);
    geometry->const_shift = shift;
    return {};
}

int shift_depth_mm(const DepthGeometry& g, int factor, int shift) {
    // A shift counts quarters of a pixel; 0.375 is how far the pattern's correlation lies beside the pixel.
    constexpr double kSteps = 4, kOffset = 0.375, kMm = 10;
    const double x = ((shift - kSteps * g.const_shift / factor) / kSteps - kOffset) * g.pixel_cm * factor;
    const double z = kMm * (x * g.reference_cm / (g.emitter_cm - x) + g.reference_cm);
    return shift > 0 && z > 0 && z < kMaxDepth_mm ? static_cast<int>(z) : 0;
}

void build_depth_table(const DepthGeometry& geometry, int factor, std::uint16_t table[kShifts]) {
    for (int s = 0; s < kShifts; ++s)
        table[s] = static_cast<std::uint16_t>(shift_depth_mm(geometry, factor, s));
    table[kShifts - 1] = 0;
}

Camera depth_camera(const DepthGeometry& geometry, int width, int height) {
    Camera c;
    c.width = width;
    c.height = height;
    c.fx = c.fy = geometry.reference_cm / geometry.pixel_cm * width / kSensorWidth;
    // The device tells no principal point; both OpenNI2 and libfreenect take the middle.
    c.cx = (width - 1) / 2.0;
    c.cy = (height - 1) / 2.0;
    return c;
}

Se3 colour_from_depth(const DepthGeometry& geometry) {
    Se3 T;
    T.t.x = -0.01 * geometry.colour_cm;
    return T;
}

}  // namespace burin
