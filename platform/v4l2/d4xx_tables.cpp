// SPDX-License-Identifier: MIT
#include "platform/v4l2/d4xx_tables.h"

#include <cmath>
#include <cstdio>
#include <cstring>

#include "capture/crc32.h"

namespace burin {
namespace {

constexpr std::uint16_t kMagic = 0xcdab;
constexpr std::uint32_t kDetails = 0x10, kGetTable = 0x15;

std::uint32_t le32(const std::uint8_t* p) {
    return static_cast<std::uint32_t>(p[0]) | static_cast<std::uint32_t>(p[1]) << 8 |
           static_cast<std::uint32_t>(p[2]) << 16 | static_cast<std::uint32_t>(p[3]) << 24;
}
std::uint32_t le16(const std::uint8_t* p) {
    return static_cast<std::uint32_t>(p[0]) | static_cast<std::uint32_t>(p[1]) << 8;
}
double le_float(const std::uint8_t* p) {
    const std::uint32_t bits = le32(p);
    float f;
    std::memcpy(&f, &bits, 4);
    return static_cast<double>(f);
}

void command_of(std::uint32_t opcode, std::uint32_t parameter, std::uint8_t c[24]) {
    std::memset(c, 0, 24);
    c[0] = 20;  // bytes after these four
    c[2] = kMagic & 0xff;
    c[3] = kMagic >> 8;
    c[4] = static_cast<std::uint8_t>(opcode);
    c[8] = static_cast<std::uint8_t>(parameter);
}

// Head of a table: u16 version, u16 kind, u32 bytes behind the head, u32 parameter, u32 check sum of them.
constexpr std::size_t kHead = 16;
Status body_of(const std::uint8_t* table, std::size_t bytes, D4xxTable kind, std::size_t wanted,
               const std::uint8_t** body) {
    if (bytes < kHead + wanted)
        return Status::error(Code::format, "D4xx: a calibration table of %zu bytes, expected %zu", bytes,
                             kHead + wanted);
    const std::uint32_t size = le32(table + 4);
    if (le16(table + 2) != static_cast<std::uint32_t>(kind))
        return Status::error(Code::format, "D4xx: calibration table %u, asked for %u", le16(table + 2),
                             static_cast<unsigned>(kind));
    if (size < wanted || size > bytes - kHead)
        return Status::error(Code::format, "D4xx: a calibration table says it has %u bytes of %zu", size,
                             bytes - kHead);
    if (crc32(table + kHead, size) != le32(table + 12))
        return Status::error(Code::format, "D4xx: the check sum of calibration table %u is wrong",
                             static_cast<unsigned>(kind));
    *body = table + kHead;
    return {};
}

// Sizes of the rectified depth images, in the order of the table's entries.
struct Size {
    int width, height;
};
constexpr Size kSizes[] = {{1920, 1080}, {1280, 720}, {640, 480},  {848, 480},  {640, 360}, {424, 240},
                           {320, 240},   {480, 270},  {1280, 800}, {960, 540},  {0, 0},     {0, 0},
                           {640, 400},   {576, 576},  {720, 720},  {1152, 1152}};
// Offsets in the depth table: behind four 3x3 matrices the baseline (mm), a word, 88 bytes, then fx fy cx cy
// by size.
constexpr std::size_t kBaseline = 144, kRectified = kBaseline + 4 + 4 + 88;
// In the colour table: 3x3 intrinsics (by columns, of an image from -1 to 1), five of distortion, rotation,
// translation, projection, calibrated size, rectified intrinsics, rotation and translation (mm) from depth.
constexpr std::size_t kDistortion = 36, kCalibratedSize = 36 + 20 + 12 + 12 + 48,
                      kRotation = kCalibratedSize + 4 + 36, kTranslation = kRotation + 36;

}  // namespace

void d4xx_details_command(std::uint8_t command[24]) { command_of(kDetails, 0, command); }
void d4xx_table_command(D4xxTable table, std::uint8_t command[24]) {
    command_of(kGetTable, static_cast<std::uint32_t>(table), command);
}

Status d4xx_answer(const std::uint8_t command[24], const std::uint8_t* answer, std::size_t bytes,
                   const std::uint8_t** data, std::size_t* data_bytes) {
    if (bytes < 8)
        return Status::error(Code::format, "D4xx: an answer of %zu bytes, expected at least 8", bytes);
    const auto code = static_cast<std::int32_t>(le32(answer));
    if (code < 0)
        return Status::error(Code::format, "D4xx: the device answers command %#x with error %d", command[4],
                             code);
    if (static_cast<std::uint32_t>(code) != le32(command + 4))
        return Status::error(Code::format, "D4xx: the answer is to command %#x, asked was %#x",
                             static_cast<unsigned>(code), command[4]);
    const std::uint32_t size = le32(answer + bytes - 4);
    if (size > bytes - 8)
        return Status::error(Code::format, "D4xx: an answer of %u bytes, expected at most %zu", size,
                             bytes - 8);
    *data = answer + 4;
    *data_bytes = size;
    return {};
}

Status d4xx_serial(const std::uint8_t* details, std::size_t bytes, char serial[16]) {
    constexpr std::size_t kModuleSerial = 48;
    if (bytes < kModuleSerial + 6)
        return Status::error(Code::format, "D4xx: details of %zu bytes, expected at least %zu", bytes,
                             kModuleSerial + 6);
    const std::uint8_t* s = details + kModuleSerial;
    std::snprintf(serial, 16, "%02x%02x%02x%02x%02x%02x", s[0], s[1], s[2], s[3], s[4], s[5]);
    return {};
}

Status d4xx_depth_camera(const std::uint8_t* table, std::size_t bytes, int width, int height, Camera* camera,
                         double* baseline_m) {
    const std::uint8_t* body = nullptr;
    BURIN_TRY(
        body_of(table, bytes, D4xxTable::depth, kRectified + sizeof kSizes / sizeof kSizes[0] * 16, &body));
    const double baseline_mm = std::fabs(le_float(body + kBaseline));
    // D405 has 18 mm, D455 95 mm.
    if (!(baseline_mm >= 5 && baseline_mm <= 500))
        return Status::error(Code::format, "D4xx: a baseline of %g mm, expected 5..500", baseline_mm);
    for (std::size_t i = 0; i < sizeof kSizes / sizeof kSizes[0]; ++i) {
        if (kSizes[i].width != width || kSizes[i].height != height) continue;
        const std::uint8_t* r = body + kRectified + 16 * i;
        *camera = {width, height, le_float(r), le_float(r + 4), le_float(r + 8), le_float(r + 12)};
        *baseline_m = baseline_mm * 1e-3;
        return check_camera(*camera, "D4xx depth");
    }
    return Status::error(Code::unsupported, "D4xx: no calibration of depth images of %dx%d", width, height);
}

Status d4xx_colour_camera(const std::uint8_t* table, std::size_t bytes, int width, int height, Camera* camera,
                          Se3* T_colour_depth) {
    const std::uint8_t* body = nullptr;
    BURIN_TRY(body_of(table, bytes, D4xxTable::colour, kTranslation + 12, &body));
    const double calibrated_width = le16(body + kCalibratedSize),
                 calibrated_height = le16(body + kCalibratedSize + 2);
    if (!(calibrated_width >= 16 && calibrated_height >= 16))
        return Status::error(Code::format, "D4xx: colour calibrated at %gx%g", calibrated_width,
                             calibrated_height);
    // An image of another shape is the middle of the calibrated one, scaled.
    const bool wider = width * calibrated_height > height * calibrated_width;
    const double scale = wider ? width / calibrated_width : height / calibrated_height;
    const double left = (calibrated_width - width / scale) / 2,
                 top = (calibrated_height - height / scale) / 2;
    Camera c;
    c.width = width;
    c.height = height;
    c.fx = le_float(body) * calibrated_width / 2 * scale;
    c.fy = le_float(body + 16) * calibrated_height / 2 * scale;
    c.cx = ((le_float(body + 24) + 1) * calibrated_width / 2 - left) * scale;
    c.cy = ((le_float(body + 28) + 1) * calibrated_height / 2 - top) * scale;
    const double k[5] = {le_float(body + kDistortion), le_float(body + kDistortion + 4),
                         le_float(body + kDistortion + 8), le_float(body + kDistortion + 12),
                         le_float(body + kDistortion + 16)};
    // Brown's coefficients, but of the inverse model (from distorted to ideal): to first order their
    // negatives. Those of colour are a fraction of a pixel, and most devices have zeros.
    c.k1 = -k[0], c.k2 = -k[1], c.p1 = -k[2], c.p2 = -k[3], c.k3 = -k[4];
    BURIN_TRY(check_camera(c, "D4xx colour"));
    // Rotation by columns; the translation is that of the depth camera's points in colour coordinates, but
    // turned.
    double rows[12];
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            rows[4 * row + column] =
                le_float(body + kRotation + static_cast<std::size_t>(4 * (3 * column + row)));
        rows[4 * row + 3] = -1e-3 * le_float(body + kTranslation + static_cast<std::size_t>(4 * row));
    }
    const Result<Se3> T_depth_colour = se3_from_matrix(rows, 3);
    if (!T_depth_colour.ok() || !(norm((*T_depth_colour).t) < 1))
        return Status::error(Code::format,
                             "D4xx: the transform from depth to colour is no rigid one of less than a metre");
    *T_colour_depth = (*T_depth_colour).inverse();
    *camera = c;
    return {};
}

}  // namespace burin
