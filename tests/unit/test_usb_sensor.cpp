// SPDX-License-Identifier: MIT
// The driver of USB sensors from its table of modes to the pixels in the sink, on scripted devices.
#include <gtest/gtest.h>
#include <malloc.h>

#include <cmath>
#include <random>

#include "api/allocation_counter.h"
#include "platform/usb/usb_backend.h"
#include "platform/usb/usb_sensor.h"
#include "unit/usb_script.h"

using namespace burin;

namespace {

using Values = std::vector<std::uint16_t>;

// Shifts over the whole range that the format has, in runs, small steps and jumps.
Values shifts(int pixels, int bits, int n) {
    Values v(static_cast<std::size_t>(pixels));
    for (int i = 0; i < pixels; ++i) {
        const int step = (i / 16) % 3 == 0 ? 0 : (i / 16) % 3 == 1 ? i % 16 : (i * 2654435761u >> 20) % 900;
        v[static_cast<std::size_t>(i)] =
            static_cast<std::uint16_t>((n + i / 16 * 5 + step) & ((1 << bits) - 1));
    }
    return v;
}

// PrimeSense's depth compression, from its description in docs/usb.md.
Bytes ps_compress(const Values& values) {
    std::vector<int> nibbles;
    int last = 0, repeats = 0;
    const auto flush = [&] {
        for (; repeats > 0; repeats -= std::min(repeats, 16))
            nibbles.insert(nibbles.end(), {14, std::min(repeats, 16) - 1});
    };
    bool any = false;
    for (const int v : values) {
        const int d = v - last;
        if (any && d == 0) {
            ++repeats;
            continue;
        }
        flush();
        if (any && d >= -6 && d <= 6)
            nibbles.push_back(d + 6);
        else if (any && d >= -64 && d <= 63)
            nibbles.insert(nibbles.end(), {15, 8 | (d + 64) >> 4, (d + 64) & 15});
        else
            nibbles.insert(nibbles.end(), {15, v >> 12, v >> 8 & 15, v >> 4 & 15, v & 15});
        last = v, any = true;
    }
    flush();
    if (nibbles.size() % 2) nibbles.push_back(13);
    Bytes out;
    for (std::size_t i = 0; i < nibbles.size(); i += 2)
        out.push_back(static_cast<std::uint8_t>(nibbles[i] << 4 | nibbles[i + 1]));
    return out;
}

Bytes wire_of(const Values& v, WireFormat f) {
    switch (f) {
        case WireFormat::packed10:
            return pack_bits(v, 10);
        case WireFormat::packed11:
            return pack_bits(v, 11);
        case WireFormat::packed12:
            return pack_bits(v, 12);
        case WireFormat::ps_depth:
            return ps_compress(v);
        default: {
            Bytes out;
            for (const std::uint16_t s : v)
                out.push_back(static_cast<std::uint8_t>(s)), out.push_back(static_cast<std::uint8_t>(s >> 8));
            return out;
        }
    }
}

const SensorModel& model(SensorFamily family) {
    return *find_sensor_model(family == SensorFamily::kinect ? 0x045e : 0x1d27,
                              family == SensorFamily::kinect ? 0x02ae : 0x0601);
}

struct Rig {
    UsbScript usb;
    KeptImages sink;
    DeviceInfo info;
    SourceOptions options;
    SensorWishes wishes;
    std::unique_ptr<UsbSensor> sensor;
    int depth_id = 0, image_id = 0;
    SensorFamily family;

