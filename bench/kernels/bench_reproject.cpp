// SPDX-License-Identifier: MIT
// Registration of a 640 x 480 depth image, as that of a Kinect: 11 bits unpacked and looked up, then depth
// into the colour camera's view; colour into the depth camera's; into 1280 x 720, where pixels are spread.
#include <vector>

#include "capture/raw_image.h"
#include "capture/register.h"
#include "kernels/kernels.h"
#include "scene_helpers.h"

using namespace burin;

namespace {

constexpr int kWidth = 640, kHeight = 480, kPixels = kWidth * kHeight;

// A room corner with steps, a tenth of it without depth, as readings of 11 bits.
struct Scene {
    std::vector<std::uint8_t> packed = std::vector<std::uint8_t>(kPixels * 11 / 8);
    std::vector<std::uint16_t> table = std::vector<std::uint16_t>(2048);
    Scene() {
        // Shift to depth of a PS1080, in whole mm; 2047 is none.
        for (int s = 0; s < 2047; ++s) {
            const double x = ((s - 4 * 200) / 4 - 0.375) * 0.1042;
            const double z = 10 * (x * 120 / (7.5 - x) + 120);
            table[static_cast<std::size_t>(s)] =
                z > 0 && z < 10000 ? static_cast<std::uint16_t>(z) : std::uint16_t{0};
        }
        Rng rng(1);
        for (std::size_t i = 0; i < kPixels; ++i) {
            const int x = static_cast<int>(i) % kWidth, y = static_cast<int>(i) / kWidth;
            int s = 700 + x / 8 + y / 16 + (x / 80 % 2) * 60 + rng.below(2);
            if (rng.below(10) == 0) s = 2047;
            for (std::size_t b = 0; b < 11; ++b)
                if (s >> (10 - b) & 1)
                    packed[(i * 11 + b) / 8] |= static_cast<std::uint8_t>(128 >> (i * 11 + b) % 8);
        }
    }
};

const Scene& scene() {
    static const Scene made;
    return made;
}

const Camera kDepth{kWidth, kHeight, 585, 585, 319.5, 239.5};
Camera colour_camera(int width, int height, bool distorted) {
    Camera c{width, height, 525.0 * width / 640, 525.0 * width / 640, width / 2 - 0.5, height / 2 - 0.5};
    if (distorted) c.k1 = 0.12, c.k2 = -0.2, c.p1 = 0.001;
    return c;
}
Se3 extrinsic() {
    Se3 T;
    T.R = rotation_from_vector({0.004, -0.006, 0.002});
    T.t = {0.025, 0.0005, 0.001};
    return T;
}

struct Frames {
    std::vector<std::uint16_t> depth = std::vector<std::uint16_t>(kPixels), registered;
    std::vector<std::uint8_t> rgb, out = std::vector<std::uint8_t>(3 * kPixels),
                                   mask = std::vector<std::uint8_t>(kPixels);
    ImageRegistration registration;
    Camera colour;
    Frames(int width, int height, bool distorted, bool depth_distorted = false)
        : colour(colour_camera(width, height, distorted)) {
        registered.resize(static_cast<std::size_t>(width * height));
        rgb.assign(registered.size() * 3, 100);
        Camera from = kDepth;
        if (depth_distorted) from.k1 = -0.1;
        if (!registration.configure(from, 0.001, colour, extrinsic())) std::abort();
    }
    View<std::uint16_t> depth_view() { return {depth.data(), kWidth, kHeight, kWidth}; }
    View<std::uint16_t> registered_view() {
        return {registered.data(), colour.width, colour.height, colour.width};
    }
    void unpack() {
        unpack_image(simd::Packing::msb11, {scene().packed.data(), scene().packed.size(), 0},
                     {scene().table.data(), 2048}, depth_view());
    }
    void forward() {
        if (!registration.depth_to_colour(depth_view(), registered_view())) std::abort();
    }
    void back() {
        if (!registration.colour_to_depth({rgb.data(), colour.width, colour.height, 3 * colour.width, 3},
                                          depth_view(), registered_view(),
                                          {out.data(), kWidth, kHeight, 3 * kWidth, 3},
                                          {mask.data(), kWidth, kHeight, kWidth}))
            std::abort();
    }
};

template <class Body>
void timed(benchmark::State& state, Frames& frames, Body&& body) {
    frames.unpack();
    frames.forward();
    for (auto _ : state) {
        body(frames);
        benchmark::ClobberMemory();
    }
}

const bool registered = [] {
    bench::on_every_target("unpack_and_register_vga", [](auto& s) {
        Frames f(640, 480, false);
        timed(s, f, [](Frames& frames) { frames.unpack(), frames.forward(); });
    });
    bench::on_every_target("register_vga", [](auto& s) {
        Frames f(640, 480, false);
        timed(s, f, [](Frames& frames) { frames.forward(); });
    });
    bench::on_every_target("register_vga_distorted", [](auto& s) {
        Frames f(640, 480, true, true);
        timed(s, f, [](Frames& frames) { frames.forward(); });
    });
    bench::on_every_target("register_vga_to_720p", [](auto& s) {
        Frames f(1280, 720, false);
        timed(s, f, [](Frames& frames) { frames.forward(); });
    });
    bench::on_every_target("colour_to_depth_vga", [](auto& s) {
        Frames f(640, 480, false);
        timed(s, f, [](Frames& frames) { frames.back(); });
    });
    return true;
}();

}  // namespace
