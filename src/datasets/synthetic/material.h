// SPDX-License-Identifier: MIT
// Procedural surface colours. Albedo is linear reflectance in 0..1 per channel.
#pragma once

#include <cstdint>

#include "core/vec.h"

namespace burin::synthetic {

enum class Texture : std::uint8_t {
    plain,      // colour a with faint mottling
    mottled,    // a to b by fractal noise of wavelength `scale`
    checker,    // a and b, squares of side `scale`
    stripes,    // a and b along u, period `scale`
    hoops,      // stripes around the part's z axis, period `scale`
    wood,       // long grain along the part's longest texture axis u, ring spacing `scale`
    planks,     // wood boards of width `scale` and length 8 scale, thin dark joints
    tiles,      // tiles of side `scale` in shades of a, joints of colour b
    wallpaper,  // a with a repeated ornament in b, period `scale`
    fabric,     // woven threads, spacing `scale`
    carpet,     // concentric coloured borders and medallions, `scale` the width of the outer border
    picture,    // a painting over [-extent_u, extent_u] x [-extent_v, extent_v]
    screen,     // windows and lines of text over the same extent
    keys,       // keyboard-like rows of keys of pitch `scale`
    face,       // skin with eyes, brows and mouth around +y of the part, `scale` the head's half height
    skyline,    // what is seen through a window: sky, hills, houses
};

struct Material {
    Texture texture = Texture::plain;
    Vec3f a, b;                             // linear reflectance
    double scale = 0.1;                     // metres
    double extent_u = 0.5, extent_v = 0.5;  // metres, half
    std::uint32_t seed = 0;
};

// sRGB 0..255 to linear 0..1.
Vec3f linear_colour(int r, int g, int b);

// Albedo of a surface point. p: part coordinates; n: outward normal in part coordinates (selects the texture
// plane of the flat textures: the two coordinates other than the normal's largest). footprint: the width of a
// pixel on the surface, metres; detail finer than it fades to its mean, so that distant textures do not
// alias. 0 gives all detail.
Vec3f albedo_of(const Material& material, Vec3d p, Vec3d n, double footprint);

}  // namespace burin::synthetic
