// SPDX-License-Identifier: MIT
// Control requests, packets, frames, clocks and constants of USB sensors, without USB.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdarg>
#include <limits>
#include <random>

#include "platform/usb/control_channel.h"
#include "platform/usb/depth_geometry.h"
#include "platform/usb/registration.h"
#include "platform/usb/tick_clock.h"
#include "unit/usb_script.h"

using namespace burin;

namespace {

double seconds_of(const std::function<void()>& f) {
    const std::int64_t t = monotonic_ns();
    f();
    return static_cast<double>(monotonic_ns() - t) * 1e-9;
}

TEST(UsbControl, EachFaultHasItsStatusWithinASecond) {
    const struct {
        ControlFault fault;
        Code code;
        const char* says;
    } cases[] = {{ControlFault::silent, Code::timeout, "not answered request 2"},
                 {ControlFault::wrong_tag, Code::format, "tag"},
                 {ControlFault::wrong_size, Code::format, "claims"},
                 {ControlFault::wrong_magic, Code::format, "begins with"},
                 {ControlFault::wrong_opcode, Code::format, "is one to"},
                 {ControlFault::cut, Code::format, "has 6 bytes"},
                 {ControlFault::error_code, Code::unsupported, "bad parameters"},
                 {ControlFault::stall, Code::io, "stalled"},
                 {ControlFault::gone, Code::disconnected, "unplugged"}};
    for (const auto& c : cases) {
        UsbScript usb;
        usb.fault = c.fault;
        ControlChannel channel;
        channel.attach(&usb, "it");
        Status s;
        std::uint16_t value;
        EXPECT_LT(seconds_of([&] { s = channel.get_param(5, &value); }), 1.0) << c.says;
        EXPECT_EQ(static_cast<int>(s.code()), static_cast<int>(c.code)) << s.text();
        EXPECT_NE(std::strstr(s.text(), c.says), nullptr) << s.text();
        EXPECT_EQ(std::strchr(s.text(), '\n'), nullptr);
    }
}

TEST(UsbControl, SetsAndGets) {
    UsbScript usb;
    ControlChannel channel;
    channel.attach(&usb, "it");
    ASSERT_TRUE(channel.set_param(18, 3).ok());
    EXPECT_EQ(usb.params[18], 3);
    std::uint16_t value = 0;
    ASSERT_TRUE(channel.get_param(18, &value).ok());
    EXPECT_EQ(value, 3);
    ASSERT_TRUE(channel.set_cmos(9, 300).ok());
    ASSERT_TRUE(channel.get_cmos(9, &value).ok());
    EXPECT_EQ(value, 300);
}

TEST(UsbControl, ALateAnswerOfAnEarlierRequestIsPassedOver) {
    UsbScript usb;
    ControlChannel channel;
    channel.attach(&usb, "it");
    usb.fault = ControlFault::stale_once;
    EXPECT_TRUE(channel.set_param(6, 2).ok());
}

TEST(UsbControl, OneThatIsNotReadyIsAskedAgain) {
    UsbScript usb;
    ControlChannel channel;
    channel.attach(&usb, "it");
    usb.not_ready = 2;
    EXPECT_TRUE(channel.set_param(6, 2).ok());
    EXPECT_EQ(usb.requests, 3);
    usb.not_ready = 100;
    Status s;
    EXPECT_LT(seconds_of([&] { s = channel.set_param(6, 2); }), 1.0);
    EXPECT_EQ(s.code(), Code::timeout) << s.text();
}

// ----------------------------------------------------------------------------------------------------
// packets

struct Kept final : PacketSink {
    std::vector<Bytes> packets;
    std::vector<PacketHeader> headers;
    int broken = 0, skipped = 0;
    void packet_begin(const PacketHeader& h) override { headers.push_back(h), packets.emplace_back(); }
    void packet_data(const std::uint8_t* d, int n) override {
        packets.back().insert(packets.back().end(), d, d + n);
    }
    void packet_end() override {}
    void packet_broken() override { ++broken; }
    void garbage(int n) override { skipped += n; }
};

TEST(UsbPackets, AnyCutOfTheStreamGivesTheSamePackets) {
    std::mt19937 random(7);
    Bytes stream;
    std::vector<Bytes> payloads;
    int garbage = 0;
    for (int i = 0; i < 40; ++i) {
        Bytes data(random() % 900);
        for (auto& b : data)
            b = static_cast<std::uint8_t>(random() % 4 == 0 ? 0x52 : random() % 4 == 0 ? 0x42 : random());
        payloads.push_back(data);
        const Bytes p =
            packet(0x72, i, data.data(), static_cast<int>(data.size()), 1000u + static_cast<unsigned>(i));
        stream.insert(stream.end(), p.begin(), p.end());
        if (i % 5 == 4 && i < 39) {  // what is no packet: also a magic with an impossible size behind it
            const Bytes no[] = {
                {1, 2, 3}, {0x52}, {0x52, 0x42, 0, 0x71, 0, 0, 0, 3, 0, 0, 0, 0}, {0x52, 0x52}};
            const Bytes& g = no[(i / 5) % 4];
            stream.insert(stream.end(), g.begin(), g.end());
            garbage += static_cast<int>(g.size());
        }
    }
    for (int round = 0; round < 50; ++round) {
        Kept kept;
        PacketParser parser;
        parser.reset(&kept, PacketFraming::stream);
        const int most = round == 0 ? 1 : round == 1 ? 1 << 20 : 1 + static_cast<int>(random() % 700);
        for (std::size_t at = 0; at < stream.size();) {
            const std::size_t n =
                std::min<std::size_t>(stream.size() - at, 1 + random() % static_cast<unsigned>(most));
            parser.bytes(stream.data() + at, static_cast<int>(n));
            at += n;
        }
        ASSERT_EQ(kept.packets.size(), payloads.size()) << "round " << round;
        for (std::size_t i = 0; i < payloads.size(); ++i) {
            EXPECT_EQ(kept.packets[i], payloads[i]);
            EXPECT_EQ(kept.headers[i].id, i);
            EXPECT_EQ(kept.headers[i].stamp, 1000 + i);
        }
        EXPECT_EQ(kept.skipped, garbage);
    }
}

TEST(UsbPackets, AnIsochronousPacketBeginsAnewAfterACutOne) {
    Kept kept;
    PacketParser parser;
    parser.reset(&kept, PacketFraming::datagrams);
    Bytes data(500);
    for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<std::uint8_t>(i);
    Bytes a = packet(0x71, 1, data.data(), 500, 0), b = packet(0x72, 2, data.data(), 500, 0);
    parser.bytes(a.data(), 200);  // cut
    parser.bytes(b.data(), static_cast<int>(b.size()));
    ASSERT_EQ(kept.packets.size(), 2u);
    EXPECT_EQ(kept.broken, 1);
    EXPECT_EQ(kept.packets[1], data);
    parser.bytes(b.data(), 300);  // one over two isochronous packets
    parser.bytes(b.data() + 300, static_cast<int>(b.size()) - 300);
    ASSERT_EQ(kept.packets.size(), 3u);
    EXPECT_EQ(kept.packets[2], data);
}

struct Frames final : FrameTarget {
    std::vector<RawFrame> frames;
    std::vector<Bytes> data;
    void frame(const RawFrame& f) override {
        frames.push_back(f);
        data.emplace_back(f.data, f.data + f.bytes);
    }
};

class KinectFrames : public ::testing::Test {
  protected:
    static constexpr int kPacket = 100, kBytes = 950;  // ten packets, the last of 50
    void SetUp() override {
        FrameLayout l;
        l.bytes = l.capacity = kBytes, l.packet_bytes = kPacket, l.id_bits = 8, l.pixels = 640;
        ASSERT_TRUE(assembler.reset(l, &got));
        parser.reset(&assembler, PacketFraming::whole);
        for (int n = 0; n < 40; ++n) {
            Bytes f(kBytes);
            for (int i = 0; i < kBytes; ++i)
                f[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(i * 7 + n);
            frames.push_back(f);
            for (const Bytes& p : packets_of(f, 0x70, kPacket, true, &id, static_cast<std::uint32_t>(n), 77))
                packets.push_back(p);
        }
    }
    void send(std::size_t i) { parser.bytes(packets[i].data(), static_cast<int>(packets[i].size())); }
    Frames got;
    FrameAssembler assembler;
    PacketParser parser;
    std::vector<Bytes> frames, packets;
    int id = 250;
};

TEST_F(KinectFrames, Whole) {
    for (std::size_t i = 3; i < packets.size(); ++i) send(i);  // begins in the middle of one
    ASSERT_EQ(got.frames.size(), 39u);
    for (std::size_t n = 0; n < 39; ++n) {
        EXPECT_EQ(got.frames[n].fault, FrameFault::none);
        EXPECT_EQ(got.data[n], frames[n + 1]);
        EXPECT_EQ(got.frames[n].stamp, n + 1);
    }
}

TEST_F(KinectFrames, LostPacketsLeaveTheRestInPlace) {
    for (std::size_t i = 0; i < packets.size(); ++i)
        if (i != 13 && i != 14 && i != 30) send(i);  // two in the middle of frame 1, the first of frame 3
    ASSERT_EQ(got.frames.size(), 40u);
    EXPECT_EQ(got.frames[1].fault, FrameFault::packets_lost);
    EXPECT_EQ(got.frames[1].packets_lost, 2);
    EXPECT_TRUE(got.frames[2].after_gap);
    Bytes expected = frames[1];
    std::fill(expected.begin() + 300, expected.begin() + 500, 0xff);
    EXPECT_EQ(got.data[1], expected);
    EXPECT_EQ(got.frames[3].fault, FrameFault::packets_lost);
    expected = frames[3];
    std::fill(expected.begin(), expected.begin() + 100, 0xff);
    EXPECT_EQ(got.data[3], expected);
    EXPECT_EQ(got.frames[4].fault, FrameFault::none);
}

TEST_F(KinectFrames, LossOverTheEndOfAFrame) {
    for (std::size_t i = 0; i < packets.size(); ++i)
        if (i < 18 || i > 21) send(i);  // the last two of frame 1, the first two of frame 2
    ASSERT_EQ(got.frames.size(), 40u);
    EXPECT_EQ(got.frames[1].packets_lost, 2);
    EXPECT_FALSE(got.frames[1].has_stamp);
    EXPECT_EQ(got.frames[2].packets_lost, 2);
    EXPECT_EQ(got.frames[3].fault, FrameFault::none);
    EXPECT_EQ(got.data[3], frames[3]);
}

TEST_F(KinectFrames, ShortLongAndCorrupt) {
    packets[12].resize(60);           // short
    packets[25].resize(112 + 30, 9);  // long
    packets[34][0] = 'X';             // no packet any more: lost
    packets[47][3] = 0x71;            // begins a frame where none begins
    packets[58][3] = 0x33;            // of no stream: lost
    for (std::size_t i = 0; i < packets.size(); ++i) send(i);
    EXPECT_EQ(got.frames[1].fault, FrameFault::packet_short);
    EXPECT_EQ(got.frames[2].fault, FrameFault::packet_long);
    EXPECT_EQ(got.data[2], frames[2]);
    EXPECT_EQ(got.frames[3].fault, FrameFault::packets_lost);
    EXPECT_EQ(got.frames[4].fault, FrameFault::no_end);
    // Whatever happened before, the last frame is whole.
    EXPECT_EQ(got.frames.back().fault, FrameFault::none);
    EXPECT_EQ(got.data.back(), frames.back());
    EXPECT_GT(assembler.garbage_bytes(), 0u);
}

TEST(PrimeSenseFrames, PaddingLossAndBrokenTransfers) {
    Frames got;
    FrameAssembler assembler;
    FrameLayout l;
    l.capacity = 4000, l.pixels = 1000, l.padded = true;
    ASSERT_TRUE(assembler.reset(l, &got));
    PacketParser parser;
    parser.reset(&assembler, PacketFraming::stream);
    int id = 65530;
    std::vector<std::vector<Bytes>> frames;
    Bytes data(3000);
    for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<std::uint8_t>(i * 3);
    for (int n = 0; n < 8; ++n)
        frames.push_back(packets_of(data, 0x70, 700, false, &id, 5000u + static_cast<unsigned>(n),
                                    n == 1   ? 20u << 16 | 30
                                    : n == 2 ? 900u << 16 | 101
                                             : 0));
    for (std::size_t n = 0; n < frames.size(); ++n)
        for (std::size_t i = 0; i < frames[n].size(); ++i) {
            if (n == 3 && i == 2) continue;  // lost
            if (n == 4 && i == 1) {
                parser.bytes(frames[n][i].data(), 300);
                parser.lost();  // the rest of the transfer came to nothing
                continue;
            }
            if (n == 5 && i == 4) continue;  // the end
            parser.bytes(frames[n][i].data(), static_cast<int>(frames[n][i].size()));
        }
    ASSERT_EQ(got.frames.size(), 8u);
    EXPECT_EQ(got.frames[0].fault, FrameFault::none);
    EXPECT_EQ(got.data[0], data);
    EXPECT_EQ(got.frames[0].stamp, 5000u);
    EXPECT_EQ(got.frames[1].pad_before, 20);
    EXPECT_EQ(got.frames[1].pad_after, 30);
    EXPECT_EQ(got.frames[2].fault, FrameFault::wrong_size);  // more padding than pixels
    EXPECT_EQ(got.frames[2].pad_before, 0);
    EXPECT_EQ(got.frames[3].fault, FrameFault::packets_lost);
    EXPECT_EQ(got.frames[4].fault, FrameFault::packet_broken);
    EXPECT_EQ(got.frames[5].fault, FrameFault::packets_lost);
    EXPECT_TRUE(got.frames[6].after_gap);
    EXPECT_EQ(got.frames[7].fault, FrameFault::none);
}

// ------------------------------------------------------------------------------------------- clocks,
// constants

TEST(UsbClock, GoesOnWhereTheCounterWraps) {
    TickClock clock;
    clock.reset(60e6);
    std::int64_t host = 1'000'000'000, first = 0, ns = 0;
    const std::uint32_t start = 0xfffff000u;
    ASSERT_TRUE(clock.ns(start, host, &first));
    for (int i = 1; i < 10000; ++i) {  // 333 s: four and a half rounds
        host += 33'333'333;
        ASSERT_TRUE(clock.ns(start + static_cast<std::uint32_t>(i) * 2'000'000u, host, &ns));
        ASSERT_NEAR(static_cast<double>(ns - first), i * 2e6 / 60e6 * 1e9, 2.0);
    }
    // Nothing for five minutes, then on.
    host += 300'000'000'000;
    std::int64_t later = 0;
    ASSERT_TRUE(
        clock.ns(start + 9999u * 2'000'000u + static_cast<std::uint32_t>(300 * std::uint64_t{60'000'000}),
                 host, &later));
    EXPECT_NEAR(static_cast<double>(later - ns), 300e9, 100);
}

TEST(UsbClock, PassesOverACorruptStamp) {
    TickClock clock;
    clock.reset(60e6);
    std::int64_t a = 0, b = 0;
    ASSERT_TRUE(clock.ns(1000, 0, &a));
    EXPECT_FALSE(clock.ns(0x80000000u, 33'333'333, &b));
    ASSERT_TRUE(clock.ns(1000 + 4'000'000, 66'666'666, &b));
    EXPECT_NEAR(static_cast<double>(b - a), 66'666'666, 10);
    // A device that began anew is believed after a while.
    int refused = 0;
    for (int i = 0; i < 10; ++i)
        refused += !clock.ns(0xa0000000u + static_cast<std::uint32_t>(i) * 2'000'000u,
                             100'000'000 + i * std::int64_t{33'333'333}, &b);
    EXPECT_EQ(refused, 4);
}

Bytes fixed_params(float a, float b, float c, float d) {
    Bytes all(168);
    const float f[] = {a, b, c, d};
    std::memcpy(&all[92], f, 16);
    return all;
}

TEST(UsbGeometry, DepthOfShiftsAndIntrinsics) {
    DepthGeometry g;
    const Bytes f = fixed_params(7.5f, 2.4f, 120.f, 0.1042f);
    ASSERT_TRUE(parse_fixed_params(f.data(), 168, "it", &g).ok());
    const std::uint8_t shift[] = {200, 0};
    ASSERT_TRUE(parse_const_shift(shift, 2, "it", &g).ok());
    // As Debian's OpenNI2 gave it for these constants (the rig's notes).
    EXPECT_EQ(shift_depth_mm(g, 1, 300), 437);
    std::uint16_t table[kShifts];
    build_depth_table(g, 1, table);
    EXPECT_EQ(table[300], 437);
    EXPECT_EQ(table[2047], 0);
    for (int s = 1; s < kShifts; ++s) EXPECT_TRUE(table[s] >= table[s - 1] || table[s] == 0) << s;
    EXPECT_LT(*std::max_element(table, table + kShifts), kMaxDepth_mm);
    // The focal length everybody knows: 575.8 pixels of 640.
    EXPECT_NEAR(depth_camera(g, 640, 480).fx, 575.8, 0.1);
    EXPECT_NEAR(depth_camera(g, 320, 240).fx, 287.9, 0.1);
    EXPECT_NEAR(colour_from_depth(g).t.x, -0.024, 1e-6);
}

TEST(UsbGeometry, AbsurdConstantsAreNamed) {
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    const struct {
        float v[4];
        const char* says;
    } cases[] = {{{0, 2.4f, 120, 0.1f}, "projector of 0 cm"},
                 {{-7.5f, 2.4f, 120, 0.1f}, "projector of -7.5"},
                 {{nan, 2.4f, 120, 0.1f}, "projector of"},
                 {{7.5f, inf, 120, 0.1f}, "colour camera of inf"},
                 {{7.5f, 2.4f, -120, 0.1f}, "reference distance of"},
                 {{7.5f, 2.4f, 120, 0}, "pixel size of 0"},
                 {{7.5f, 2.4f, 120, 1e30f}, "pixel size of 1e+30"},
                 {{7.5f, 2.4f, 13, 0.9f}, "ratio"}};
    for (const auto& c : cases) {
        DepthGeometry g;
        const Bytes f = fixed_params(c.v[0], c.v[1], c.v[2], c.v[3]);
        const Status s = parse_fixed_params(f.data(), 168, "it", &g);
        EXPECT_EQ(s.code(), Code::format);
        EXPECT_NE(std::strstr(s.text(), c.says), nullptr) << s.text();
    }
    DepthGeometry g;
    const Bytes f = fixed_params(7.5f, 2.4f, 120.f, 0.1042f);
    EXPECT_EQ(parse_fixed_params(f.data(), 107, "it", &g).code(), Code::format);
    for (const int shift : {0, 512, 65535}) {
        std::uint8_t d[2];
        put_le16(d, static_cast<unsigned>(shift));
        EXPECT_EQ(parse_const_shift(d, 2, "it", &g).code(), Code::format);
    }
    EXPECT_EQ(parse_const_shift(nullptr, 0, "it", &g).code(), Code::format);
}

// A registration table that shifts by a constant and shrinks: dx = a + b x.
RegistrationPolynomial shrinking(double a_px, double b) {
    RegistrationPolynomial p;
    // The first value is in 1/2^17 pixel, 4 bits above; the slope in 1/2^23, 3 bits above.
    p.dx_start = static_cast<std::int32_t>(a_px * (1 << 17)) * 16 >> 13;
    p.dxdx = static_cast<std::int32_t>(b * (1 << 23)) * 8 >> 11;
    p.dydy = p.dxdx;
    return p;
}

TEST(UsbRegistration, FitsTheColourCamera) {
    DepthGeometry g;
    const Bytes f = fixed_params(7.5f, 2.4f, 120.f, 0.1042f);
    ASSERT_TRUE(parse_fixed_params(f.data(), 168, "it", &g).ok());
    Registration r;
    // Colour sees wider: nine tenths of the pixels, 40 pixels in.
    ASSERT_TRUE(r.build(shrinking(40, -0.1), g));
    Camera colour;
    double residual = 0;
    const Camera depth = depth_camera(g, 640, 480);
    Se3 T_colour_depth;
    ASSERT_TRUE(r.fit_camera(depth, g, &colour, &T_colour_depth, &residual));
    EXPECT_LT(residual, 0.5);
    EXPECT_NEAR(colour.fx, 0.9 * depth.fx, 0.5);
    EXPECT_NEAR(colour.fy, 0.9 * depth.fy, 0.5);
    // A point at the reference distance lands where the table says: (x, y) + d(x, y) + 1.
    EXPECT_NEAR(r.column_256(300, 200, 1200) / 256.0, 300 + 40 - 30 + 1 + 0.375, 0.1);
    for (const int z_mm : {500, 800, 1200, 3000, 9000})
        for (const int x : {100, 300, 600}) {
            const double z = 0.001 * z_mm;
            const Vec3d p = {(x - depth.cx) / depth.fx * z, (200 - depth.cy) / depth.fy * z, z};
            const Pixel at = project(colour, T_colour_depth * p);
            EXPECT_NEAR(at.u, r.column_256(x, 200, z_mm) / 256.0, 0.1);
            EXPECT_NEAR(at.v, 200 - 20 + 1, 0.6);
        }
}

TEST(UsbRegistration, TheNearestWins) {
    DepthGeometry g;
    const Bytes f = fixed_params(7.5f, 2.4f, 120.f, 0.1042f);
    ASSERT_TRUE(parse_fixed_params(f.data(), 168, "it", &g).ok());
    Registration r;
    ASSERT_TRUE(r.build(shrinking(0, 0), g));
    std::vector<std::uint16_t> depth(640 * 480), out(640 * 480, 7);
    depth[100 * 640 + 300] = 1200;  // moves by nothing but the offset of one pixel each way
    depth[100 * 640 + 310] = 600;   // moves by a baseline's worth: 11.5 pixels to the left
    r.apply(depth.data(), out.data());
    EXPECT_EQ(out[101 * 640 + 301], 1200);
    EXPECT_EQ(out[101 * 640 + 299], 600);
    EXPECT_EQ(std::count(out.begin(), out.end(), 0), 640 * 480 - 2);
    // Whatever the table says, nothing is written outside (checked under the address sanitizer).
    std::mt19937 random(3);
    for (int i = 0; i < 20; ++i) {
        std::uint8_t blob[kRegistrationBytes];
        for (auto& b : blob) b = static_cast<std::uint8_t>(random());
        RegistrationPolynomial p;
        ASSERT_TRUE(parse_registration(blob, sizeof blob, "it", &p).ok());
        p.start_lines = static_cast<int>(random() % 481);
        ASSERT_TRUE(r.build(p, g));
        for (auto& d : depth) d = static_cast<std::uint16_t>(random() % 12000);
        r.apply(depth.data(), out.data());
    }
}

}  // namespace
