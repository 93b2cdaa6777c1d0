// SPDX-License-Identifier: MIT
// A USB device that follows a script, below the driver of USB sensors: it answers control requests as a
// Kinect or a PrimeSense device does and sends packets that the test makes. Stands in for libusb and
// hardware; real kernels with emulated devices are in tests/rig.
#pragma once

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "capture/monotonic.h"
#include "capture/source.h"
#include "platform/usb/bytes.h"
#include "platform/usb/frame_assembler.h"
#include "platform/usb/sensor_models.h"
#include "platform/usb/usb_io.h"

namespace burin {

enum class ControlFault {
    none,
    silent,
    wrong_tag,
    stale_once,
    wrong_size,
    wrong_magic,
    wrong_opcode,
    cut,
    error_code,
    stall,
    gone
};

using Bytes = std::vector<std::uint8_t>;

// Bits of `values` one after another, most significant first.
inline Bytes pack_bits(const std::vector<std::uint16_t>& values, int bits) {
    Bytes out;
    std::uint32_t acc = 0;
    int have = 0;
    for (const std::uint16_t v : values) {
        acc = acc << bits | v;
        for (have += bits; have >= 8; have -= 8) out.push_back(static_cast<std::uint8_t>(acc >> (have - 8)));
    }
    if (have > 0) out.push_back(static_cast<std::uint8_t>(acc << (8 - have)));
    return out;
}

// One packet with its header.
inline Bytes packet(int kind, int id, const std::uint8_t* data, int bytes, std::uint32_t stamp) {
    Bytes p(12);
    p[0] = 0x52, p[1] = 0x42, p[3] = static_cast<std::uint8_t>(kind);
    put_le16(&p[4], static_cast<unsigned>(id));
    p[6] = static_cast<std::uint8_t>((bytes + 12) >> 8), p[7] = static_cast<std::uint8_t>(bytes + 12);
    put_le16(&p[8], stamp & 0xffff), put_le16(&p[10], stamp >> 16);
    p.insert(p.end(), data, data + bytes);
    return p;
}

// A frame in packets of `payload` bytes. Kinect counts ids in byte 5.
inline std::vector<Bytes> packets_of(const Bytes& frame, int base, int payload, bool kinect, int* id,
                                     std::uint32_t stamp, std::uint32_t first_stamp) {
    std::vector<Bytes> all;
    const int size = static_cast<int>(frame.size());
    for (int at = 0; at < size || at == 0; at += payload) {
        const int n = std::min(payload, size - at);
        const int place = at == 0 ? 1 : at + n == size ? 5 : 2;
        Bytes p = packet(base | place, kinect ? (*id & 255) << 8 : *id & 0xffff, frame.data() + at, n,
                         place == 1 ? first_stamp : stamp);
        ++*id;
        all.push_back(p);
    }
    return all;
}

struct UsbScript final : UsbIo {
    SensorFamily family = SensorFamily::primesense;
    float lengths[4] = {7.5f, 2.4f, 120.f, 0.1042f};
    int const_shift = 200;
    float mhz = 60;
    Bytes registration = Bytes(116);
    Bytes presets;
    std::uint8_t firmware[4] = {8, 5, 0x22, 0};  // 5.8.22
    int isochronous_alternate = 1;
    // Of requests with fault_opcode (-1: of all).
    ControlFault fault = ControlFault::none;
    int fault_opcode = -1, error_code = 5, not_ready = 0;
    // What pump() sends next: by endpoint, one entry a transfer; an empty entry is a lost one.
    std::vector<std::pair<int, Bytes>> to_send;
    std::function<void(UsbScript&)> on_pump;
    // Seen.
    std::map<int, int> params;
    int requests = 0, pipes = 0, opened = 0, closed = 0, alternate = 0;
    bool plugged = true;

    int control(std::uint8_t type, std::uint8_t, std::uint16_t, std::uint8_t* data, int length,
                int timeout_ms) override {
        if (!plugged) return kUsbGone;
        if (type == 0x40) {
            request_.assign(data, data + length);
            ++requests;
            return length;
        }
        const int opcode = le16(&request_[4]);
        const ControlFault f = fault_opcode < 0 || fault_opcode == opcode ? fault : ControlFault::none;
        switch (f) {
            case ControlFault::silent:
                sleep_until_ns(monotonic_ns() + std::int64_t{timeout_ms} * 1'000'000);
                return kUsbTimeout;
            case ControlFault::stall:
                return kUsbStall;
            case ControlFault::gone:
                plugged = false;
                return kUsbGone;
            default:
                break;
        }
        Bytes reply(10);
        reply[0] = 0x52, reply[1] = 0x42;
        std::memcpy(&reply[4], &request_[4], 4);
        int error = f == ControlFault::error_code ? error_code : 0;
        if (not_ready > 0 && opcode == 3) --not_ready, error = 13;
        if (opcode == 0x95) error = 1;  // a count
        put_le16(&reply[8], static_cast<unsigned>(error));
        if (error == 0 || opcode == 0x95) answer(opcode, &reply);
        put_le16(&reply[2], static_cast<unsigned>(reply.size() - 8) / 2);
        if (f == ControlFault::wrong_tag) put_le16(&reply[6], le16(&reply[6]) + 7u);
        if (f == ControlFault::stale_once) {
            put_le16(&reply[6], le16(&reply[6]) - 1u);
            fault = ControlFault::none;
        }
        if (f == ControlFault::wrong_size) put_le16(&reply[2], le16(&reply[2]) + 5u);
        if (f == ControlFault::wrong_magic) reply[0] = 'X';
        if (f == ControlFault::wrong_opcode) reply[4] ^= 1;
        if (f == ControlFault::cut) reply.resize(6);
        const int n = std::min<int>(length, static_cast<int>(reply.size()));
        std::memcpy(data, reply.data(), static_cast<std::size_t>(n));
        return n;
    }