    explicit Rig(SensorFamily f, std::uint16_t vendor = 0, std::uint16_t product = 0) : family(f) {
        usb.family = f;
        const SensorModel& m = vendor ? *find_sensor_model(vendor, product) : model(f);
        sensor = std::make_unique<UsbSensor>(m, &usb, nullptr, "it");
        options.streams = stream_bit(StreamKind::depth);
    }
    Status open() {
        const Status s = sensor->open(options, wishes, &info);
        sink.prepare(info);
        return s;
    }
    bool kinect() const { return family == SensorFamily::kinect; }
    // Queues a frame; bulk streams are cut anywhere.
    void send(StreamKind kind, const Bytes& wire, std::uint32_t stamp, std::uint32_t padding = 0,
              int drop = -1) {
        const bool depth = kind == StreamKind::depth;
        const int endpoint = depth != kinect() ? 0x81 : 0x82;
        const int payload = !kinect() ? 1300 : depth ? 1748 : 1908;
        int i = 0;
        Bytes stream;
        for (const Bytes& p : packets_of(wire, depth ? 0x70 : 0x80, payload, kinect(),
                                         depth ? &depth_id : &image_id, stamp, padding)) {
            if (i++ == drop) continue;
            if (kinect()) usb.to_send.emplace_back(endpoint, p);
            stream.insert(stream.end(), p.begin(), p.end());
        }
        if (!kinect())
            for (std::size_t at = 0; at < stream.size(); at += 4096)
                usb.to_send.emplace_back(
                    endpoint,
                    Bytes(stream.begin() + static_cast<std::ptrdiff_t>(at),
                          stream.begin() + static_cast<std::ptrdiff_t>(std::min(stream.size(), at + 4096))));
    }
    // Depth pixels that are not what the shifts mean.
    int wrong(const Values& v, int factor) const {
        std::uint16_t table[kShifts];
        build_depth_table(sensor->geometry(), factor, table);
        const auto* z = reinterpret_cast<const std::uint16_t*>(sink.images.back().pixels.data());
        int n = 0;
        for (std::size_t i = 0; i < v.size(); ++i) n += z[i] != (v[i] < kShifts ? table[v[i]] : 0);
        return n;
    }
};

TEST(UsbSensor, EveryDepthFormatPixelByPixel) {
    for (const SensorFamily family : {SensorFamily::kinect, SensorFamily::primesense}) {
        const ModeList modes = family == SensorFamily::kinect ? kinect_modes(StreamKind::depth)
                                                              : primesense_modes(StreamKind::depth, false);
        for (int m = 0; m < modes.count; ++m) {
            const SensorMode& mode = modes.modes[m];
            Rig rig(family);
            std::snprintf(rig.options.depth_format, sizeof rig.options.depth_format, "%s",
                          wire_name(mode.format));
            rig.options.depth_width = mode.width, rig.options.depth_height = mode.height,
            rig.options.fps = mode.fps;
            ASSERT_TRUE(rig.open().ok());
            EXPECT_STREQ(rig.info.at(StreamKind::depth).format, wire_name(mode.format));
            ASSERT_TRUE(rig.sensor->start(&rig.sink).ok());
            EXPECT_EQ(rig.usb.params[18], mode.code);
            EXPECT_EQ(rig.usb.params[19], mode.resolution);
            EXPECT_EQ(rig.usb.params[20], mode.fps);
            EXPECT_EQ(rig.usb.params[6], 2);
            const int bits = mode.format == WireFormat::packed10   ? 10
                             : mode.format == WireFormat::packed11 ? 11
                                                                   : 12;
            for (int n = 0; n < 3; ++n) {
                const Values v = shifts(mode.width * mode.height, bits, 100 * n);
                rig.send(StreamKind::depth, wire_of(v, mode.format),
                         1000u + 2'000'000u * static_cast<unsigned>(n));
                ASSERT_TRUE(rig.sensor->pump(0).ok());
                ASSERT_EQ(rig.sink.images.size(), static_cast<std::size_t>(n) + 1) << wire_name(mode.format);
                const ImageStamp& stamp = rig.sink.images.back().stamp;
                EXPECT_FALSE(stamp.damaged) << wire_name(mode.format) << " " << mode.width;
                EXPECT_TRUE(stamp.has_device_time);
                EXPECT_EQ(stamp.sequence, static_cast<std::uint64_t>(n) + 1);
                EXPECT_EQ(rig.wrong(v, mode.fps == 60 ? 2 : 1), 0)
                    << wire_name(mode.format) << " " << mode.width << "x" << mode.height;
            }
            ASSERT_TRUE(rig.sensor->stop().ok());
            EXPECT_EQ(rig.usb.params[6], 0);
            EXPECT_EQ(rig.usb.opened, rig.usb.closed);
        }
    }
}

TEST(UsbSensor, PaddedRowsAreWithoutDepth) {
    Rig rig(SensorFamily::primesense);
    ASSERT_TRUE(rig.open().ok());
    ASSERT_TRUE(rig.sensor->start(&rig.sink).ok());
    Values v = shifts(640 * 480, 11, 5);
    const Values sent(v.begin() + 640 * 4, v.end() - 640 * 2);
    rig.send(StreamKind::depth, wire_of(sent, WireFormat::packed11), 1000, 640u * 4 << 16 | 640 * 2);
    ASSERT_TRUE(rig.sensor->pump(0).ok());
    ASSERT_EQ(rig.sink.images.size(), 1u);
    EXPECT_FALSE(rig.sink.images[0].stamp.damaged);
    std::fill(v.begin(), v.begin() + 640 * 4, 2047);
    std::fill(v.end() - 640 * 2, v.end(), 2047);
    EXPECT_EQ(rig.wrong(v, 1), 0);
}

TEST(UsbSensor, AstraIsTakenAsItComes) {
    Rig rig(SensorFamily::primesense, 0x2bc5, 0x0401);
    std::snprintf(rig.options.depth_format, sizeof rig.options.depth_format, "packed12");
    ASSERT_TRUE(rig.open().ok());
    ASSERT_TRUE(rig.sensor->start(&rig.sink).ok());
    const Values v = shifts(640 * 480, 11, 5);
    rig.send(StreamKind::depth, wire_of(v, WireFormat::packed11), 1000);
    ASSERT_TRUE(rig.sensor->pump(0).ok());
    ASSERT_EQ(rig.sink.images.size(), 1u);
    EXPECT_FALSE(rig.sink.images[0].stamp.damaged);
    EXPECT_EQ(rig.wrong(v, 1), 0);
    ASSERT_EQ(rig.sink.lines.size(), 1u);
    EXPECT_NE(rig.sink.lines[0].find("sends packed11"), std::string::npos);
    EXPECT_TRUE(find_sensor_model(0x2bc5, 0x0403) && !find_sensor_model(0x2bc5, 0x0403)->colour);
}

TEST(UsbSensor, DamageIsToldAndLossesAreCounted) {
    for (const SensorFamily family : {SensorFamily::kinect, SensorFamily::primesense}) {
        Rig rig(family);
        ASSERT_TRUE(rig.open().ok());
        ASSERT_TRUE(rig.sensor->start(&rig.sink).ok());
        const Values v = shifts(640 * 480, 11, 5);
        const Bytes wire = wire_of(v, WireFormat::packed11);
        std::uint32_t stamp = 0;
        const auto frame = [&](int drop) {
            rig.send(StreamKind::depth, wire, stamp += 2'000'000, 0, drop);
            ASSERT_TRUE(rig.sensor->pump(0).ok());
        };
        frame(-1), frame(7), frame(-1);
        rig.depth_id += 242 * 2 + 3;  // two frames and a bit never came
        stamp += 2 * 2'000'000;
        frame(-1), frame(-1);
        std::vector<std::uint64_t> sequences;
        for (const auto& i : rig.sink.images)
            if (!i.stamp.damaged) sequences.push_back(i.stamp.sequence);
        ASSERT_GE(sequences.size(), 3u);
        EXPECT_GE(rig.sink.damaged, 1);
        EXPECT_FALSE(rig.sink.lines.empty());
        EXPECT_NE(rig.sink.lines[0].find("packets were lost"), std::string::npos) << rig.sink.lines[0];
        EXPECT_EQ(sequences.back(), 7u) << (family == SensorFamily::kinect ? "kinect" : "primesense");
        EXPECT_EQ(rig.wrong(v, 1), 0);
    }
}

TEST(UsbSensor, KinectKeepsWhatCameOfADamagedFrame) {
    Rig rig(SensorFamily::kinect);
    ASSERT_TRUE(rig.open().ok());
    ASSERT_TRUE(rig.sensor->start(&rig.sink).ok());
    const Values v = shifts(640 * 480, 11, 5);
    rig.send(StreamKind::depth, wire_of(v, WireFormat::packed11), 1000, 0, 100);
    ASSERT_TRUE(rig.sensor->pump(0).ok());
    ASSERT_EQ(rig.sink.images.size(), 1u);
    EXPECT_TRUE(rig.sink.images[0].stamp.damaged);
    // One packet's pixels, and those that it shares with its neighbours.
    EXPECT_LE(rig.wrong(v, 1), 1748 * 8 / 11 + 2);
}

TEST(UsbSensor, EachFaultOfOpeningHasItsStatusAndLeavesNothing) {
    const struct {
        SensorFamily family;
        int opcode;
        ControlFault fault;
        Code code;
    } cases[] = {{SensorFamily::kinect, 4, ControlFault::silent, Code::timeout},
                 {SensorFamily::kinect, 4, ControlFault::wrong_tag, Code::format},
                 {SensorFamily::kinect, 22, ControlFault::wrong_size, Code::format},
                 {SensorFamily::primesense, 0, ControlFault::cut, Code::format},
                 {SensorFamily::primesense, 4, ControlFault::error_code, Code::unsupported},
                 {SensorFamily::primesense, 22, ControlFault::gone, Code::disconnected}};
    for (const auto& c : cases) {
        Rig rig(c.family);
        rig.usb.fault_opcode = c.opcode, rig.usb.fault = c.fault;
        const Status s = rig.open();
        EXPECT_EQ(static_cast<int>(s.code()), static_cast<int>(c.code)) << s.text();
        EXPECT_EQ(rig.usb.opened, rig.usb.closed);
    }
    for (const float bad : {0.f, -1.f, std::nanf(""), 1e30f})
        for (int i = 0; i < 4; ++i)
            for (const SensorFamily family : {SensorFamily::kinect, SensorFamily::primesense}) {
                Rig rig(family);
                rig.usb.lengths[i] = bad;
                if (i == 1 && bad == 0) continue;  // no colour camera beside it
                EXPECT_EQ(rig.open().code(), Code::format);
            }
    Rig old(SensorFamily::primesense);
    old.usb.firmware[1] = 4;
    EXPECT_EQ(old.open().code(), Code::unsupported);
    // A clock that cannot be is taken for the usual one, with a line.
    Rig clock(SensorFamily::primesense);
    clock.usb.mhz = -5;
    ASSERT_TRUE(clock.open().ok());
    ASSERT_TRUE(clock.sensor->start(&clock.sink).ok());
    ASSERT_EQ(clock.sink.lines.size(), 1u);
    EXPECT_NE(clock.sink.lines[0].find("-5 MHz"), std::string::npos);
}

TEST(UsbSensor, FaultsOfStartingCloseThePipes) {
    for (const ControlFault fault : {ControlFault::silent, ControlFault::error_code, ControlFault::gone}) {
        Rig rig(SensorFamily::kinect);
        ASSERT_TRUE(rig.open().ok());
        rig.usb.fault_opcode = 3, rig.usb.fault = fault;
        const Status s = rig.sensor->start(&rig.sink);
        EXPECT_FALSE(s.ok());
        EXPECT_EQ(rig.usb.opened, rig.usb.closed);
        EXPECT_TRUE(rig.sensor->stop().ok());
    }
    Rig rig(SensorFamily::kinect);
    ASSERT_TRUE(rig.open().ok());
    ASSERT_TRUE(rig.sensor->start(&rig.sink).ok());
    rig.usb.plugged = false;
    EXPECT_EQ(rig.sensor->pump(0).code(), Code::disconnected);
    EXPECT_TRUE(rig.sensor->stop().ok());
    EXPECT_EQ(rig.usb.opened, rig.usb.closed);
}

TEST(UsbSensor, ModesThatAreNotThereAreListed) {
    Rig rig(SensorFamily::kinect);
    rig.options.depth_width = 123, rig.options.depth_height = 45;
    const Status s = rig.open();
    EXPECT_EQ(s.code(), Code::unsupported);
    EXPECT_NE(std::strstr(s.text(), "packed11 640x480@30"), nullptr) << s.text();
    Rig both(SensorFamily::kinect);
    both.options.streams = stream_bit(StreamKind::colour) | stream_bit(StreamKind::infrared);
    EXPECT_EQ(both.open().code(), Code::unsupported);
}

TEST(UsbSensor, Infrared) {
    for (const SensorFamily family : {SensorFamily::kinect, SensorFamily::primesense}) {
        Rig rig(family);
        rig.options.streams = stream_bit(StreamKind::infrared);
        ASSERT_TRUE(rig.open().ok());
        ASSERT_TRUE(rig.sensor->start(&rig.sink).ok());
        EXPECT_EQ(rig.usb.params[5], 3);
        const Values v = shifts(640 * 488, 10, 9);
        rig.send(StreamKind::infrared, wire_of(v, WireFormat::packed10), 1000);
        ASSERT_TRUE(rig.sensor->pump(0).ok());
        ASSERT_EQ(rig.sink.images.size(), 1u);
        EXPECT_FALSE(rig.sink.images[0].stamp.damaged);
        EXPECT_EQ(std::memcmp(rig.sink.images[0].pixels.data(), v.data(), 640 * 480 * 2), 0);
    }
}

// PrimeSense's compression of colour bytes, from its description in frame_decoder.h.
Bytes compress_colour(const Bytes& plain, int row, bool yuv) {
    std::vector<int> nibbles;
    for (std::size_t i = 0; i < plain.size(); ++i) {
        const int column = static_cast<int>(i) % row;
        const int back = yuv ? (column % 2 ? 2 : 4) : 2;
        const int last = column >= back ? plain[i - static_cast<std::size_t>(back)] : 0, d = plain[i] - last;
        if (d >= -6 && d <= 6)
            nibbles.push_back(d + 6);
        else
            nibbles.insert(nibbles.end(), {15, plain[i] >> 4, plain[i] & 15});
        if (i % 97 == 0) nibbles.push_back(13);  // stands for nothing
    }
    if (nibbles.size() % 2) nibbles.push_back(13);
    Bytes out;
    for (std::size_t i = 0; i < nibbles.size(); i += 2)
        out.push_back(static_cast<std::uint8_t>(nibbles[i] << 4 | nibbles[i + 1]));
    return out;
}

TEST(UsbSensor, ColourOfEachFormat) {
    const struct {
        const char* name;
        int code;
        bool yuv, compressed, swapped;
    } formats[] = {{"UYVY", 5, true, false, true},
                   {"YUYV", 7, true, false, false},
                   {"ps-yuv", 1, true, true, true},
                   {"GRBG", 6, false, false, false},
                   {"ps-GRBG", 0, false, true, false}};
    Bytes mosaics[2];
    int mosaic_count = 0;
    for (const auto& f : formats) {
        Rig rig(SensorFamily::primesense);
        for (const int word : {f.code, 0, 30, f.code, 1, 30, 2, 1, 30, f.code, 1, 0}) {
            rig.usb.presets.push_back(static_cast<std::uint8_t>(word));
            rig.usb.presets.push_back(0);
        }
        rig.options.streams = stream_bit(StreamKind::colour);
        ASSERT_TRUE(rig.open().ok());
        const StreamInfo& info = rig.info.at(StreamKind::colour);
        EXPECT_STREQ(info.format, f.name);
        EXPECT_EQ(info.width, 640);
        ASSERT_TRUE(rig.sensor->start(&rig.sink).ok());
        EXPECT_EQ(rig.usb.params[12], f.code);
        EXPECT_EQ(rig.usb.params[5], 1);
        const int row = f.yuv ? 1280 : 640;
        Bytes plain(static_cast<std::size_t>(row) * 480);
        for (std::size_t i = 0; i < plain.size(); ++i)
            plain[i] = static_cast<std::uint8_t>((i / 50) % 3 ? i / 7 : i * 2654435761u >> 13);
        const Bytes wire = f.compressed ? compress_colour(plain, row, f.yuv) : plain;
        rig.send(StreamKind::colour, wire, 1000);
        ASSERT_TRUE(rig.sensor->pump(0).ok());
        ASSERT_EQ(rig.sink.images.size(), 1u) << f.name;
        EXPECT_FALSE(rig.sink.images[0].stamp.damaged) << f.name;
        const Bytes& image = rig.sink.images[0].pixels;
        if (f.yuv) {
            int wrong = 0;
            for (std::size_t i = 0; i < plain.size(); ++i) wrong += image[f.swapped ? i ^ 1 : i] != plain[i];
            EXPECT_EQ(wrong, 0) << f.name;
        } else {
            EXPECT_EQ(info.colour_format, PixelFormat::rgb8);
            // A pixel keeps its own colour: green, red over blue, green.
            for (const std::size_t y : {0u, 100u, 478u})
                for (const std::size_t x : {0u, 200u, 638u}) {
                    EXPECT_EQ(image[3 * (y * 640 + x) + 1], plain[y * 640 + x]);
                    EXPECT_EQ(image[3 * (y * 640 + x + 1)], plain[y * 640 + x + 1]);
                    EXPECT_EQ(image[3 * ((y + 1) * 640 + x) + 2], plain[(y + 1) * 640 + x]);
                }
            mosaics[mosaic_count++] = image;
        }
        // Cut short, it is damaged, and what is missing is black.
        rig.send(StreamKind::colour,
                 Bytes(wire.begin(), wire.begin() + static_cast<std::ptrdiff_t>(wire.size() / 2)), 2'000'000);
        ASSERT_TRUE(rig.sensor->pump(0).ok());
        EXPECT_TRUE(rig.sink.images[1].stamp.damaged) << f.name;
    }
    EXPECT_EQ(mosaics[0], mosaics[1]);
}

#ifdef BURIN_COUNT_ALLOCATIONS
TEST(UsbSensor, NothingIsAllocatedWhileStreaming) {
    for (const SensorFamily family : {SensorFamily::kinect, SensorFamily::primesense}) {
        Rig rig(family);
        ASSERT_TRUE(rig.open().ok());
        ASSERT_TRUE(rig.sensor->start(&rig.sink).ok());
        rig.sink.keep = false;
        const Bytes wire = wire_of(shifts(640 * 480, 11, 5), WireFormat::packed11);
        long during = 0;
        for (int n = 0; n < 20; ++n) {
            rig.send(StreamKind::depth, wire, static_cast<std::uint32_t>(n) * 2'000'000, 0,
                     n % 3 == 0 ? 11 : -1);
            auto queued = std::move(rig.usb.to_send);
            rig.usb.to_send = queued;  // the script's own memory is made here
            const long before = allocations;
            ASSERT_TRUE(rig.sensor->pump(0).ok());
            during += allocations - before;
        }
        EXPECT_EQ(during, 0);
        EXPECT_EQ(rig.sink.committed, 20);
    }
}
#endif

TEST(UsbSensor, TenThousandTimesOpenedAndClosedWithoutALeak) {
    std::size_t after_some = 0;
    for (int n = 0; n < 10'000; ++n) {
        if (n == 100) after_some = mallinfo2().uordblks;
        const SensorFamily family = n % 2 ? SensorFamily::kinect : SensorFamily::primesense;
        Rig rig(family);
        ASSERT_TRUE(rig.open().ok());
        ASSERT_TRUE(rig.sensor->start(&rig.sink).ok());
        ASSERT_TRUE(rig.sensor->pump(0).ok());
        ASSERT_TRUE(rig.sensor->stop().ok());
        ASSERT_EQ(rig.usb.opened, rig.usb.closed);
    }
    EXPECT_LE(mallinfo2().uordblks, after_some + 64 * 1024);
}

TEST(UsbSensor, Controls) {
    Rig rig(SensorFamily::kinect);
    rig.options.streams = stream_bit(StreamKind::depth) | stream_bit(StreamKind::colour);
    ASSERT_TRUE(rig.open().ok());
    ASSERT_TRUE(rig.sensor->start(&rig.sink).ok());
    ControlRange range;
    ASSERT_TRUE(rig.sensor->set(SourceControl::mirror, 1).ok());
    EXPECT_EQ(rig.usb.params[23], 1);
    EXPECT_EQ(rig.usb.params[71], 1);
    ASSERT_TRUE(rig.sensor->get(SourceControl::mirror, &range).ok());
    EXPECT_EQ(range.value, 1);
    ASSERT_TRUE(rig.sensor->set(SourceControl::colour_auto_exposure, 1).ok());
    ASSERT_TRUE(rig.sensor->get(SourceControl::colour_auto_exposure, &range).ok());
    EXPECT_EQ(range.value, 1);
    ASSERT_TRUE(rig.sensor->set(SourceControl::colour_exposure_us, 10'000).ok());
    ASSERT_TRUE(rig.sensor->get(SourceControl::colour_exposure_us, &range).ok());
    EXPECT_NEAR(range.value, 10'000, 28);
    EXPECT_EQ(rig.sensor->set(SourceControl::colour_exposure_us, 1e6).code(), Code::invalid_argument);
    EXPECT_EQ(rig.sensor->set(SourceControl::mirror, 0.5).code(), Code::invalid_argument);
    EXPECT_EQ(rig.sensor->set(SourceControl::laser_power_mw, 1).code(), Code::unsupported);

    Rig xtion(SensorFamily::primesense);
    ASSERT_TRUE(xtion.open().ok());
    ASSERT_TRUE(xtion.sensor->set(SourceControl::close_range, 1).ok());
    EXPECT_EQ(xtion.usb.params[84], 1);
    ASSERT_TRUE(xtion.sensor->set(SourceControl::emitter, 0).ok());
    ASSERT_TRUE(xtion.sensor->get(SourceControl::emitter, &range).ok());
    EXPECT_EQ(range.value, 0);
}

TEST(UsbSensor, DepthAsTheColourCameraSeesIt) {
    Rig rig(SensorFamily::kinect);
    rig.wishes.registered = true;
    rig.options.streams = stream_bit(StreamKind::depth) | stream_bit(StreamKind::colour);
    // A table of nothing but a shift by 40 pixels: dx_start, word 5, holds it in 1/2^17 pixel times 16, from
    // bit 13 on.
    const auto put = [&](int word, std::int32_t value) {
        put_le16(&rig.usb.registration[static_cast<std::size_t>(4 * word)],
                 static_cast<unsigned>(value) & 0xffff);
        put_le16(&rig.usb.registration[static_cast<std::size_t>(4 * word + 2)],
                 static_cast<unsigned>(value) >> 16 & 0xffff);
    };
    put(5, (40 << 17) * 16 >> 13);
    ASSERT_TRUE(rig.open().ok());
    const StreamInfo &depth = rig.info.at(StreamKind::depth), &colour = rig.info.at(StreamKind::colour);
    EXPECT_TRUE(colour.calibrated);
    EXPECT_NEAR(depth.camera.cx, colour.camera.cx, 1e-9);
    EXPECT_EQ(colour.T_stream_depth.t.x, 0);
    ASSERT_TRUE(rig.sensor->start(&rig.sink).ok());
    Values v(640 * 480, 2047);
    v[200 * 640 + 300] = 800;
    rig.send(StreamKind::depth, wire_of(v, WireFormat::packed11), 1000);
    ASSERT_TRUE(rig.sensor->pump(0).ok());
    const auto* z = reinterpret_cast<const std::uint16_t*>(rig.sink.images.back().pixels.data());
    const int mm = shift_depth_mm(rig.sensor->geometry(), 1, 800);
    int found = 0;
    for (int i = 0; i < 640 * 480; ++i) found += z[i] != 0;
    EXPECT_EQ(found, 1);
    // 40 pixels of the table, one of the window, and next to nothing of the baseline at 1.19 m.
    EXPECT_EQ(z[201 * 640 + 341], mm);

    Rig empty(SensorFamily::kinect);
    empty.wishes.registered = true;
    const Status s = empty.open();
    EXPECT_EQ(s.code(), Code::unsupported);
    EXPECT_NE(std::strstr(s.text(), "empty registration table"), nullptr) << s.text();
}

TEST(UsbAddress, Forms) {
    UsbAddress a;
    ASSERT_TRUE(parse_usb_address("", &a).ok());
    EXPECT_EQ(a.vendor, -1);
    ASSERT_TRUE(parse_usb_address("1d27:0601@1-2.3,iso,registered", &a).ok());
    EXPECT_EQ(a.vendor, 0x1d27);
    EXPECT_EQ(a.product, 0x0601);
    EXPECT_STREQ(a.place, "1-2.3");
    EXPECT_TRUE(a.wishes.isochronous && a.wishes.registered && !a.wishes.accelerometer);
    ASSERT_TRUE(parse_usb_address("@2-1,accelerometer", &a).ok());
    EXPECT_TRUE(a.wishes.accelerometer);
    for (const char* bad :
         {"1d27", "1d27:06", "1D27:0601", "1d27:0601@", "@a", ",fast", "1d27:0601x", "@1-1,"})
        EXPECT_EQ(parse_usb_address(bad, &a).code(), Code::invalid_argument) << bad;
}

TEST(UsbSensor, Accelerometer) {
    Vec3d a;
    const std::uint8_t reply[10] = {0, 0, 0, 0, 0x03, 0x33, 0xff, 0x00, 0, 0};
    ASSERT_TRUE(parse_accelerometer(reply, 10, &a));
    EXPECT_DOUBLE_EQ(a.x, 0);
    EXPECT_DOUBLE_EQ(a.y, 9.80665);
    EXPECT_NEAR(a.z, -256 / 819.0 * 9.80665, 1e-12);
    EXPECT_FALSE(parse_accelerometer(reply, 9, &a));
}

}  // namespace
