// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "capture/crc32.h"
#include "capture/depth_codec.h"
#include "capture/jpeg_codec.h"
#include "capture/recording_images.h"
#include "emulated.h"
#include "scene_helpers.h"

namespace burin {
namespace {

TEST(Crc32, IsThatOfZlib) {
    EXPECT_EQ(crc32("123456789", 9), 0xcbf43926u) << "the check value of the standard";
    EXPECT_EQ(crc32("", 0), 0u);
    std::vector<std::uint8_t> bytes(1000);
    Rng rng(1);
    for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(rng.next());
    // Bit by bit, by the definition.
    std::uint32_t slow = ~0u;
    for (const std::uint8_t b : bytes) {
        slow ^= b;
        for (int i = 0; i < 8; ++i) slow = (slow >> 1) ^ ((slow & 1) ? 0xedb88320u : 0);
    }
    EXPECT_EQ(crc32(bytes.data(), bytes.size()), ~slow);
    for (const std::size_t cut : {1u, 7u, 8u, 500u, 999u})
        EXPECT_EQ(crc32(bytes.data() + cut, bytes.size() - cut, crc32(bytes.data(), cut)), ~slow);
}

struct Depth {
    int width, height;
    std::size_t stride;
    std::vector<std::uint8_t> rows;

    Depth(int w, int h, std::size_t row_stride) : width(w), height(h), stride(row_stride) {
        rows.assign(stride * static_cast<std::size_t>(h), 0xee);
    }
    void set(int x, int y, std::uint16_t v) {
        std::memcpy(rows.data() + static_cast<std::size_t>(y) * stride + 2 * static_cast<std::size_t>(x), &v,
                    2);
    }
    std::uint16_t get(int x, int y) const {
        std::uint16_t v;
        std::memcpy(&v, rows.data() + static_cast<std::size_t>(y) * stride + 2 * static_cast<std::size_t>(x),
                    2);
        return v;
    }
};

template <class Value>
Depth drawn(int width, int height, std::size_t stride, Value value) {
    Depth depth(width, height, stride);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) depth.set(x, y, value(x, y));
    return depth;
}

std::vector<Depth> depths() {
    Rng rng(2);
    std::vector<Depth> all;
    for (const auto& [w, h] : {std::pair(1, 1), {7, 1}, {8, 3}, {9, 5}, {64, 48}, {333, 77}}) {
        const auto packed = 2 * static_cast<std::size_t>(w);
        all.push_back(drawn(w, h, packed, [&](int, int) { return std::uint16_t{0}; }));
        all.push_back(drawn(w, h, packed, [&](int, int) { return std::uint16_t{65535}; }));
        all.push_back(
            drawn(w, h, packed + 6, [&](int, int) { return static_cast<std::uint16_t>(rng.next()); }));
        all.push_back(
            drawn(w, h, packed, [&](int x, int y) { return static_cast<std::uint16_t>(x + y * w); }));
        all.push_back(drawn(w, h, packed + 2, [&](int x, int) {
            return static_cast<std::uint16_t>(rng.below(3) == 0 ? 0 : (x & 1 ? 65535 : 1));
        }));
    }
    // Every value there is.
    all.push_back(
        drawn(256, 256, 512, [&](int x, int y) { return static_cast<std::uint16_t>(x * 256 + y); }));
    return all;
}

TEST(DepthCodec, GivesBackEveryImage) {
    PixelEncoder encoder;
    PixelDecoder decoder;
    ASSERT_TRUE(encoder.reserve(65536, 0).ok());
    ASSERT_TRUE(decoder.reserve(65536, 0).ok());
    std::vector<std::uint8_t> coded(encoder.bound());
    for (const Depth& d : depths()) {
        const std::size_t bytes =
            encoder.encode_depth(d.rows.data(), d.stride, d.width, d.height, coded.data());
        ASSERT_GT(bytes, 0u);
        const std::size_t pixels = static_cast<std::size_t>(d.width) * static_cast<std::size_t>(d.height);
        std::vector<std::uint16_t> out(pixels, 12345);
        const char* reason = "";
        ASSERT_TRUE(decoder.decode_depth(coded.data(), bytes, pixels, out.data(), &reason)) << reason;
        for (int y = 0; y < d.height; ++y)
            for (int x = 0; x < d.width; ++x)
                ASSERT_EQ(out[static_cast<std::size_t>(y * d.width + x)], d.get(x, y)) << x << ' ' << y;
    }
}

TEST(DepthCodec, RefusesWhatIsNoImageOfTheSize) {
    PixelEncoder encoder;
    PixelDecoder decoder;
    ASSERT_TRUE(encoder.reserve(4096, 0).ok());
    ASSERT_TRUE(decoder.reserve(4096, 0).ok());
    Rng rng(3);
    const Depth d = drawn(
        40, 30, 80, [&](int x, int) { return static_cast<std::uint16_t>(rng.below(4) == 0 ? 0 : 900 + x); });
    std::vector<std::uint8_t> coded(encoder.bound());
    const std::size_t bytes = encoder.encode_depth(d.rows.data(), d.stride, 40, 30, coded.data());
    std::vector<std::uint16_t> out(4096);
    const char* reason = "";
    for (std::size_t cut = 0; cut < bytes; ++cut) {
        std::vector<std::uint8_t> part(coded.begin(), coded.begin() + static_cast<std::ptrdiff_t>(cut));
        ASSERT_FALSE(decoder.decode_depth(part.data(), part.size(), 1200, out.data(), &reason)) << cut;
    }
    EXPECT_FALSE(decoder.decode_depth(coded.data(), bytes, 1199, out.data(), &reason));
    EXPECT_FALSE(decoder.decode_depth(coded.data(), bytes, 1208, out.data(), &reason));
    // The plain bytes themselves lie: through encode_bytes anything can be put into the zstd frame.
    const std::uint32_t lies[][2] = {{1, 1200}, {65536, 0}, {0, 1}, {0xffffffff, 0xffffffff}, {2, 3}};
    for (const auto& lie : lies) {
        std::vector<std::uint8_t> plain(8 + 4 + 150 + 6);
        std::memcpy(plain.data(), lie, 8);
        plain[8] = 5;  // values 5 and 6
        plain[10] = 1;
        plain[12] = 0xff;  // more pixels than values
        PixelEncoder liar;
        ASSERT_TRUE(liar.reserve(0, plain.size()).ok());
        std::vector<std::uint8_t> frame(liar.bound());
        const std::size_t n = liar.encode_bytes(plain.data(), plain.size(), plain.size(), frame.data());
        ASSERT_FALSE(decoder.decode_depth(frame.data(), n, 1200, out.data(), &reason)) << lie[0];
    }
}

TEST(BytesCodec, GivesBackEveryImage) {
    PixelEncoder encoder;
    PixelDecoder decoder;
    ASSERT_TRUE(encoder.reserve(0, 5000).ok());
    ASSERT_TRUE(decoder.reserve(0, 5000).ok());
    std::vector<std::uint8_t> coded(encoder.bound());
    Rng rng(4);
    for (const std::size_t count : {1u, 2u, 3u, 5000u})
        for (const std::size_t step : {1u, 3u, 4u}) {
            std::vector<std::uint8_t> bytes(count), out(count);
            for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(rng.next());
            const std::size_t n = encoder.encode_bytes(bytes.data(), count, step, coded.data());
            ASSERT_GT(n, 0u);
            const char* reason = "";
            ASSERT_TRUE(decoder.decode_bytes(coded.data(), n, count, step, out.data(), &reason)) << reason;
            ASSERT_EQ(bytes, out);
            ASSERT_FALSE(decoder.decode_bytes(coded.data(), n, count + 1, step, out.data(), &reason));
            ASSERT_FALSE(decoder.decode_bytes(coded.data(), n, count, 0, out.data(), &reason));
        }
}

// Colours that change slowly, in each format the same: what JPEG keeps nearly as it is.
std::vector<std::uint8_t> smooth(const StreamInfo& s) {
    std::vector<std::uint8_t> image(s.image_bytes);
    for (int y = 0; y < s.height; ++y)
        for (std::size_t i = 0; i < s.row_bytes; ++i)
            image[static_cast<std::size_t>(y) * s.row_bytes + i] =
                s.colour_format == PixelFormat::yuyv && i % 2 == 1 ? 118 : static_cast<std::uint8_t>(60 + y);
    for (std::size_t i = s.row_bytes * static_cast<std::size_t>(s.height); i < image.size(); ++i)
        image[i] = i % 2 ? 118 : 140;
    return image;
}

TEST(JpegCodec, EveryFormatBecomesItsColours) {
    for (int f = 0; f <= static_cast<int>(PixelFormat::nv21); ++f)
        for (const int width : {32, 33}) {
            DeviceInfo info;
            StreamInfo& s = info.at(StreamKind::colour);
            s.kind = StreamKind::colour;
            s.pixels = StreamPixels::colour;
            s.colour_format = static_cast<PixelFormat>(f);
            s.width = width;
            s.height = 19;
            set_image_bytes(&s);
            const std::vector<std::uint8_t> image = smooth(s);
            ImageEncoder encoder;
            ImageDecoder decoder;
            ASSERT_TRUE(encoder.reserve(info, RecordedColour::jpeg, 95).ok());
            ASSERT_TRUE(decoder.reserve(info).ok());
            std::vector<std::uint8_t> coded(encoder.bound());
            RecordHead head;
            const std::size_t bytes =
                encoder.encode(s, image.data(), coded.data(), &head.codec, &head.parameter);
            ASSERT_EQ(head.codec, ImageCodec::jpeg);
            const StreamInfo out = decoded_stream(s, head.codec);
            std::vector<std::uint8_t> decoded(out.image_bytes), expected(3 * static_cast<std::size_t>(width));
            const Status got = decoder.decode(s, head, coded.data(), bytes, "it", decoded.data());
            ASSERT_TRUE(got.ok()) << got.text();
            for (int y = 0; y < s.height; ++y) {
                row_to_rgb(packed_colour(s, image.data()), y, expected.data());
                for (std::size_t i = 0; i < expected.size(); ++i) {
                    const bool grey = out.colour_format == PixelFormat::grey8;
                    const std::size_t at = static_cast<std::size_t>(y) * out.row_bytes + (grey ? i / 3 : i);
                    ASSERT_NEAR(decoded[at], expected[i], 6)
                        << "format " << f << " row " << y << " byte " << i;
                }
            }
            for (std::size_t cut = 0; cut < bytes; cut += 7)
                ASSERT_FALSE(decoder.decode(s, head, coded.data(), cut, "it", decoded.data()).ok()) << cut;
            StreamInfo other = s;
            other.width -= 2;
            set_image_bytes(&other);
            const Status wrong = decoder.decode(other, head, coded.data(), bytes, "it", decoded.data());
            EXPECT_EQ(wrong.code(), Code::format);
            EXPECT_NE(std::string(wrong.text()).find("x19, expected"), std::string::npos) << wrong.text();
        }
}

TEST(JpegCodec, WithTooLittleRoomThereIsNone) {
    JpegEncoder encoder;
    ASSERT_TRUE(encoder.reserve(64).ok());
    Rng rng(5);
    std::vector<std::uint8_t> noise(3 * 64 * 64), out(65536);
    for (std::uint8_t& b : noise) b = static_cast<std::uint8_t>(rng.next());
    const ColourRows image = {PixelFormat::rgb8, 64, 64, noise.data(), 3 * 64, nullptr, 0};
    const std::size_t bytes = encoder.encode(image, 100, out.data(), out.size());
    ASSERT_GT(bytes, 1000u);
    for (const std::size_t room : {std::size_t{0}, std::size_t{1}, std::size_t{700}, bytes - 1})
        EXPECT_EQ(encoder.encode(image, 100, out.data(), room), 0u) << room;
    EXPECT_EQ(encoder.encode(image, 100, out.data(), bytes + 1), bytes) << "and goes on after that";
}

// Noise at quality 100 is larger than the pixels: it is written without loss instead.
TEST(JpegCodec, WhatGrowsIsWrittenOtherwise) {
    DeviceInfo info;
    StreamInfo& s = info.at(StreamKind::colour);
    s.kind = StreamKind::colour;
    s.pixels = StreamPixels::colour;
    s.colour_format = PixelFormat::yuyv;
    s.width = s.height = 512;
    set_image_bytes(&s);
    Rng rng(6);
    std::vector<std::uint8_t> noise(s.image_bytes), out(s.image_bytes);
    for (std::uint8_t& b : noise) b = static_cast<std::uint8_t>(rng.next());
    ImageEncoder encoder;
    ImageDecoder decoder;
    ASSERT_TRUE(encoder.reserve(info, RecordedColour::jpeg, 100).ok());
    ASSERT_TRUE(decoder.reserve(info).ok());
    std::vector<std::uint8_t> coded(encoder.bound());
    RecordHead head;
    const std::size_t bytes = encoder.encode(s, noise.data(), coded.data(), &head.codec, &head.parameter);
    ASSERT_EQ(head.codec, ImageCodec::raw);
    ASSERT_TRUE(decoder.decode(s, head, coded.data(), bytes, "it", out.data()).ok());
    EXPECT_EQ(noise, out);
}

}  // namespace
}  // namespace burin