    bool endpoint(int a, std::uint8_t address, UsbEndpoint* found) override {
        if (a < 0 || a > 1 || (address != 0x81 && address != 0x82)) return false;
        *found = {address, family == SensorFamily::kinect || a == isochronous_alternate, 512};
        return true;
    }
    Status select_alternate(int a) override {
        alternate = a;
        return {};
    }
    Status open_pipe(const UsbEndpoint& e, UsbReceiver* receiver) override {
        receivers_[e.address] = receiver;
        ++pipes, ++opened;
        return {};
    }
    int close_pipes() override {
        closed += pipes;
        pipes = 0;
        receivers_.clear();
        return 0;
    }
    Status pump(std::int64_t) override {
        if (!plugged) return Status::error(Code::disconnected, "script is unplugged");
        if (on_pump) on_pump(*this);
        for (const auto& [endpoint, data] : to_send) {
            UsbReceiver* r = receivers_.count(endpoint) ? receivers_[endpoint] : nullptr;
            if (!r) continue;
            if (data.empty())
                r->lost();
            else
                r->bytes(data.data(), static_cast<int>(data.size()));
        }
        to_send.clear();
        return {};
    }
    bool read_later(std::uint8_t, int, UsbReceiver*) override { return false; }

  private:
    void append(Bytes* reply, const void* data, std::size_t n) {
        const auto* p = static_cast<const std::uint8_t*>(data);
        reply->insert(reply->end(), p, p + n);
    }
    void answer(int opcode, Bytes* reply) {
        const auto word = [&](int i) {
            return static_cast<int>(le16(&request_[static_cast<std::size_t>(8 + 2 * i)]));
        };
        switch (opcode) {
            case 0:
                append(reply, firmware, 4);
                reply->resize(reply->size() + 8);
                break;
            case 2: {
                std::uint8_t v[2];
                put_le16(v, static_cast<unsigned>(params[word(0)]));
                append(reply, v, 2);
                break;
            }
            case 3:
                params[word(0)] = word(1);
                break;
            case 4: {
                Bytes all(family == SensorFamily::kinect ? 320 : 168);
                std::memcpy(&all[92], lengths, 16);  // the tests' hosts are little-endian
                const std::size_t at =
                    family == SensorFamily::kinect
                        ? 0
                        : std::min<std::size_t>(168, 4 * static_cast<std::size_t>(word(0)));
                // In two pieces, as a long answer comes.
                const std::size_t n =
                    family == SensorFamily::kinect ? all.size() : std::min<std::size_t>(100, 168 - at);
                append(reply, all.data() + at, n);
                break;
            }
            case 22: {
                Bytes all;
                switch (word(0)) {
                    case 0:
                        all.resize(2), put_le16(all.data(), static_cast<unsigned>(const_shift));
                        break;
                    case 2:
                    case 0x40:
                        all = registration;
                        break;
                    case 3:
                    case 0x41:
                        all.resize(6);
                        break;
                    case 0x80:
                        all.resize(4), std::memcpy(all.data(), &mhz, 4);
                        break;
                    default:
                        break;
                }
                const std::size_t at = std::min(all.size(), 2 * static_cast<std::size_t>(word(4)));
                append(reply, all.data() + at, all.size() - at);
                break;
            }
            case 36:
                append(reply, presets.data(), presets.size());
                break;
            case 0x95: {
                if (word(1) & 0x8000) cmos_[word(1) & 0x7fff] = word(2);
                std::uint8_t v[4];
                put_le16(v, static_cast<unsigned>(word(1))),
                    put_le16(v + 2, static_cast<unsigned>(cmos_[word(1) & 0x7fff]));
                append(reply, v, 4);
                break;
            }
            default:
                break;
        }
    }
    Bytes request_;
    std::map<int, int> cmos_;
    std::map<int, UsbReceiver*> receivers_;
};

// Keeps what came.
struct KeptImages final : SourceSink {
    struct Image {
        StreamKind kind;
        ImageStamp stamp;
        Bytes pixels;
    };
    std::size_t bytes[kStreamKinds] = {};
    std::vector<Image> images;
    std::vector<ImuSample> samples;
    std::vector<std::string> lines;
    bool full = false, keep = true;
    int committed = 0, damaged = 0;
    Bytes slot;

    void prepare(const DeviceInfo& info) {
        std::size_t most = 0;
        for (int k = 0; k < kStreamKinds; ++k) {
            bytes[k] = info.streams[k].image_bytes;
            most = std::max(most, bytes[k]);
        }
        slot.assign(most + 64, 0xaa);
    }
    std::uint8_t* acquire(StreamKind) override { return full ? nullptr : slot.data(); }
    void commit(StreamKind kind, std::uint8_t* image, const ImageStamp& stamp) override {
        ++committed;
        damaged += stamp.damaged;
        if (keep) images.push_back({kind, stamp, Bytes(image, image + bytes[static_cast<int>(kind)])});
    }
    void abandon(StreamKind, std::uint8_t*) override {}
    void lend(StreamKind, const std::uint8_t*, std::size_t, std::uint64_t, int, const ImageStamp&) override {}
    void imu(const ImuSample& sample) override { samples.push_back(sample); }
    void count_damaged(StreamKind, int images_) override { damaged += images_; }
    void log(LogLevel, const char* format, ...) override __attribute__((format(printf, 3, 4))) {
        char line[512];
        va_list arguments;
        va_start(arguments, format);
        std::vsnprintf(line, sizeof line, format, arguments);
        va_end(arguments);
        if (keep) lines.emplace_back(line);
    }
};

}  // namespace burin
