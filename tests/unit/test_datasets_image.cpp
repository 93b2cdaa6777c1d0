// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <iterator>

#include "dataset_files.h"
#include "datasets/image_file.h"

namespace burin {
namespace {

std::string seed(const char* name) {
    return std::string(BURIN_SOURCE_DIR) + "/tests/fuzz/corpus/fuzz_datasets_image/" + name;
}

template <class T>
Image<T> pattern(int width, int height, int channels, unsigned factor) {
    Image<T> image(width, height, channels);
    unsigned state = 1;  // values without runs, so that a shifted row or swapped byte shows
    for (T& v : image.pixels) v = static_cast<T>((state = state * 1664525u + factor) >> 13);
    return image;
}

TEST(ImageFile, Depth16SurvivesPng) {
    const TempFolder folder;
    const auto image = pattern<std::uint16_t>(37, 11, 1, 7);
    ASSERT_TRUE(write_png(folder.path("a.png"), image.view()).ok());
    Image<std::uint16_t> back;
    const Status status = read_depth(folder.path("a.png"), &back);
    ASSERT_TRUE(status.ok()) << status.text();
    EXPECT_EQ(back.width, 37);
    EXPECT_EQ(back.height, 11);
    EXPECT_EQ(back.pixels, image.pixels);
    EXPECT_FALSE(std::filesystem::exists(folder.path("a.png.part")));
}

TEST(ImageFile, ColourAndGreySurvivePngAlsoWithStride) {
    const TempFolder folder;
    const auto image = pattern<std::uint8_t>(20, 9, 3, 11);
    View<const std::uint8_t> part = image.view();
    part.width = 13;  // the stride stays that of 20 pixels
    ASSERT_TRUE(write_png(folder.path("a.png"), part).ok());
    Image<std::uint8_t> back;
    ASSERT_TRUE(read_rgb(folder.path("a.png"), &back).ok());
    ASSERT_EQ(back.width, 13);
    for (int y = 0; y < 9; ++y)
        for (int x = 0; x < 13; ++x)
            for (int c = 0; c < 3; ++c) ASSERT_EQ(back.view().at(x, y, c), image.view().at(x, y, c));

    const auto grey = pattern<std::uint8_t>(5, 4, 1, 3);
    ASSERT_TRUE(write_png(folder.path("g.png"), grey.view()).ok());
    ASSERT_TRUE(read_rgb(folder.path("g.png"), &back).ok());
    for (std::size_t i = 0; i < grey.pixels.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c) ASSERT_EQ(back.pixels[3 * i + c], grey.pixels[i]);
}

TEST(ImageFile, EveryKindOfPngBecomesRgb) {
    Image<std::uint8_t> rgb;
    // The seeds hold counting bytes, so the pixels are known.
    ASSERT_TRUE(read_rgb(seed("rgb8.png"), &rgb).ok());
    EXPECT_EQ(rgb.pixels[5], 5);
    ASSERT_TRUE(read_rgb(seed("rgba16.png"), &rgb).ok());  // 0x0001 0x0203 0x0405, alpha dropped: high bytes
    EXPECT_EQ(rgb.width, 2);
    EXPECT_EQ(std::vector<std::uint8_t>(rgb.pixels.begin(), rgb.pixels.begin() + 6),
              (std::vector<std::uint8_t>{0, 2, 4, 8, 10, 12}));
    ASSERT_TRUE(read_rgb(seed("palette.png"), &rgb).ok());  // 0 red, 1 green
    EXPECT_EQ(std::vector<std::uint8_t>(rgb.pixels.begin(), rgb.pixels.begin() + 6),
              (std::vector<std::uint8_t>{255, 0, 0, 0, 255, 0}));
    ASSERT_TRUE(read_rgb(seed("grey1.png"), &rgb).ok());  // 0xa5: bits 1 0 1 0 0 1 0 1
    EXPECT_EQ(rgb.pixels[0], 255);
    EXPECT_EQ(rgb.pixels[3], 0);
    EXPECT_EQ(rgb.pixels[6], 255);
    Image<std::uint16_t> depth;
    ASSERT_TRUE(read_depth(seed("grey16.png"), &depth).ok());
    EXPECT_EQ(depth.pixels[0], 0x0001);
    EXPECT_EQ(depth.pixels[3], 0x0607);
}

TEST(ImageFile, Pnm) {
    Image<std::uint16_t> depth;
    ASSERT_TRUE(read_depth(seed("pgm16"), &depth).ok());
    EXPECT_EQ(depth.pixels[7], 0x0e0f);
    Image<std::uint8_t> rgb;
    ASSERT_TRUE(read_rgb(seed("ppm8"), &rgb).ok());
    EXPECT_EQ(rgb.pixels[11], 11);
    ASSERT_TRUE(read_rgb(seed("pgm8"), &rgb).ok());  // values 1 2 3 of 15
    EXPECT_EQ(rgb.pixels[6], 51);
}

TEST(ImageFile, Jpeg) {
    for (const char* name : {"baseline.jpg", "progressive.jpg", "grey.jpg"}) {
        Image<std::uint8_t> rgb;
        const Status status = read_rgb(seed(name), &rgb);
        ASSERT_TRUE(status.ok()) << status.text();
        EXPECT_EQ(rgb.width, 16);
        EXPECT_EQ(rgb.height, 8);
        EXPECT_EQ(rgb.pixels.size(), 16u * 8 * 3);
        const Result<ImageInfo> info = read_image_info(seed(name));
        ASSERT_TRUE(info.ok());
        EXPECT_EQ(info->width, 16);
        EXPECT_EQ(info->channels, std::string(name) == "grey.jpg" ? 1 : 3);
    }
}

// Cut anywhere, a file is an error and no pixels come out.
TEST(ImageFile, EveryTruncationIsAnError) {
    for (const char* name :
         {"grey16.png", "rgb8.png", "palette.png", "pgm16", "ppm8", "baseline.jpg", "progressive.jpg"}) {
        const std::string whole = read_bytes(seed(name));
        ASSERT_GT(whole.size(), 20u);
        for (std::size_t size = 0; size < whole.size(); ++size) {
            Image<std::uint8_t> rgb(3, 3, 3);
            const Status status = decode_rgb(std::string_view(whole).substr(0, size), "cut", &rgb);
            // A JPEG is whole without its last marker byte by byte: only the end-of-image code is missing
            // then.
            ASSERT_FALSE(status.ok()) << name << " cut to " << size << " of " << whole.size();
            ASSERT_EQ(std::string(status.text()).substr(0, 4), "cut:");
            ASSERT_TRUE(rgb.empty());
        }
    }
}

TEST(ImageFile, DamagedPixelsAreAnError) {
    const TempFolder folder;
    const auto image = pattern<std::uint16_t>(64, 64, 1, 5);
    std::string bytes;
    ASSERT_TRUE(encode_png(image.view(), &bytes).ok());
    bytes[bytes.size() / 2] ^= 1;
    Image<std::uint16_t> depth;
    EXPECT_FALSE(decode_depth(bytes, "a", &depth).ok());
    EXPECT_TRUE(depth.empty());
}

TEST(ImageFile, DepthMustBeSixteenBitGrey) {
    for (const char* name :
         {"rgb8.png", "grey1.png", "palette.png", "rgba16.png", "pgm8", "ppm8", "baseline.jpg"}) {
        Image<std::uint16_t> depth;
        const Status status = read_depth(seed(name), &depth);
        ASSERT_FALSE(status.ok()) << name;
        EXPECT_NE(std::string(status.text()).find("expected 16-bit grey"), std::string::npos)
            << status.text();
        EXPECT_NE(std::string(status.text()).find(name), std::string::npos) << status.text();
    }
}

// A few hundred bytes that promise half a gigabyte are refused before any of it is taken.
TEST(ImageFile, HugePromiseIsRefused) {
    Image<std::uint16_t> depth;
    const Status status = read_depth(seed("huge.png"), &depth);
    ASSERT_FALSE(status.ok());
    EXPECT_NE(std::string(status.text()).find("too short"), std::string::npos) << status.text();
    EXPECT_EQ(depth.pixels.capacity(), 0u);
}

TEST(ImageFile, BufferIsKept) {
    Image<std::uint16_t> depth;
    ASSERT_TRUE(read_depth(seed("grey16.png"), &depth).ok());
    const auto* before = depth.pixels.data();
    ASSERT_TRUE(read_depth(seed("grey16.png"), &depth).ok());
    EXPECT_EQ(depth.pixels.data(), before);
}

// A limit on the size of files stands for the full disk: it needs no root and no file system of its own.
TEST(ImageFile, WriteThatFailsHalfWayLeavesWhatWasThere) {
    const auto image = pattern<std::uint16_t>(640, 480, 1, 5);
    const TempFolder folder;
    const std::string fresh = folder.path("new.png"), old = folder.text("old.png", "what was there");
    rlimit before;
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{4096, before.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
    const Status first = write_png(fresh, image.view()), second = write_png(old, image.view());
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
    std::signal(SIGXFSZ, handler);
    ASSERT_FALSE(first.ok());
    ASSERT_FALSE(second.ok());
    EXPECT_EQ(first.code(), Code::io);
    EXPECT_NE(std::string(first.text()).find(fresh), std::string::npos) << first.text();
    EXPECT_EQ(read_bytes(old), "what was there");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}),
              1);  // no new.png, no part files
}

TEST(ImageFile, WriteWhereNothingCanBe) {
    const TempFolder folder;
    const Image<std::uint16_t> image(4, 4);
    const Status status = write_png(folder.path("no/such/folder/a.png"), image.view());
    ASSERT_FALSE(status.ok());
    EXPECT_NE(std::string(status.text()).find("a.png"), std::string::npos) << status.text();
    EXPECT_FALSE(write_png("/dev/full", image.view()).ok());
}

TEST(ImageFile, RefusesToWriteWhatIsNoImage) {
    const TempFolder folder;
    EXPECT_FALSE(write_png(folder.path("a.png"), View<const std::uint8_t>{}).ok());
    const Image<std::uint8_t> two(4, 4, 2);
    EXPECT_FALSE(write_png(folder.path("a.png"), two.view()).ok());
    EXPECT_FALSE(std::filesystem::exists(folder.path("a.png")));
}

}  // namespace
}  // namespace burin
