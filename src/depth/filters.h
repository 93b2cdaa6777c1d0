// SPDX-License-Identifier: MIT
// Filters on bordered depth images (see depth_image.h). All of them treat 0 as "no depth" and never invent
// depth where there was none.
#pragma once

#include <cstdint>

#include "core/camera.h"
#include "core/jobs.h"
#include "core/vec.h"
#include "depth/depth_image.h"
#include "simd/depth_filters.h"

namespace burin {

using simd::axial_noise_m;
using simd::kJump;

// Edge-preserving smoothing (Tomasi & Manduchi 1998): 5x5 window, spatial sigma 1.5 pixels, range sigma three
// times axial_noise_m. `out` has the layout of `in`; its border is left alone.
void bilateral_filter(const DepthImage& in, std::uint16_t* out, Jobs& jobs);

// Drops readings one of whose four neighbours lies across a jump: the rim where a sensor mixes near and far.
void remove_edges(const DepthImage& in, std::uint16_t* out, Jobs& jobs);

// Halves the image: each pixel is the mean of those of its 2x2 that belong with the nearest of them. `out` is
// a bordered image of (width / 2) x (height / 2) with its own stride (width / 2 + 2) and its border set to 0.
DepthImage half_sample(const DepthImage& in, std::uint16_t* out);

// Normal of the surface at a pixel in camera coordinates, towards the camera, by the cross product of central
// differences (one-sided where a neighbour is missing or across a jump); zero vector when there is no
// support.
Vec3f normal_at(const DepthImage& depth, int x, int y);

// normal_at for every pixel: 3 floats a pixel, packed rows.
void compute_normals(const DepthImage& depth, float* normals, Jobs& jobs);

// The weight of every pixel, in the layout of the image; its border is left alone.
void observation_weights(const DepthImage& depth, const simd::WeightModel& model, std::uint16_t* weights,
                         Jobs& jobs);

}  // namespace burin
