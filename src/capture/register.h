// SPDX-License-Identifier: MIT
// Depth registered to colour and colour to depth, by two pinhole cameras with Brown's distortion and the
// transform between them. The registration tables of Kinect and PrimeSense: platform/usb/registration.h.
#pragma once

#include <cstdint>
#include <memory>

#include "core/camera.h"
#include "core/image.h"
#include "core/se3.h"
#include "core/status.h"
#include "simd/reproject.h"

namespace burin {

// For one pair of cameras. configure() allocates (rows; with a distorted depth camera twelve bytes a pixel),
// the others do not. One thread at a time.
class ImageRegistration {
  public:
    // Error: a camera that check_camera refuses, a unit outside 1e-6..1 m, an extrinsic that is not finite or
    // over 10 m, no memory.
    Status configure(const Camera& depth, double depth_unit_m, const Camera& colour,
                     const Se3& T_colour_depth);
    bool configured() const { return rows_ != nullptr; }

    // Depth (width and height of the depth camera) to the view of the colour camera (its width and height):
    // along its optical axis, same unit, 0 where nothing is seen. Of several surfaces the nearest counts. A
    // depth pixel covers what it spans there, and a little more, so that a magnified or slanted surface has
    // no holes; what the depth camera does not see stays 0.
    // Error: images of another size than the cameras', or rows of `out` more than 32767 apart.
    Status depth_to_colour(View<const std::uint16_t> depth, View<std::uint16_t> out);

    // The nearest colour pixel of each pixel of depth: RGB (3 channels) of the colour camera's size to `out`
    // of the depth camera's, black and mask 0 where there is no depth, no colour, or where a nearer surface
    // stands before it in the colour camera's view (else mask 255). `registered` is what depth_to_colour made
    // of the same depth.
    Status colour_to_depth(View<const std::uint8_t> rgb, View<const std::uint16_t> depth,
                           View<const std::uint16_t> registered, View<std::uint8_t> out,
                           View<std::uint8_t> mask);

  private:
    Status check(int depth_width, int depth_height, int width, int height, std::ptrdiff_t pitch) const;
    void fill_rays();
    simd::RayRow rays(int y) const;

    Camera depth_, colour_;
    simd::Reprojection by_;
    int slack_ = 0;  // units
    std::unique_ptr<std::uint32_t[]> rows_;
    std::unique_ptr<float[]> rays_;
    std::uint16_t* there_ = nullptr;
    simd::Footprints footprints_ = {};
};

}  // namespace burin
