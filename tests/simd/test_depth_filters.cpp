// SPDX-License-Identifier: MIT
// Bilateral filter, removal of edges, normals and weights: every target against the specification, over
// images of every small size.
#include "simd/depth_filters.h"

#include "kernel_test.h"
#include "simd/tsdf.h"

namespace burin {
namespace {

using namespace simd;

// A bordered image as the depth stage lays it out, with just the slack that vectors may read.
struct Bordered {
    Bordered(int w, int h, float unit) : width(w), height(h), stride(w + 2), unit_m(unit) {
        pixels = tight<std::uint16_t>(static_cast<std::size_t>(stride * (h + 2) + kOverread), 0);
    }
    std::size_t at(int x, int y) const { return static_cast<std::size_t>((y + 1) * stride + x + 1); }
    DepthRow row(int y) const { return {pixels.data() + at(0, y), stride, width, unit_m}; }
    // Both outputs of one kind of kernel: what it writes beside its row shows too.
    template <class T, class Kernel>
    std::vector<T> run(int channels, Kernel&& kernel) const {
        auto out = tight<T>(pixels.size() * static_cast<std::size_t>(channels), T(77));
        for (int y = 0; y < height; ++y)
            kernel(row(y), y, out.data() + at(0, y) * static_cast<std::size_t>(channels));
        return out;
    }

    int width, height, stride;
    float unit_m;
    std::vector<std::uint16_t> pixels;
};

enum Kind { kNoise, kSurface, kExtremes, kSparse, kKinds };

Bordered random_image(Rng& rng, int width, int height, Kind kind) {
    const float units[] = {0.001f, 4.0f / 65534, 1.0f / 5000};
    Bordered image(width, height, kind == kExtremes ? 50.0f / 65534 : units[rng.below(3)]);
    const double slope_x = rng.uniform(-30, 30), slope_y = rng.uniform(-30, 30);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            std::uint16_t& d = image.pixels[image.at(x, y)];
            switch (kind) {
                case kNoise:
                    d = static_cast<std::uint16_t>(rng.below(65536));
                    break;
                case kSurface:
                    d = static_cast<std::uint16_t>(std::fmax(
                        0, 2000 + 800 * rng.below(2) + slope_x * x + slope_y * y + rng.normal() * 5));
                    if (rng.below(8) == 0) d = 0;
                    break;
                case kExtremes:
                    d = static_cast<std::uint16_t>(rng.below(2) ? 65534 - rng.below(3) : rng.below(3));
                    break;
                default:
                    d = rng.below(10) ? std::uint16_t{0} : static_cast<std::uint16_t>(1 + rng.below(5000));
            }
        }
    return image;
}

class DepthFilters : public KernelTest {
  protected:
    template <class Check>
    void over_images(Check&& check) {
        Rng rng(110);
        for (int height = 1; height <= 7; ++height)
            for (int width = 1; width <= 33; ++width)
                for (int kind = 0; kind < kKinds; ++kind)
                    check(random_image(rng, width, height, static_cast<Kind>(kind)));
        for (const int width : {64, 97, 640}) check(random_image(rng, width, 11, kSurface));
    }
};

RayModel rays_for(const Bordered& image) {
    return {static_cast<float>(image.width) / 2.1f, static_cast<float>(image.height) / 1.9f, 1.0f / 525,
            1.0f / 500};
}

TEST_P(DepthFilters, Bilateral) {
    over_images([](const Bordered& image) {
        const auto with = [&](auto kernel) {
            return image.run<std::uint16_t>(1, [&](const DepthRow& row, int y, std::uint16_t* out) {
                kernel(row, std::min(2, y), std::min(2, image.height - 1 - y), out);
            });
        };
        ASSERT_TRUE(same_bytes(with(bilateral_row), with(scalar::bilateral_row)))
            << image.width << " x " << image.height;
    });
}

TEST_P(DepthFilters, RemovalOfEdges) {
    over_images([](const Bordered& image) {
        const auto with = [&](auto kernel) {
            return image.run<std::uint16_t>(
                1, [&](const DepthRow& row, int, std::uint16_t* out) { kernel(row, out); });
        };
        ASSERT_TRUE(same_bytes(with(remove_edges_row), with(scalar::remove_edges_row)))
            << image.width << " x " << image.height;
    });
}

TEST_P(DepthFilters, Normals) {
    long found = 0;
    over_images([&](const Bordered& image) {
        const auto with = [&](auto kernel) {
            return image.run<float>(
                3, [&](const DepthRow& row, int y, float* out) { kernel(row, rays_for(image), y, out); });
        };
        const auto got = with(normals_row);
        ASSERT_TRUE(same_bytes(got, with(scalar::normals_row))) << image.width << " x " << image.height;
        for (const float n : got) found += n != 0 && n != 77;
    });
    EXPECT_GT(found, 10000);
}

TEST_P(DepthFilters, Weights) {
    for (int model = 0; model < 4; ++model)
        over_images([&](const Bordered& image) {
            const auto with = [&](auto kernel) {
                return image.run<std::uint16_t>(1, [&](const DepthRow& row, int y, std::uint16_t* out) {
                    kernel(row, rays_for(image), y,
                           WeightModel{(model & 1) != 0, (model & 2) != 0, kWeightOne}, out);
                });
            };
            ASSERT_TRUE(same_bytes(with(weights_row), with(scalar::weights_row)))
                << image.width << " x " << image.height << " model " << model;
        });
}

BURIN_EVERY_TARGET(DepthFilters);

}  // namespace
}  // namespace burin
