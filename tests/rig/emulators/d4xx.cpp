// SPDX-License-Identifier: MIT
#include "d4xx.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "vusb.h"

namespace rig {

namespace {

constexpr int kMonitorBytes =
    1024;  // length of selector 1; the size of an answer's data is in its last four bytes
constexpr int kOpGvd = 0x10, kOpGetCalibration = 0x15;
constexpr int kTableDepth = 25, kTableColour = 32;

struct Control {
    int bytes;
    std::uint32_t least, most, step, normal;
};

// By selector; lengths as librealsense queries them.
Control control_of(int selector) {
    switch (selector) {
        case 2:
            return {1, 0, 2, 1, 1};  // emitter: off, on, automatic
        case 3:
            return {4, 1, 165000, 1, 8500};  // exposure, us
        case 4:
            return {2, 0, 360, 30, 150};  // laser power, mW
        case 6:
            return {1, 0, 6, 1, 0};  // preset
        case 7:
            return {1, 0, 255, 1, 0};  // error report
        case 8:
            return {1, 0, 1, 1, 0};  // external trigger
        case 9:
            return {4, 0, 0xffffffffu, 1, 0x25260303u};  // temperatures of projector and chip
        case 10:                                         // automatic white balance
        case 11:                                         // automatic exposure
            return {1, 0, 1, 1, 1};
        case 14:
            return {4, 0, 100, 1, 0};  // LED power
        case 15:
            return {1, 0, 1, 1, 0};  // thermal compensation
        default:
            return {0, 0, 0, 0, 0};
    }
}

std::uint32_t crc32(const std::uint8_t* p, std::size_t n) {  // the common one (IEEE 802.3)
    std::uint32_t crc = ~0u;
    for (; n > 0; --n, ++p) {
        crc ^= *p;
        for (int i = 0; i < 8; ++i) crc = crc >> 1 ^ (0xedb88320u & (0u - (crc & 1)));
    }
    return ~crc;
}

void put_float(std::vector<std::uint8_t>& v, float f) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &f, 4);
    put32(v, bits);
}

}  // namespace

void D4xx::reset() {
    for (int s = 0; s < 32; ++s) controls_[s] = control_of(s).normal;
    answer_.clear();
}

int D4xx::extension(int request, int selector, std::uint8_t* data, int length) {
    const bool is_monitor = selector == 1;
    const Control c = control_of(selector);
    const int bytes = is_monitor ? kMonitorBytes : c.bytes;
    if (bytes == 0) return kStall;
    const auto give = [&](std::uint32_t v) {
        std::uint8_t le[4];
        set32(le, v);
        std::memset(data, 0, static_cast<std::size_t>(length));
        if (!is_monitor) std::memcpy(data, le, static_cast<std::size_t>(std::min(length, c.bytes)));
        return std::min(length, bytes);
    };
    switch (request) {
        case 0x01:  // SET_CUR
            if (is_monitor) {
                if (length >= 24) monitor(data);
            } else {
                std::uint32_t v = 0;
                for (int i = std::min(length, c.bytes) - 1; i >= 0; --i) v = v << 8 | data[i];
                if (v < c.least || v > c.most) return kStall;
                controls_[selector] = v;
            }
            return length;
        case 0x81:  // GET_CUR
            if (!is_monitor) return give(controls_[selector]);
            std::memset(data, 0, static_cast<std::size_t>(length));
            std::memcpy(data, answer_.data(),
                        std::min<std::size_t>(answer_.size(), static_cast<std::size_t>(length)));
            return std::min(length, bytes);
        case 0x82:
            return give(c.least);
        case 0x83:
            return give(c.most);
        case 0x84:
            return give(c.step);
        case 0x85:
            set16(data, static_cast<unsigned>(bytes));
            return 2;  // GET_LEN
        case 0x86:
            data[0] = 3;
            return 1;  // GET_INFO: get and set
        case 0x87:
            return give(c.normal);
        default:
            return kStall;
    }
}

// Command: u16 size after these four bytes, u16 0xcdab, u32 opcode, four u32 parameters. Answer: the opcode,
// or a negative error, then data.
void D4xx::monitor(const std::uint8_t* command) {
    const int opcode = static_cast<int>(get32(command + 4));
    const int table_id = static_cast<int>(get32(command + 8));
    std::vector<std::uint8_t> data;
    int code = opcode;
    if (get16(command + 2) != 0xcdab)
        code = -1;
    else if (opcode == kOpGvd) {
        data.assign(272, 0);
        set16(&data[0], 272);
        data[2] = 5;                                     // version of this structure
        const std::uint8_t firmware[4] = {0, 0, 15, 5};  // 5.15.0.0, lowest part first
        std::copy_n(firmware, 4, &data[12]);
        const std::uint8_t serial[6] = {0x82, 0x63, 0x12, 0x07, 0x05, 0x91};
        std::copy_n(serial, 6, &data[48]);  // of the module, then of the chip
        std::copy_n(serial, 6, &data[64]);
        std::uint8_t changed = 0;
        std::copy_n(&changed, 1, &data[25]);  // not locked
    } else if (opcode == kOpGetCalibration && calibration_ != "none") {
        data = table(table_id);
        if (data.empty()) code = -17;  // no such table
    } else
        code = opcode == kOpGetCalibration ? -25 : -1;  // table is empty; wrong command
    int value = 0;
    if (faults_.take("monitor_error", &value)) code = value != 0 ? value : -7, data.clear();  // -7: not ready
    if (faults_.take("monitor_opcode")) code ^= 0x40;
    std::vector<std::uint8_t> answer;
    put32(answer, static_cast<std::uint32_t>(code));
    answer.insert(answer.end(), data.begin(), data.end());
    answer.resize(kMonitorBytes, 0);
    set32(&answer[kMonitorBytes - 4],
          static_cast<std::uint32_t>(faults_.take("monitor_size", &value) ? value
                                                                          : static_cast<int>(data.size())));
    answer_ = answer;
}

