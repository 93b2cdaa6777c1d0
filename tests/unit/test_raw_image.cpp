// SPDX-License-Identifier: MIT
// Whole images out of raw bytes: rows with gaps, runs of bits whose rows begin inside a byte, bytes that end
// early; Bayer mosaics; PrimeSense's compressed depth.
#include "capture/raw_image.h"

#include <gtest/gtest.h>

#include <memory>

#include "capture/demosaic.h"
#include "capture/ps_compressed.h"
#include "scene_helpers.h"

namespace burin {
namespace {

using simd::Packing;

constexpr Packing kAll[simd::kPackings] = {Packing::u8,    Packing::le16,  Packing::be16,   Packing::msb10,
                                           Packing::msb11, Packing::msb12, Packing::mipi10, Packing::mipi12};

std::vector<std::uint8_t> random_bytes(Rng& rng, std::size_t count) {
    std::vector<std::uint8_t> bytes(count);
    bytes.shrink_to_fit();
    for (auto& b : bytes) b = static_cast<std::uint8_t>(rng.below(256));
    return bytes;
}

TEST(RawImage, RowsStridesAndTheirEnd) {
    Rng rng(300);
    for (int round = 0; round < 2000; ++round) {
        const Packing p = kAll[round % simd::kPackings];
        const int width = 1 + rng.below(40), height = 1 + rng.below(8), gap = rng.below(2) * rng.below(5);
        const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
        const bool run = rng.below(2) == 0;
        const std::size_t tight = simd::packed_bytes(p, w),
                          stride = tight + static_cast<std::size_t>(rng.below(4));
        // A run of bits has no rows; with whole groups each row is padded to one.
        const bool one_run = run && !simd::packed_group(p).whole;
        const std::size_t whole = one_run ? simd::packed_bytes(p, w * h) : (run ? tight : stride) * h;
        const auto bytes = static_cast<std::size_t>(rng.below(3) ? static_cast<int>(whole)
                                                                 : rng.below(static_cast<int>(whole) + 1));
        const auto in = random_bytes(rng, bytes);
        std::vector<std::uint16_t> table(65536);
        for (auto& t : table) t = static_cast<std::uint16_t>(rng.below(65536));
        const DepthTable depth = rng.below(2) ? DepthTable{table.data(), 65536} : DepthTable{};
        std::vector<std::uint16_t> out((w + static_cast<std::size_t>(gap)) * h, 7);
        const std::size_t found = unpack_image(p, {in.data(), bytes, run ? 0 : stride}, depth,
                                               {out.data(), width, height, width + gap});
        std::size_t expected_found = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width + gap; ++x) {
                const std::uint16_t got = out[static_cast<std::size_t>(y * (width + gap) + x)];
                if (x >= width) {
                    ASSERT_EQ(got, 7);  // between rows: not ours
                    continue;
                }
                // Pixel by pixel from its own row or run.
                const std::size_t start = one_run ? 0 : static_cast<std::size_t>(y) * (run ? tight : stride);
                const auto index =
                    static_cast<std::size_t>(x) + (one_run ? static_cast<std::size_t>(y) * w : 0);
                std::vector<std::uint16_t> up_to(index + 1);
                const std::size_t rest = start < bytes ? bytes - start : 0;
                const int n = rest == 0 ? 0
                                        : simd::scalar::unpack(p, in.data() + start, rest,
                                                               static_cast<int>(index) + 1, up_to.data());
                const bool there = n == static_cast<int>(index) + 1;
                expected_found += there;
                const std::uint16_t reading = up_to[index];
                ASSERT_EQ(got, !there         ? 0
                               : depth.values ? table[reading]
                                              : reading)
                    << "packing " << static_cast<int>(p) << " at " << x << " " << y << " of " << width << "x"
                    << height;
            }
        ASSERT_EQ(found, expected_found);
    }
}

TEST(RawImage, SplitsPlanesAndPairs) {
    Rng rng(301);
    constexpr int kWidth = 13, kHeight = 5, kPixels = kWidth * kHeight;
    for (int cut = 0; cut < 60; ++cut) {
        auto in = random_bytes(rng, 4 * kPixels);
        std::vector<std::uint16_t> a(kPixels, 7), b(kPixels, 7);
        const std::size_t size = in.size() - static_cast<std::size_t>(cut);
        const View<std::uint16_t> av{a.data(), kWidth, kHeight, kWidth},
            bv{b.data(), kWidth, kHeight, kWidth};
        EXPECT_EQ(unpack_inzi({in.data(), size, 0}, av, bv),
                  static_cast<std::size_t>(kPixels - (cut + 1) / 2));
        for (std::size_t i = 0; i < kPixels; ++i) {
            EXPECT_EQ(a[i], in[2 * i] | in[2 * i + 1] << 8);
            const std::size_t at = 2 * kPixels + 2 * i;
            EXPECT_EQ(b[i], at + 1 < size ? in[at] | in[at + 1] << 8 : 0);
        }
        EXPECT_EQ(unpack_y16i({in.data(), size, 0}, av, bv), (size) / 4);
        EXPECT_EQ(unpack_y12i({in.data(), 3 * kPixels - static_cast<std::size_t>(cut), 0}, av, bv),
                  (3 * kPixels - static_cast<std::size_t>(cut)) / 3);
        std::vector<std::uint8_t> left(kPixels, 7), right(kPixels, 7);
        EXPECT_EQ(unpack_y8i({in.data(), 2 * kPixels - static_cast<std::size_t>(cut), 0},
                             {left.data(), kWidth, kHeight, kWidth}, {right.data(), kWidth, kHeight, kWidth}),
                  static_cast<std::size_t>(kPixels - (cut + 1) / 2));
        EXPECT_EQ(left[3], in[6]);
        EXPECT_EQ(right[3], in[7]);
        EXPECT_EQ(unpack_confidence({in.data(), 7 * kHeight, 0}, {left.data(), kWidth, kHeight, kWidth}),
                  static_cast<std::size_t>(kPixels));
        EXPECT_EQ(left[kWidth], in[7] & 15);  // rows begin at whole bytes
        std::vector<std::uint8_t> rgb(3 * kPixels, 7);
        EXPECT_EQ(unpack_yuv422(simd::Yuv422::yuyv, {in.data(), 28 * kHeight, 0},
                                {rgb.data(), kWidth, kHeight, 3 * kWidth, 3}),
                  static_cast<std::size_t>(kPixels - kHeight * 0));
    }
}

TEST(Demosaic, EveryOrderAndPackingOfAPlainColour) {
    const auto demosaic = std::make_unique<Demosaic>();
    constexpr int kSites[4][2][2] = {{{0, 1}, {1, 2}}, {{1, 0}, {2, 1}}, {{1, 2}, {0, 1}}, {{2, 1}, {1, 0}}};
    constexpr int kColour[3] = {200, 90, 30};
    for (int order = 0; order < 4; ++order)
        for (const auto& [packing, bits] : {std::pair{Packing::u8, 8},
                                            {Packing::le16, 10},
                                            {Packing::le16, 12},
                                            {Packing::le16, 16},
                                            {Packing::be16, 16},
                                            {Packing::mipi10, 10},
                                            {Packing::mipi12, 12},
                                            {Packing::msb12, 12}})
            for (int width = 2; width < 24; width += 1)
                for (int height = 2; height < 6; ++height) {
                    // Packed by setting what unpack() finds there, bit by bit.
                    const std::size_t row = simd::packed_bytes(packing, static_cast<std::size_t>(width));
                    std::vector<std::uint8_t> raw(row * static_cast<std::size_t>(height));
                    for (int y = 0; y < height; ++y)
                        for (int x = 0; x < width; ++x) {
                            const int v = kColour[kSites[order][y & 1][x & 1]] << (bits - 8);
                            std::uint8_t* at = raw.data() + static_cast<std::size_t>(y) * row;
                            if (packing == Packing::u8) at[x] = static_cast<std::uint8_t>(v);
                            if (packing == Packing::le16)
                                at[2 * x] = static_cast<std::uint8_t>(v),
                                       at[2 * x + 1] = static_cast<std::uint8_t>(v >> 8);
                            if (packing == Packing::be16)
                                at[2 * x + 1] = static_cast<std::uint8_t>(v),
                                           at[2 * x] = static_cast<std::uint8_t>(v >> 8);
                            if (packing == Packing::mipi10)
                                at[x / 4 * 5 + x % 4] = static_cast<std::uint8_t>(v >> 2);
                            if (packing == Packing::mipi12)
                                at[x / 2 * 3 + x % 2] = static_cast<std::uint8_t>(v >> 4);
                            if (packing == Packing::msb12)
                                for (int b = 0; b < 12; ++b)
                                    if (v >> (11 - b) & 1)
                                        at[(12 * x + b) / 8] |=
                                            static_cast<std::uint8_t>(128 >> (12 * x + b) % 8);
                        }
                    std::vector<std::uint8_t> rgb(static_cast<std::size_t>(3 * width * height), 7);
                    const std::size_t found =
                        demosaic->run({static_cast<BayerOrder>(order), packing, bits},
                                      {raw.data(), raw.size(), 0}, {rgb.data(), width, height, 3 * width, 3});
                    ASSERT_EQ(found, static_cast<std::size_t>(width * height));
                    for (std::size_t i = 0; i < rgb.size(); ++i)
                        ASSERT_EQ(rgb[i], kColour[i % 3])
                            << order << " " << width << "x" << height << " at " << i;
                }
}

TEST(Demosaic, MissingRowsAreBlack) {
    const auto demosaic = std::make_unique<Demosaic>();
    const std::vector<std::uint8_t> raw(8 * 6, 250);
    std::vector<std::uint8_t> rgb(3 * 64, 7);
    EXPECT_EQ(demosaic->run({}, {raw.data(), raw.size(), 0}, {rgb.data(), 8, 8, 24, 3}), 48u);
    for (std::size_t i = 0; i < 24; ++i) EXPECT_EQ(rgb[i], 250);
    // Row 7 is two rows from what there is only along its mirror image.
    for (std::size_t i = 7 * 24; i < 8 * 24; ++i) EXPECT_LT(rgb[i], 80);
    std::vector<std::uint8_t> one(3, 7);  // a single pixel must not hang
    EXPECT_EQ(demosaic->run({}, {raw.data(), 1, 0}, {one.data(), 1, 1, 3, 3}), 1u);
}

// An encoder of the document's code, choosing among what is allowed.
struct Nibbles {
    std::vector<std::uint8_t> bytes;
    bool half = false;
    void put(unsigned n) {
        if (half)
            bytes.back() = static_cast<std::uint8_t>(bytes.back() | n);
        else
            bytes.push_back(static_cast<std::uint8_t>(n << 4));
        half = !half;
    }
    void encode(const std::vector<std::uint16_t>& frame, Rng& rng) {
        int last = 0;
        for (std::size_t i = 0; i < frame.size();) {
            std::size_t run = 0;
            while (i + run < frame.size() && run < 16 && frame[i + run] == last) ++run;
            const int d = frame[i] - last;
            if (run > 0 && rng.below(4)) {
                put(0xe), put(static_cast<unsigned>(run - 1));
                i += run;
                continue;
            }
            if (d >= -6 && d <= 6 && rng.below(8)) {
                put(static_cast<unsigned>(d + 6));
            } else if (d >= -64 && d <= 63 && rng.below(8)) {
                put(0xf), put(8u | static_cast<unsigned>(d + 64) >> 4),
                    put(static_cast<unsigned>(d + 64) & 15);
            } else {
                put(0xf);
                for (int s = 12; s >= 0; s -= 4) put(static_cast<unsigned>(frame[i] >> s & 15));
            }
            if (rng.below(10) == 0) put(0xd);
            last = frame[i++];
        }
        if (half) put(0xd);
    }
};

std::vector<std::uint16_t> random_frame(Rng& rng, std::size_t count) {
    std::vector<std::uint16_t> frame(count);
    int value = 1000;
    for (auto& f : frame) {
        const int kind = rng.below(10);
        if (kind == 0) value = rng.below(32768);
        if (kind == 1) value = std::clamp(value + rng.below(127) - 64, 0, 32767);
        if (kind < 5) value = std::clamp(value + rng.below(13) - 6, 0, 32767);
        f = static_cast<std::uint16_t>(value);
    }
    return frame;
}

TEST(PsCompressed, AnyCutOfTheStreamGivesTheFrame) {
    Rng rng(302);
    for (int round = 0; round < 500; ++round) {
        const auto count = static_cast<std::size_t>(rng.below(400)),
                   before = static_cast<std::size_t>(rng.below(5)),
                   after = static_cast<std::size_t>(rng.below(5));
        const auto frame = random_frame(rng, count);
        Nibbles stream;
        stream.encode(frame, rng);
        std::vector<std::uint16_t> got(before + count + after, 7), table(20000);
        for (auto& t : table) t = static_cast<std::uint16_t>(rng.below(65536));
        const bool look_up = rng.below(2) == 0;
        PsCompressed decoder;
        decoder.begin(got.data(), got.size(), before, after, look_up ? table.data() : nullptr, 20000);
        for (std::size_t at = 0; at < stream.bytes.size();) {
            const std::size_t some =
                std::min(stream.bytes.size() - at, static_cast<std::size_t>(rng.below(9)));
            decoder.feed(stream.bytes.data() + at, some);
            at += some;
        }
        const PsCompressed::Result result = decoder.end();
        ASSERT_TRUE(result.whole());
        ASSERT_EQ(result.pixels, count);
        for (std::size_t i = 0; i < got.size(); ++i) {
            const bool sent = i >= before && i < before + count;
            const std::uint16_t reading = sent ? frame[i - before] : std::uint16_t{0};
            ASSERT_EQ(got[i], !sent ? 0 : !look_up ? reading : reading < 20000 ? table[reading] : 0);
        }
    }
}

TEST(PsCompressed, CountsWhatIsMissingOrTooMuch) {
    std::uint16_t frame[10];
    PsCompressed decoder;
    EXPECT_EQ(decoder.end().pixels, 0u);                   // nothing begun
    const std::uint8_t some[] = {0xf0, 0x12, 0x3e, 0x2f};  // 0x123, thrice again, and the beginning of a code
    decoder.begin(frame, 10);
    decoder.feed(some, sizeof some);
    PsCompressed::Result r = decoder.end();
    EXPECT_EQ(r.pixels, 4u);
    EXPECT_EQ(r.missing, 6u);
    EXPECT_EQ(r.surplus, 0u);
    EXPECT_TRUE(r.cut);
    EXPECT_EQ(frame[3], 0x123);
    EXPECT_EQ(frame[4], 0);
    const std::uint8_t many[] = {0xef, 0xef};  // 32 zeros
    decoder.begin(frame, 10, 8, 9);            // more padding than there are pixels
    decoder.feed(many, sizeof many);
    r = decoder.end();
    EXPECT_EQ(r.pixels, 0u);
    EXPECT_EQ(r.surplus, 32u);
    EXPECT_FALSE(r.whole());
    decoder.feed(many, sizeof many);  // after the end: nothing
}

}  // namespace
}  // namespace burin
