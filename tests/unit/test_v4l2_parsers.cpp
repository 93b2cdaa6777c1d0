// SPDX-License-Identifier: MIT
// What V4L2 devices tell of themselves, without any: metadata, calibration tables, layouts, formats. The
// devices themselves are emulated for real kernels in tests/rig.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "capture/calibration.h"
#include "capture/crc32.h"
#include "platform/v4l2/d4xx_tables.h"
#include "platform/v4l2/raw_layout.h"
#include "platform/v4l2/uvc_metadata.h"
#include "platform/v4l2/v4l2_formats.h"

namespace burin {
namespace {

using Bytes = std::vector<std::uint8_t>;

void put16(Bytes& b, unsigned v) { b.push_back(v & 255), b.push_back(v >> 8 & 255); }
void put32(Bytes& b, std::uint32_t v) { put16(b, v & 65535), put16(b, v >> 16); }
void put_float(Bytes& b, float f) {
    std::uint32_t bits;
    std::memcpy(&bits, &f, 4);
    put32(b, bits);
}
void set32(Bytes& b, std::size_t at, std::uint32_t v) {
    for (int i = 0; i < 4; ++i) b[at + static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(v >> 8 * i);
}

// One payload header as the kernel hands it over, with PTS and clock reference.
Bytes payload(std::uint32_t pts, std::uint8_t flags = 0x0c, const Bytes& behind = {}) {
    Bytes b(8, 0);  // the host's ns
    put16(b, 77);
    b.push_back(static_cast<std::uint8_t>(12 + behind.size()));
    b.push_back(flags);
    put32(b, pts);
    b.insert(b.end(), 6, 0);
    b.insert(b.end(), behind.begin(), behind.end());
    return b;
}

TEST(UvcMetadata, FirstTimeStampOfTheFrameAndItsErrors) {
    Bytes b = payload(1234), second = payload(99, 0x4c);
    b.insert(b.end(), second.begin(), second.end());
    const UvcFrameMetadata m = parse_uvc_metadata(b.data(), b.size(), false);
    EXPECT_TRUE(m.any && m.has_pts && m.error);
    EXPECT_EQ(m.pts, 1234u);
    // Cut anywhere nothing is read beyond, and what is whole stays.
    for (std::size_t n = 0; n <= b.size(); ++n) {
        const Bytes cut(b.begin(), b.begin() + static_cast<std::ptrdiff_t>(n));
        EXPECT_EQ(parse_uvc_metadata(cut.data(), cut.size(), true).has_pts, n >= 22) << n;
    }
    b[10] = 1;  // a header of one byte
    EXPECT_FALSE(parse_uvc_metadata(b.data(), b.size(), false).any);
}

TEST(UvcMetadata, BlocksOfD4xx) {
    Bytes behind;
    put32(behind, 0x80000000u), put32(behind, 60), put32(behind, 2), put32(behind, 0x17f);
    put32(behind, 16), put32(behind, 8500), put32(behind, 150);
    behind.resize(60, 0);
    put32(behind, 0x80000001u), put32(behind, 40), put32(behind, 1), put32(behind, 0x3f);
    put32(behind, 4321);
    behind.resize(100, 0);
    const Bytes b = payload(5, 0x0c, behind);
    const UvcFrameMetadata m = parse_uvc_metadata(b.data(), b.size(), true);
    EXPECT_TRUE(m.has_counter && m.has_depth_control);
    EXPECT_EQ(m.counter, 4321u);
    EXPECT_EQ(m.exposure_us, 8500u);
    EXPECT_EQ(m.laser_power_mw, 150u);
    EXPECT_FALSE(parse_uvc_metadata(b.data(), b.size(), false).has_counter) << "UVCH has none";
}

TEST(UvcMetadata, ClockOutOfTheDescriptorsOfItsInterface) {
    const auto control = [](std::uint8_t number, std::uint8_t streaming, std::uint32_t hz) {
        Bytes b = {9, 4, number, 0, 0, 14, 1, 0, 0, 13, 0x24, 1, 0x50, 1, 13, 0};
        put32(b, hz);
        b.push_back(1);
        b.push_back(streaming);
        return b;
    };
    Bytes all = {18, 1, 0, 2, 0, 0, 0, 64, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
    for (const Bytes& b : {control(0, 1, 1000000), control(3, 4, 27000000)})
        all.insert(all.end(), b.begin(), b.end());
    EXPECT_EQ(uvc_clock_hz(all.data(), all.size(), 0), 1000000u);
    EXPECT_EQ(uvc_clock_hz(all.data(), all.size(), 1), 1000000u);
    EXPECT_EQ(uvc_clock_hz(all.data(), all.size(), 4), 27000000u);
    EXPECT_EQ(uvc_clock_hz(all.data(), all.size(), 9), 0u);
    for (std::size_t n = 0; n < all.size(); ++n) {
        const Bytes cut(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(n));
        EXPECT_EQ(uvc_clock_hz(cut.data(), cut.size(), 4), 0u);
    }
}

TEST(TickClock, TimeGoesOnWhereTheCounterWrapsAround) {
    TickClock clock(1e6);
    const std::int64_t begin = clock.ns(0xfffffff0u);
    EXPECT_EQ(clock.ns(0xfffffffau) - begin, 10'000);
    EXPECT_EQ(clock.ns(6) - begin, 22'000);
    EXPECT_EQ(clock.ns(0xffffffffu) - begin, 15'000) << "a stamp that comes a little late";
}

Bytes answer_of(std::uint32_t opcode, const Bytes& data) {
    Bytes a;
    put32(a, opcode);
    a.insert(a.end(), data.begin(), data.end());
    a.resize(kD4xxMonitorBytes, 0);
    set32(a, kD4xxMonitorBytes - 4, static_cast<std::uint32_t>(data.size()));
    return a;
}

TEST(D4xx, AnswersAreHeldAgainstTheirCommand) {
    std::uint8_t command[24];
    d4xx_table_command(D4xxTable::depth, command);
    Bytes a = answer_of(0x15, {1, 2, 3});
    const std::uint8_t* data = nullptr;
    std::size_t bytes = 0;
    ASSERT_TRUE(d4xx_answer(command, a.data(), a.size(), &data, &bytes).ok());
    EXPECT_EQ(bytes, 3u);
    EXPECT_EQ(data[2], 3);
    set32(a, kD4xxMonitorBytes - 4, 100000);
    EXPECT_EQ(d4xx_answer(command, a.data(), a.size(), &data, &bytes).code(), Code::format);
    a = answer_of(0x10, {});
    EXPECT_EQ(d4xx_answer(command, a.data(), a.size(), &data, &bytes).code(), Code::format);
    a = answer_of(static_cast<std::uint32_t>(-7), {});
    const Status refused = d4xx_answer(command, a.data(), a.size(), &data, &bytes);
    EXPECT_NE(std::strstr(refused.text(), "error -7"), nullptr) << refused.text();
}

Bytes depth_table(float scale = 1) {
    Bytes body;
    for (int i = 0; i < 36; ++i) put_float(body, 0);
    put_float(body, 50 * scale);
    put32(body, 1);
    body.resize(body.size() + 88, 0);
    for (int i = 0; i < 16; ++i)
        for (const float v : {600.f + static_cast<float>(i), 601.f, 320.f, 240.f}) put_float(body, v * scale);
    body.resize(body.size() + 64, 0);
    Bytes table = {2, 0, 25, 0};
    put32(table, static_cast<std::uint32_t>(body.size()));
    put32(table, 0);
    put32(table, crc32(body.data(), body.size()));
    table.insert(table.end(), body.begin(), body.end());
    return table;
}

TEST(D4xx, CameraOfASizeOrAWordWhyNot) {
    Camera camera;
    double baseline_m = 0;
    Bytes table = depth_table();
    ASSERT_TRUE(d4xx_depth_camera(table.data(), table.size(), 640, 480, &camera, &baseline_m).ok());
    EXPECT_EQ(camera.fx, 602);
    EXPECT_EQ(camera.width, 640);
    EXPECT_NEAR(baseline_m, 0.05, 1e-9);
    EXPECT_EQ(d4xx_depth_camera(table.data(), table.size(), 641, 480, &camera, &baseline_m).code(),
              Code::unsupported);
    for (const float scale : {0.f, 1e30f, std::nanf("")}) {
        const Bytes bad = depth_table(scale);
        EXPECT_EQ(d4xx_depth_camera(bad.data(), bad.size(), 640, 480, &camera, &baseline_m).code(),
                  Code::format)
            << scale;
    }
    table[40] ^= 1;
    const Status wrong = d4xx_depth_camera(table.data(), table.size(), 640, 480, &camera, &baseline_m);
    EXPECT_NE(std::strstr(wrong.text(), "check sum"), nullptr) << wrong.text();
    for (const std::size_t n : {0u, 15u, 100u, 300u})
        EXPECT_EQ(d4xx_depth_camera(table.data(), n, 640, 480, &camera, &baseline_m).code(), Code::format);
}

TEST(RawLayout, WordsOfABoardByDeclaration) {
    RawLayout l;
    ASSERT_TRUE(parse_raw_layout(
                    "images=3 take=2 brightness=1 mask=0x0fff scale=0.25 offset=-3 none=4095 unit=0.0005 "
                    "confidence=0 certain=1000",
                    &l)
                    .ok());
    EXPECT_EQ(l.images, 3);
    EXPECT_EQ(l.take, 2);
    EXPECT_EQ(l.brightness, 1);
    EXPECT_EQ(l.confidence, 0);
    EXPECT_EQ(l.certain, 1000);
    EXPECT_EQ(l.affine.mask, 0x0fff);
    EXPECT_EQ(l.affine.scale, 0.25f);
    EXPECT_EQ(l.affine.offset, -3.f);
    EXPECT_EQ(l.affine.none, 4095u);
    EXPECT_EQ(l.unit_m, 0.0005);
    ASSERT_TRUE(parse_raw_layout("", &l).ok());
    for (const char* bad :
         {"images=0", "images=2 take=2", "take=1", "scale=nan", "scale=", "mask=70000", "unit=0", "colour=1",
          "images=1.5", "images=2,take=1", "brightness=1", "confidence=1", "certain=0"}) {
        const Status s = parse_raw_layout(bad, &l);
        EXPECT_EQ(s.code(), Code::invalid_argument) << bad;
        EXPECT_NE(std::strstr(s.text(), "layout"), nullptr) << s.text();
    }
}

TEST(V4l2Formats, SizesAreThoseOfTheirPixels) {
    struct Case {
        const char* name;
        std::uint64_t row, image;
    };
    // 10 x 3.
    for (const Case& c :
         {Case{"Z16", 20, 60}, Case{"INZI", 20, 120}, Case{"Y8I", 20, 60}, Case{"Y12I", 30, 90},
          Case{"CNF4", 5, 15}, Case{"GREY", 10, 30}, Case{"Y10P", 15, 45}, Case{"Y10BPACK", 13, 39},
          Case{"YUYV", 20, 60}, Case{"UYVY", 20, 60}, Case{"NV12", 10, 50}, Case{"RGB24", 30, 90},
          Case{"GRBG8", 10, 30}}) {
        const V4l2Format* f = find_v4l2_format(c.name);
        ASSERT_NE(f, nullptr) << c.name;
        EXPECT_EQ(find_v4l2_format(f->code), f) << "no code twice";
        EXPECT_EQ(v4l2_row_bytes(*f, 10), c.row) << c.name;
        EXPECT_EQ(v4l2_image_bytes(*f, 10, 3, c.row), c.image) << c.name;
    }
    EXPECT_EQ(find_v4l2_format("H264"), nullptr);
    EXPECT_TRUE(may_be_depth(*find_v4l2_format("Y16")));
    EXPECT_FALSE(may_be_depth(*find_v4l2_format("YUYV")));
}

DeviceInfo two_streams() {
    DeviceInfo info;
    for (const StreamKind kind : {StreamKind::depth, StreamKind::colour}) {
        StreamInfo& s = info.at(kind);
        s.kind = kind;
        s.width = 320;
        s.height = 240;
    }
    return info;
}

TEST(Calibration, FileForSensorsThatKnowNoneOfTheirs) {
    DeviceInfo info = two_streams();
    const char* text =
        "# of a board\nwidth 640\nheight 480\nfx 600\nfy 601\ncx 319.5\ncy 239.5\ndepth_scale 4000\n"
        "colour_fx 500\ncolour_fy 500\ncolour_cx 160\ncolour_cy 120\nT_colour_depth -0.025 0 0 0 0 0 1\n";
    ASSERT_TRUE(parse_calibration(text, "c.txt", &info).ok());
    const StreamInfo &depth = info.at(StreamKind::depth), &colour = info.at(StreamKind::colour);
    EXPECT_TRUE(depth.calibrated && colour.calibrated);
    EXPECT_EQ(depth.camera.fx, 300) << "scaled to the stream";
    EXPECT_EQ(depth.camera.cx, 159.5);
    EXPECT_EQ(depth.unit_m, 1 / 4000.0);
    EXPECT_EQ(colour.camera.fx, 500) << "no size: the stream's own";
    EXPECT_EQ(colour.T_stream_depth.t.x, -0.025);
    const struct {
        const char *text, *says;
    } cases[] = {{"fx 600\nfy\n", "c.txt:2"},
                 {"fx 1 2\n", "one number"},
                 {"fz 3\n", "no key"},
                 {"fx 600\n", "depth camera"},
                 {"width 0\n", "c.txt:1"},
                 {"fx nan\n", "one number"},
                 {"T_colour_depth 1 2 3\n", "qx"},
                 {"depth_scale 0\n", "depth_scale"},
                 {"width 100\nheight 7\nfx 9\nfy 9\ncx 1\ncy 1\n", "320x240"}};
    for (const auto& c : cases) {
        DeviceInfo untouched = two_streams();
        const Status s = parse_calibration(c.text, "c.txt", &untouched);
        EXPECT_EQ(s.code(), Code::format) << c.text;
        EXPECT_NE(std::strstr(s.text(), c.says), nullptr) << s.text();
        EXPECT_FALSE(untouched.at(StreamKind::depth).calibrated);
    }
    EXPECT_EQ(read_calibration("/no/such/file", &info).code(), Code::io);
}

}  // namespace
}  // namespace burin
