// SPDX-License-Identifier: MIT
// What a sensor tells of itself: fixed parameters, constant shift, registration table; and all that is
// computed from it.
#include <memory>

#include "fuzz/fuzz_checks.h"
#include "platform/usb/registration.h"
#include "platform/usb/sensor_modes.h"

using namespace burin;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const int bytes = static_cast<int>(size);
    const ModeList presets = parse_colour_presets(data, bytes);
    for (int i = 0; i < presets.count; ++i)
        fuzz::check(presets.modes[i].width > 0 && presets.modes[i].height > 0 && presets.modes[i].fps > 0);
    DepthGeometry g;
    Status s = parse_fixed_params(data, bytes, fuzz::kName.c_str(), &g);
    if (!s.ok()) {
        fuzz::check_error(s);
        return 0;
    }
    const int used = bytes < 168 ? bytes : 168;
    s = parse_const_shift(data + used, bytes - used, fuzz::kName.c_str(), &g);
    if (!s.ok()) {
        fuzz::check_error(s);
        return 0;
    }
    static std::uint16_t table[kShifts];
    for (const int factor : {1, 2}) {
        build_depth_table(g, factor, table);
        for (const std::uint16_t z : table) fuzz::check(z < kMaxDepth_mm);
        fuzz::check(table[0] == 0 && table[kShifts - 1] == 0);
    }
    const Camera depth = depth_camera(g, 640, 480);
    fuzz::check(check_camera(depth, "depth").ok());
    RegistrationPolynomial p;
    s = parse_registration(data + used, bytes - used, fuzz::kName.c_str(), &p);
    if (!s.ok()) {
        fuzz::check_error(s);
        return 0;
    }
    if (!parse_padding(data + used, bytes - used, fuzz::kName.c_str(), &p).ok()) return 0;
    static auto registration = std::make_unique<Registration>();
    if (!registration->build(p, g)) return 0;
    Camera colour;
    Se3 T;
    double residual = 0;
    if (registration->fit_camera(depth, g, &colour, &T, &residual)) {
        fuzz::check(check_camera(colour, "colour").ok());
        fuzz::check_rigid(T);
    }
    static auto images = std::make_unique<std::uint16_t[]>(2 * 640 * 480);
    for (int i = 0; i < 640 * 480; ++i) images[static_cast<std::size_t>(i)] = table[i % kShifts];
    registration->apply(images.get(), images.get() + 640 * 480);
    return 0;
}
