// SPDX-License-Identifier: MIT
#include "platform/usb/registration.h"

#include <cmath>
#include <cstring>
#include <new>

#include "platform/usb/bytes.h"

namespace burin {
namespace {

constexpr double kScale = 256;
// The colour image begins one pixel in (OpenNI2, XN_SENSOR_WIN_OFFET).
constexpr int kOffset = 1;

// One coordinate's cubic polynomial by forward differences, in the fixed point of the chip: the value in
// 1/2^17 pixel, each order with 8 bits more.
struct Differences {
    // along y for the first column, and from there along x
    std::int64_t value, d, dd, ddd;               // of x
    std::int64_t dy, dyy, dyyy, dxy, dxxy, dxyy;  // of y
};

// The integers come shifted so that they fill 32 bits; the chip's registers are narrower, so their upper bits
// fall off on the left and the sign comes from what is left.
std::int64_t narrowed(std::int32_t value, int left, int right) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(value) << left) >> right;
}
std::int64_t widened(std::int32_t value) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(value) << 8);
}

}  // namespace

Status parse_registration(const std::uint8_t* data, int bytes, const char* name,
                          RegistrationPolynomial* out) {
    if (bytes < kRegistrationBytes)
        return Status::error(Code::format, "%s: the registration table has %d bytes, expected %d", name,
                             bytes, kRegistrationBytes);
    const auto at = [&](int i) { return static_cast<std::int32_t>(le32(data + 4 * i)); };
    out->ax = at(1), out->bx = at(2), out->cx = at(3), out->dx = at(4), out->dx_start = at(5);
    out->ay = at(6), out->by = at(7), out->cy = at(8), out->dy = at(9), out->dy_start = at(10);
    // 11, 12, 15, 16: lens correction that no driver uses; 13, 14: blanking; 0, 25, 27: unused.
    out->dxdx = at(17), out->dxdy = at(18), out->dydx = at(19), out->dydy = at(20);
    out->dxdxdx = at(21), out->dydxdx = at(22), out->dxdxdy = at(23), out->dydxdy = at(24);
    out->dydydx = at(26), out->dydydy = at(28);
    return {};
}

Status parse_padding(const std::uint8_t* data, int bytes, const char* name, RegistrationPolynomial* out) {
    if (bytes < kPaddingBytes)
        return Status::error(Code::format, "%s: the padding table has %d bytes, expected %d", name, bytes,
                             kPaddingBytes);
    const int lines = le16(data);
    if (lines > Registration::kHeight)
        return Status::error(Code::format, "%s tells %d padding lines, expected at most %d", name, lines,
                             Registration::kHeight);
    out->start_lines = lines;
    return {};
}

bool Registration::build(const RegistrationPolynomial& p, const DepthGeometry& g) {
    constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;
    x_.reset(new (std::nothrow) std::int32_t[kPixels]);
    y_.reset(new (std::nothrow) std::int16_t[kPixels]);
    shift_.reset(new (std::nothrow) std::int32_t[kMaxDepth_mm]);
    if (!x_ || !y_ || !shift_) {
        x_.reset();
        return false;
    }
    start_lines_ = p.start_lines;

    Differences X = {narrowed(p.dx_start, 13, 4),
                     narrowed(p.dxdx, 11, 3),
                     widened(p.dxdxdx),
                     p.ax,
                     narrowed(p.dydx, 11, 3),
                     widened(p.dydydx),
                     p.bx,
                     widened(p.dydxdx),
                     p.cx,
                     p.dx};
    Differences Y = {narrowed(p.dy_start, 13, 4),
                     narrowed(p.dxdy, 11, 3),
                     widened(p.dxdxdy),
                     p.ay,
                     narrowed(p.dydy, 11, 3),
                     widened(p.dydydy),
                     p.by,
                     widened(p.dydxdy),
                     p.cy,
                     p.dy};
    const auto next_row = [](Differences* q) {
        q->dd += q->dxxy;
        q->d += q->dxy >> 8;
        q->dxy += q->dxyy;
        q->value += q->dy >> 6;
        q->dy += q->dyy >> 8;
        q->dyy += q->dyyy;
    };
    const auto next_column = [](Differences* q) {
        q->value += q->d >> 6;
        q->d += q->dd >> 8;
        q->dd += q->ddd;
    };
    const auto pixels = [](const Differences& q) { return static_cast<double>(q.value) / (1 << 17); };
    for (int y = 0; y < kHeight; ++y) {
        next_row(&X), next_row(&Y);
        Differences cx = X, cy = Y;
        for (int x = 0; x < kWidth; ++x) {
            const int i = y * kWidth + x;
            double u = x + pixels(cx) + kOffset;
            const double v = y + pixels(cy) + kOffset;
            if (!(u >= 0 && v >= 0 && u < kWidth && v < kHeight)) u = 2 * kWidth;
            x_[i] = static_cast<std::int32_t>(u * kScale);
            y_[i] = static_cast<std::int16_t>(v >= 0 && v < kHeight ? v : 0);
            next_column(&cx), next_column(&cy);
        }
    }
    // How far a point moves in the colour image between the reference plane and its depth: the baseline in
    // pixels of 640 times (1 - reference / depth).
    const double pixels_per_cm = 1 / (2 * g.pixel_cm), baseline_px = g.colour_cm * pixels_per_cm;
    shift_[0] = 0;
    for (int z = 1; z < kMaxDepth_mm; ++z)
        shift_[z] = static_cast<std::int32_t>((baseline_px * (z - 10 * g.reference_cm) / z + 0.375) * kScale);
    return true;
}

