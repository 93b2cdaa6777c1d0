// SPDX-License-Identifier: MIT
#include "uvc_descriptors.h"

#include "vusb.h"

namespace rig {

namespace {

// Most GUIDs are a four-character code and this tail; Intel's older formats have tails of their own.
#define RIG_GUID(a, b, c, d) \
    { a, b, c, d, 0, 0, 0x10, 0, 0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71 }

constexpr int kIsoAlternates = 2;
constexpr unsigned kIsoPacket[kIsoAlternates] = {
    1024, 0x1400};  // one, and three transactions of 1024 bytes a microframe

class Bytes {
  public:
    std::vector<std::uint8_t> v;
    void add(std::initializer_list<unsigned> bytes) {
        for (const unsigned b : bytes) v.push_back(static_cast<std::uint8_t>(b));
    }
    void w(unsigned x) { put16(v, x); }
    void d(std::uint32_t x) { put32(v, x); }
};

void control_interface(Bytes& out, const std::vector<UvcStreamKind>& streams, int interface) {
    std::vector<const UvcStreamKind*> mine;
    for (const UvcStreamKind& s : streams)
        if (s.control_interface == interface) mine.push_back(&s);
    const bool extension = interface == 0;
    out.add({8, 11, static_cast<unsigned>(interface), static_cast<unsigned>(1 + mine.size()), 14, 3, 0,
             2});  // association
    out.add({9, 4, static_cast<unsigned>(interface), 0, 0, 14, 1, 0, 2});
    const std::size_t begin = out.v.size();
    out.add({static_cast<unsigned>(12 + mine.size()), 0x24, 1}), out.w(0x0110), out.w(0), out.d(kUvcClockHz);
    out.add({static_cast<unsigned>(mine.size())});
    for (const UvcStreamKind* s : mine) out.add({static_cast<unsigned>(s->interface)});
    out.add({18, 0x24, 2, 1}), out.w(0x0201), out.add({0, 0}), out.w(0), out.w(0), out.w(0),
        out.add({3, 0, 0, 0});  // camera, terminal 1
    unsigned source = 1;
    if (extension) {
        out.add({28,   0x24, 6,    kUvcExtensionUnit,
                 0xcb, 0x6c, 0x60, 0xc9,
                 0x4c, 0x59, 0x25, 0x4d,
                 0xaf, 0x47, 0xcc, 0xc4,
                 0x96, 0x43, 0x59, 0x95,
                 24,   1,    1,    3,
                 0xff, 0xff, 0xff, 0});
        source = kUvcExtensionUnit;
    }
    for (std::size_t i = 0; i < mine.size(); ++i)
        out.add({9, 0x24, 3, static_cast<unsigned>(8 + i)}), out.w(0x0101),
            out.add({0, source, 0});  // output terminals 8, 9
    set16(&out.v[begin + 5], static_cast<unsigned>(out.v.size() - begin));
}

void streaming_interface(Bytes& out, const UvcConfig& config, const UvcStreamKind& s, unsigned terminal) {
    const unsigned interface = static_cast<unsigned>(s.interface),
                   endpoint = 0x80u | static_cast<unsigned>(s.endpoint);
    const unsigned endpoints = config.bulk && config.absurd != "no-endpoint" ? 1 : 0;
    out.add({9, 4, interface, 0, endpoints, 14, 2, 0, 0});
    const std::size_t begin = out.v.size();
    const auto formats = static_cast<unsigned>(config.absurd == "no-formats" ? 0 : s.formats.size());
    out.add({13 + formats, 0x24, 1, formats}), out.w(0), out.add({endpoint, 0, terminal, 0, 0, 0, 1});
    for (unsigned i = 0; i < formats; ++i) out.add({0});
    for (unsigned i = 0; i < formats; ++i) {
        const UvcFormat& f = s.formats[i];
        const auto sizes = static_cast<unsigned>(s.sizes.size());
        if (f.jpeg) {
            out.add({11, 0x24, 6, i + 1, sizes, 1, 1, 0, 0, 0, 0});
        } else {
            out.add({27, 0x24, 4, i + 1, sizes});
            out.v.insert(out.v.end(), f.guid, f.guid + 16);
            out.add({static_cast<unsigned>(f.bits), 1, 0, 0, 0, 0});
        }
        for (unsigned k = 0; k < sizes; ++k) {
            UvcSize size = s.sizes[k];
            if (config.absurd == "zero-size") size = {0, 0};
            if (config.absurd == "huge-size") size = {65535, 65535};
            const std::uint32_t bytes = uvc_frame_bytes(f, size);
            const auto interval =
                static_cast<std::uint32_t>(config.absurd == "zero-interval" ? 0 : 10000000 / config.fps);
            out.add({30, 0x24, f.jpeg ? 7u : 5u, k + 1, 0});
            out.w(static_cast<unsigned>(size.width)), out.w(static_cast<unsigned>(size.height));
            out.d(bytes * 8 * 6), out.d(bytes * 8 * static_cast<std::uint32_t>(config.fps)), out.d(bytes),
                out.d(interval);
            out.add({1}), out.d(interval);
        }
    }
    set16(&out.v[begin + 4], static_cast<unsigned>(out.v.size() - begin));
    if (endpoints == 1) out.add({7, 5, endpoint, 2}), out.w(512), out.add({0});
    if (config.bulk) return;
    for (int a = 0; a < kIsoAlternates; ++a) {
        out.add({9, 4, interface, static_cast<unsigned>(a + 1), 1, 14, 2, 0, 0});
        out.add({7, 5, endpoint, 5}), out.w(kIsoPacket[a]), out.add({1});
    }
}

}  // namespace

const std::vector<UvcStreamKind>& uvc_streams() {
    static const std::vector<UvcStreamKind> streams = {
        {"depth",
         0,
         1,
         1,
         {{"Z16 ",
           {'I', 'N', 'V', 'Z', 0x90, 0x2d, 0x58, 0x4a, 0x92, 0x0b, 0x77, 0x3f, 0x1f, 0x2c, 0x55, 0x6b},
           16,
           Layout::u16,
           16,
           1,
           1,
           false,
           1},
          {"Y16 ", RIG_GUID('Y', '1', '6', ' '), 16, Layout::u16, 16, 1, 1, false, 1},
          {"Y10 ", RIG_GUID('Y', '1', '0', ' '), 16, Layout::u16, 10, 1, 1, false, 1},
          {"Y12 ", RIG_GUID('Y', '1', '2', ' '), 16, Layout::u16, 12, 1, 1, false, 1},
          {"INZI",
           {'I', 'N', 'Z', 'I', 0x66, 0x1a, 0x42, 0xa2, 0x90, 0x65, 0xd0, 0x18, 0x14, 0xa8, 0xef, 0x8a},
           32,
           Layout::inzi,
           16,
           1,
           2,
           false,
           1}},
         {{640, 480}, {848, 480}, {320, 240}}},
        {"infrared",
         0,
         2,
         2,
         {{"GREY", RIG_GUID('Y', '8', ' ', ' '), 8, Layout::u8, 8, 1, 1, false, 1},
          {"Y8I ", RIG_GUID('Y', '8', 'I', ' '), 16, Layout::u8, 8, 2, 1, false, 3},
          {"Y12I", RIG_GUID('Y', '1', '2', 'I'), 24, Layout::pair12, 12, 2, 1, false, 4},
          {"pRAA", RIG_GUID('R', 'W', '1', '0'), 10, Layout::mipi10, 10, 1, 1, false, 5}},
         {{640, 480}, {320, 240}}},
        {"colour",
         kUvcSecondControl,
         4,
         3,
         {{"YUYV", RIG_GUID('Y', 'U', 'Y', '2'), 16, Layout::u8, 8, 2, 1, false, 2},
          {"UYVY", RIG_GUID('U', 'Y', 'V', 'Y'), 16, Layout::u8, 8, 2, 1, false, 2},
          {"MJPG", {}, 16, Layout::u8, 8, 2, 1, true, 2}},
         {{640, 480}, {320, 240}}},
    };
    return streams;
}

Format uvc_pixels(const UvcFormat& format, UvcSize size) {
    return {format.layout, format.sample_bits, size.width * format.samples, size.height * format.planes};
}

std::uint32_t uvc_frame_bytes(const UvcFormat& format, UvcSize size) {
    return static_cast<std::uint32_t>(static_cast<std::uint64_t>(size.width) * size.height * format.bits / 8);
}

std::vector<std::uint8_t> uvc_device_descriptor(const UvcConfig& config) {
    Bytes out;
    out.add({18, 1}), out.w(0x0200), out.add({0xef, 2, 1, 64});
    out.w(config.vendor), out.w(config.product), out.w(0x50f0), out.add({1, 2, 3, 1});
    return out.v;
}

std::vector<std::uint8_t> uvc_configuration(const UvcConfig& config) {
    Bytes out;
    const auto& streams = uvc_streams();
    out.add({9, 2}), out.w(0), out.add({5, 1, 0, 0x80, 250});
    unsigned terminal = 8;
    for (const UvcStreamKind& s : streams) {
        if (s.interface == s.control_interface + 1) {
            control_interface(out, streams, s.control_interface);
            terminal = 8;
        }
        streaming_interface(out, config, s, terminal++);
    }
    set16(&out.v[2], static_cast<unsigned>(out.v.size()));
    if (config.absurd == "cut") out.v.resize(out.v.size() / 2);  // the length stays what it was
    return out.v;
}

}  // namespace rig
