// SPDX-License-Identifier: MIT
#include "track/thumbnail.h"

#include <algorithm>

#include "map/colour_pixels.h"

namespace burin {
namespace {

constexpr int kWidth = Thumbnail::kWidth, kHeight = Thumbnail::kHeight, kCells = Thumbnail::kCells;

// A cell's pixels along one side: at least 8 of larger blocks, since the mean of 64 and more readings is good
// to an eighth of one reading's noise, and a larger image then costs no more.
PixelSpan block(int cell, int cells, int pixels) {
    const int first = cell * pixels / cells;
    const int width = std::max((cell + 1) * pixels / cells - first, 1);  // images may be smaller than 40 x 30
    const int step = std::max(width / 8, 1);
    return {first, step, (width + step - 1) / step};
}

template <class Body>  // body(cell, columns, rows)
void for_blocks(int width, int height, Body&& body) {
    PixelSpan columns[kWidth];
    for (int x = 0; x < kWidth; ++x) columns[x] = block(x, kWidth, width);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) body(y * kWidth + x, columns[x], block(y, kHeight, height));
}

// Millimetres; 0 when less than a quarter of the block has depth.
std::uint32_t mean_depth_mm(const DepthImage& image, const PixelSpan& columns, const PixelSpan& rows) {
    std::uint32_t sum = 0;
    int valid = 0;
    for (int j = 0; j < rows.count; ++j) {
        const std::uint16_t* row = image.pixels + image.offset(0, rows.first + j * rows.step);
        for (int i = 0; i < columns.count; ++i) {
            const std::uint16_t value = row[columns.first + i * columns.step];
            sum += value;
            valid += value > 0;
        }
    }
    if (valid == 0 || 4 * valid < columns.count * rows.count) return 0;
    const double mm = static_cast<double>(sum) / valid * static_cast<double>(image.unit_m) * 1000;
    return static_cast<std::uint32_t>(std::clamp(mm + 0.5, 1.0, 65535.0));
}

// Sums over a window of 2 * radius + 1 cells along lines of `length` cells that lie `step` apart.
void sum_along(std::uint32_t* line, int length, int step, int radius) {
    std::uint32_t in[std::max(kWidth, kHeight)], sum = 0;
    for (int i = 0; i < length; ++i) in[i] = line[i * step];
    for (int i = 0; i < radius; ++i) sum += in[i];
    for (int i = 0; i < length; ++i) {
        if (i + radius < length) sum += in[i + radius];
        if (i > radius) sum -= in[i - radius - 1];
        line[i * step] = sum;
    }
}

void sum_windows(std::uint32_t* cells, int radius) {
    for (int y = 0; y < kHeight; ++y) sum_along(cells + y * kWidth, kWidth, 1, radius);
    for (int x = 0; x < kWidth; ++x) sum_along(cells + x, kHeight, kWidth, radius);
}

// Windows of 7 x 7 and over these of 5 x 5: a spread of 2.45 cells, near the Gaussian of 2.5 of the paper.
// The sums of depths (up to 65535 * 49 * 25) fit 32 bits.
void blur_sums(std::uint32_t* cells) {
    sum_windows(cells, 3);
    sum_windows(cells, 2);
}

}  // namespace

Thumbnail make_thumbnail(const DepthImage& image, const FrameView& frame) {
    Thumbnail t = {};
    std::uint32_t sums[kCells], weights[kCells], all[kCells];  // 14 KB of stack
    std::fill_n(all, kCells, 1u);
    blur_sums(all);

    for_blocks(image.width, image.height, [&](int cell, const PixelSpan& columns, const PixelSpan& rows) {
        sums[cell] = mean_depth_mm(image, columns, rows);
        weights[cell] = sums[cell] > 0;
    });
    blur_sums(sums);
    blur_sums(weights);
    for (int i = 0; i < kCells; ++i)
        if (4 * weights[i] >= all[i])
            t.depth_mm[i] = static_cast<std::uint16_t>((sums[i] + weights[i] / 2) / weights[i]);

    t.has_colour = !frame.colour.empty();
    if (!t.has_colour) return t;
    std::uint8_t means[3][kCells];
    for_blocks(frame.colour.width, frame.colour.height,
               [&](int cell, const PixelSpan& columns, const PixelSpan& rows) {
                   std::uint32_t sum[3] = {};
                   add_colours(frame, columns, rows, sum);
                   const auto count = static_cast<std::uint32_t>(columns.count * rows.count);
                   for (int c = 0; c < 3; ++c)
                       means[c][cell] = static_cast<std::uint8_t>((sum[c] + count / 2) / count);
               });
    for (int c = 0; c < 3; ++c) {
        std::copy_n(means[c], kCells, sums);
        blur_sums(sums);
        for (int i = 0; i < kCells; ++i)
            t.rgb[3 * i + c] = static_cast<std::uint8_t>((sums[i] + all[i] / 2) / all[i]);
    }
    return t;
}

}  // namespace burin
