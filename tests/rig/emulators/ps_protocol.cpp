// SPDX-License-Identifier: MIT
#include "ps_protocol.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>

namespace rig {

PsConstants PsConstants::named(const std::string& name) {
    PsConstants c;
    if (name == "zero")
        c.emitter_distance = c.colour_distance = c.reference_distance = c.pixel_size = 0, c.shift = 0;
    if (name == "nan")
        c.emitter_distance = c.reference_distance = c.pixel_size = std::numeric_limits<float>::quiet_NaN();
    if (name == "negative") c.emitter_distance = -7.5f, c.reference_distance = -120;
    if (name == "huge")
        c.emitter_distance = 1e30f, c.reference_distance = 1e30f, c.pixel_size = 1e30f, c.shift = 65535;
    return c;
}

void PsConstants::write(std::uint8_t* out) const {
    const float f[4] = {emitter_distance, colour_distance, reference_distance, pixel_size};
    std::memcpy(out, f, sizeof f);
}

int ps_depth_mm(const PsConstants& c, int shift) {
    if (shift <= 0 || shift >= 2047) return 0;
    const double x = ((shift - 4 * c.shift) / 4.0 - 0.375) * static_cast<double>(c.pixel_size);
    const double z =
        10 * (x * static_cast<double>(c.reference_distance) / (static_cast<double>(c.emitter_distance) - x) +
              static_cast<double>(c.reference_distance));
    const int mm = static_cast<int>(z);
    return z > 0 && z < 10000 ? mm : 0;
}

std::vector<std::uint16_t> ps_shift_table(const PsConstants& c) {
    std::vector<std::uint16_t> table(10001, 2047);
    std::vector<int> error(10001, std::numeric_limits<int>::max());
    for (int s = 0; s < 2047; ++s) {
        const int mm = ps_depth_mm(c, s);
        if (mm <= 0) continue;
        // Half the way to both neighbours is this shift's.
        for (int d = std::max(1, mm - 200); d <= std::min(10000, mm + 200); ++d) {
            const int e = std::abs(d - mm);
            if (e < error[static_cast<std::size_t>(d)])
                error[static_cast<std::size_t>(d)] = e,
                table[static_cast<std::size_t>(d)] = static_cast<std::uint16_t>(s);
        }
    }
    return table;
}

std::vector<std::uint8_t> ps_registration() {
    // In pixels: start 1/256, first differences 1/32768 a step, higher ones as they add up in libfreenect's
    // registration.c.
    const std::int32_t words[29] = {/* dx_center */ 0,
                                    /* ax */ 12,
                                    /* bx */ -9,
                                    /* cx */ 5,
                                    /* dx */ -4,
                                    /* dx_start */ 1331,
                                    /* ay */ -6,
                                    /* by */ 11,
                                    /* cy */ 4,
                                    /* dy */ -7,
                                    /* dy_start */ 700,
                                    /* dx_beta_start, dy_beta_start */ 0,
                                    0,
                                    /* rollout_blank, size */ 0,
                                    0,
                                    /* dx_beta_inc, dy_beta_inc */ 0,
                                    0,
                                    /* dxdx_start */ -160,
                                    /* dxdy_start */ 35,
                                    /* dydx_start */ -28,
                                    /* dydy_start */ -190,
                                    /* dxdxdx_start */ 20,
                                    /* dydxdx_start */ -15,
                                    /* dxdxdy_start */ 9,
                                    /* dydxdy_start */ 13,
                                    /* back_comp1 */ 0,
                                    /* dydydx_start */ -18,
                                    /* back_comp2 */ 0,
                                    /* dydydy_start */ 22};
    std::vector<std::uint8_t> bytes;
    for (const std::int32_t w : words) put32(bytes, static_cast<std::uint32_t>(w));
    return bytes;
}

// Request: 47 4d, words of payload, opcode, tag, payload. Reply: 52 42, words, opcode, tag, error code, data;
// `words` counts the code.
int PsControl::control(const Setup& setup, std::uint8_t* data) {
    if (setup.request != 0) return kStall;
    if (setup.type == 0x40) {
        answer_.clear();
        if (setup.length < 8 || data[0] != 0x47 || data[1] != 0x4d) return setup.length;
        const int opcode = static_cast<int>(get16(data + 4));
        std::uint8_t arguments[512] = {};
        const int bytes = std::min<int>(setup.length - 8, static_cast<int>(sizeof arguments));
        std::memcpy(arguments, data + 8, static_cast<std::size_t>(bytes));
        std::vector<std::uint8_t> reply;
        int code = command(opcode, arguments, bytes, &reply), value = 0;
        if (reply.size() % 2 != 0) reply.push_back(0);
        if (faults_.take("error_code", &value)) code = value != 0 ? value : 1, reply.clear();
        answer_ = {0x52, 0x42};
        put16(answer_, static_cast<unsigned>(1 + reply.size() / 2));
        answer_.insert(answer_.end(), data + 4, data + 8);
        put16(answer_, static_cast<unsigned>(code));
        answer_.insert(answer_.end(), reply.begin(), reply.end());
        if (faults_.take("wrong_tag")) answer_[6] ^= 0x55;
        if (faults_.take("wrong_opcode")) answer_[4] ^= 0x01;
        if (faults_.take("wrong_magic")) answer_[0] ^= 0xff;
        if (faults_.take("wrong_size", &value)) set16(&answer_[2], static_cast<unsigned>(value));
        if (faults_.take("short_reply", &value))
            answer_.resize(std::min<std::size_t>(answer_.size(), static_cast<std::size_t>(value)));
        if (faults_.take("long_reply")) answer_.resize(answer_.size() + 64, 0xee);
        return setup.length;
    }
    if (faults_.take("empty_reply")) return 0;  // "not yet": the host asks again
    const std::size_t n = std::min<std::size_t>(answer_.size(), setup.length);
    std::copy_n(answer_.begin(), n, data);
    answer_.clear();
    return static_cast<int>(n);
}

void PsStream::start() {
    on_ = true;
    frame_ = 0;
    pos_ = wire_pos_ = 0;
    wire_.clear();
    next_at_ = now_s();
}

void PsStream::prepare(Faults& faults) {
    middle_told_ = false;
    if (faults.take("short_frame")) image_.resize(image_.size() / 2);
    if (faults.take("long_frame")) image_.resize(image_.size() + 3 * static_cast<std::size_t>(chunk_), 0xee);
}

int PsStream::next_packet(std::uint8_t* out, int fps, Faults& faults, bool leads) {
    const std::size_t n = std::min(static_cast<std::size_t>(chunk_), image_.size() - pos_);
    const bool first = pos_ == 0, last = pos_ + n == image_.size();
    const auto time =
        static_cast<std::uint32_t>(static_cast<std::uint64_t>(now_s() * 60e6));  // of a 60 MHz clock
    std::uint8_t h[kHeader] = {'R', 'B', 0, static_cast<std::uint8_t>(flag_ | (first ? 1 : last ? 5 : 2))};
    if (byte_sequence)
        h[4] = 0, h[5] = static_cast<std::uint8_t>(number_);
    else
        set16(h + 4, number_ & 0xffff);
    ++number_;
    h[6] = static_cast<std::uint8_t>((n + kHeader) >> 8), h[7] = static_cast<std::uint8_t>(n + kHeader);
    set32(h + 8, first && padding_field ? 0 : time);
    std::memcpy(out, h, kHeader);
    std::memcpy(out + kHeader, &image_[pos_], n);
    int size = static_cast<int>(n) + kHeader, value = 0;
    if (faults.take("corrupt_magic")) out[0] ^= 0xff;
    if (faults.take("corrupt_type", &value)) out[3] = static_cast<std::uint8_t>(value);
    if (faults.take("corrupt_size", &value))
        out[6] = static_cast<std::uint8_t>(value >> 8), out[7] = static_cast<std::uint8_t>(value);
    if (faults.take("corrupt_number")) out[byte_sequence ? 5 : 4] ^= 0x40;
    if (faults.take("corrupt_padding")) set32(out + 8, 0xffffffffu);
    if (faults.take("corrupt_data")) std::memset(out + kHeader, 0xff, n);
    if (faults.take("short_packet")) size = kHeader + static_cast<int>(n) / 2;
    if (faults.take("runt_packet", &value)) size = std::min(value, kHeader - 1);
    if (faults.take("lost_packet")) size = 0;
    pos_ += n;
    if (leads && !middle_told_ && 2 * pos_ >= image_.size()) {
        middle_told_ = true;
        faults.middle_of_frame();
    }
    if (last) {
        pos_ = 0;
        ++frame_;
        if (faults.take("lost_frame")) ++frame_;
        next_at_ = std::max(next_at_ + 1.0 / fps, now_s() - 1.0 / fps);
    }
    return size;
}

}  // namespace rig