void Registration::apply(const std::uint16_t* depth_mm, std::uint16_t* registered_mm) const {
    std::memset(registered_mm, 0, std::size_t{kWidth} * kHeight * 2);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            const int z = depth_mm[y * kWidth + x];
            if (z == 0 || z >= kMaxDepth_mm) continue;
            const std::int32_t column = column_256(x, y, z);
            const int row_at = row(y, x) - start_lines_;
            // Less than a pixel to the left is column 0, as the division truncates.
            if (column <= -256 || column >= kWidth * 256 || row_at < 0) continue;
            std::uint16_t& to = registered_mm[row_at * kWidth + column / 256];
            if (to == 0 || to > z) to = static_cast<std::uint16_t>(z);
        }
}

bool Registration::fit_camera(const Camera& depth, const DepthGeometry& geometry, Camera* colour,
                              Se3* T_colour_depth, double* residual_px) const {
    // At infinity a point along the ray (a, b, 1) of the depth camera lies at fx a + cx, fy b + cy of the
    // colour camera: two lines.
    const std::int32_t far = shift_[kMaxDepth_mm - 1] +
                             (shift_[kMaxDepth_mm - 1] - shift_[kMaxDepth_mm / 2]);  // ~ 1/z: as much again
    double n = 0, sa = 0, saa = 0, su = 0, sau = 0, sb = 0, sbb = 0, sv = 0, sbv = 0, suu = 0, svv = 0;
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            const int i = y * kWidth + x;
            if (x_[i] >= kWidth * 256) continue;
            const double a = (x - depth.cx) / depth.fx, b = (y - depth.cy) / depth.fy;
            const double u = (x_[i] + far) / kScale, v = y_[i] - start_lines_;
            n += 1, sa += a, saa += a * a, su += u, sau += a * u, suu += u * u;
            sb += b, sbb += b * b, sv += v, sbv += b * v, svv += v * v;
        }
    if (n < kWidth * kHeight / 4) return false;
    const double da = n * saa - sa * sa, db = n * sbb - sb * sb;
    if (!(da > 0 && db > 0)) return false;
    Camera c;
    c.width = kWidth, c.height = kHeight;
    c.fx = (n * sau - sa * su) / da, c.fy = (n * sbv - sb * sv) / db;
    c.cx = (su - c.fx * sa) / n, c.cy = (sv - c.fy * sb) / n;
    const double eu = suu - c.fx * sau - c.cx * su, ev = svv - c.fy * sbv - c.cy * sv;
    *residual_px = std::sqrt(std::fmax(0, eu + ev) / n);
    // Rows come as whole numbers, cut: half a pixel is the mean.
    c.cy += 0.5;
    if (!(c.fx > depth.fx / 2 && c.fx < 2 * depth.fx && c.fy > depth.fy / 2 && c.fy < 2 * depth.fy) ||
        *residual_px > kMaxResidual_px || !check_camera(c, "colour").ok())
        return false;
    *colour = c;
    *T_colour_depth = colour_from_depth(geometry);
    T_colour_depth->t.x *= depth.fx / c.fx;
    return true;
}

}  // namespace burin