std::vector<std::uint8_t> D4xx::table(int id) const {
    std::vector<std::uint8_t> body;
    const auto matrix = [&](float a, float b, float c, float d) {  // column by column: fx fy cx cy
        for (const float f : {a, 0.f, 0.f, 0.f, b, 0.f, c, d, 1.f}) put_float(body, f);
    };
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const auto bent = [&](float f) {
        return calibration_ == "zero"   ? 0.f
               : calibration_ == "nan"  ? nan
               : calibration_ == "huge" ? 1e30f * f
                                        : f;
    };
    if (id == kTableDepth) {
        matrix(0.6f, 0.8f, 0.f, 0.f), matrix(0.6f, 0.8f, 0.f, 0.f);
        matrix(1, 1, 0, 0), matrix(1, 1, 0, 0);
        put_float(body, bent(truth.baseline_mm));
        put32(body, 1);
        body.resize(body.size() + 88, 0);
        // Rectified fx, fy, cx, cy by size: 16 of them in librealsense's order.
        const int sizes[16][2] = {{1920, 1080}, {1280, 720}, {640, 480},  {848, 480},  {640, 360}, {424, 240},
                                  {320, 240},   {480, 270},  {1280, 800}, {960, 540},  {0, 0},     {0, 0},
                                  {640, 400},   {576, 576},  {720, 720},  {1152, 1152}};
        for (const auto& s : sizes) {
            // One lens on sensors of one height: the scale is that of the height, the centre stays in the
            // middle.
            const float k = static_cast<float>(s[1]) / 480;
            put_float(body, bent(truth.fx * k)), put_float(body, bent(truth.fy * k));
            put_float(body, bent(static_cast<float>(s[0]) / 2 + (truth.cx - 320) * k)),
                put_float(body, bent(truth.cy * k));
        }
        body.resize(body.size() + 64, 0);
    } else if (id == kTableColour) {
        // Normalised to [-1, 1] for the size it was calibrated at, here 640x480.
        matrix(bent(truth.colour_fx / 320), bent(truth.colour_fy / 240), bent(truth.colour_cx / 320 - 1),
               bent(truth.colour_cy / 240 - 1));
        for (int i = 0; i < 5; ++i) put_float(body, 0);
        for (int i = 0; i < 3; ++i) put_float(body, 0);
        for (const float t : truth.colour_t_mm) put_float(body, bent(t));
        for (int i = 0; i < 12; ++i) put_float(body, i % 5 == 0 ? 1.f : 0.f);
        put16(body, 640), put16(body, 480);
        matrix(truth.colour_fx, truth.colour_fy, truth.colour_cx, truth.colour_cy);
        matrix(1, 1, 0, 0);
        for (const float t : truth.colour_t_mm) put_float(body, bent(t));
        body.resize(body.size() + 24, 0);
    } else {
        return {};
    }
    if (calibration_ == "short") body.resize(body.size() / 3);
    std::vector<std::uint8_t> whole = {2, 0};  // version 2.0, big endian
    put16(whole, static_cast<unsigned>(calibration_ == "type" ? id + 1 : id));
    put32(whole, static_cast<std::uint32_t>(calibration_ == "short" ? 3 * body.size() : body.size()));
    put32(whole, 0);
    put32(whole, crc32(body.data(), body.size()) ^ (calibration_ == "crc" ? 1u : 0u));
    whole.insert(whole.end(), body.begin(), body.end());
    return whole;
}

std::vector<std::uint8_t> D4xx::metadata(std::uint32_t frame, int format, int width, int height,
                                         int fps) const {
    std::vector<std::uint8_t> m;
    put32(m, 0x80000000u), put32(m, 60), put32(m, 2), put32(m, 0x17f);  // depth control: all but emitter mode
    put32(m, 16), put32(m, controls_[3]), put32(m, controls_[4]), put32(m, controls_[11]), put32(m, 0);
    put32(m, 0), put32(m, static_cast<std::uint32_t>(width - 1)), put32(m, 0),
        put32(m, static_cast<std::uint32_t>(height - 1));
    put32(m, controls_[6]), put32(m, controls_[2]);
    put32(m, 0x80000001u), put32(m, 40), put32(m, 1), put32(m, 0x3f);  // capture timing
    put32(m, frame), put32(m, controls_[3] / 2), put32(m, 8000), put32(m, controls_[3]);
    put32(m, static_cast<std::uint32_t>(1000000 / fps)), put32(m, 12000);
    put32(m, 0x80000002u), put32(m, 40), put32(m, 1), put32(m, 0xff);  // configuration
    m.push_back(0), m.push_back(0x0d);  // D4xx; standard depth, projector, colour
    put32(m, 0), put16(m, static_cast<unsigned>(format)), put16(m, static_cast<unsigned>(width)),
        put16(m, static_cast<unsigned>(height));
    put16(m, static_cast<unsigned>(fps)), put16(m, 1), put16(m, 0);
    m.resize(140, 0);
    int size = 0;
    if (faults_.due("metadata_size"))
        size = faults_.value("metadata_size"), set32(&m[4], static_cast<std::uint32_t>(size));
    return m;
}

}  // namespace rig
