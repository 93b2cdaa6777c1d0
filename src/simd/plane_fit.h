// SPDX-License-Identifier: MIT
// Kernels of planes in a chunk: the sums of a weighted least squares fit of the signed distances, residuals
// and weights of its re-weighting, and the pull of the distances to planes (Dzitsiuk et al., ICRA 2017).
// Weights are small whole numbers and voxels lie on a lattice, so the sums are exact integers, whatever their
// order.
#pragma once

#include <cstdint>

#include "simd/tsdf.h"

namespace burin::simd {

inline constexpr int kFullWeight = 15;  // of a voxel in a fit: sums then fit 32 bits

// Sums over voxels of weight w at u = (2 x - 7, 2 y - 7, 2 z - 7), in half voxels from the chunk's centre,
// with stored distance f.
struct PlaneSums {
    std::int32_t w = 0, u[3] = {}, uu[6] = {};  // uu: xx xy xz yy yz zz
    std::int32_t f = 0, fu[3] = {};
    PlaneSums& operator+=(const PlaneSums& o) {
        w += o.w;
        f += o.f;
        for (int i = 0; i < 3; ++i) {
            u[i] += o.u[i];
            fu[i] += o.fu[i];
        }
        for (int i = 0; i < 6; ++i) uu[i] += o.uu[i];
        return *this;
    }
};

// Stored distance at u: ((a[1] u_y + a[2] u_z) + c) + a[0] u_x.
struct PlaneModel {
    float a[3], c;
};

// kFullWeight for the voxels with a weight of at least `min_weight` and |sdf| <= band, else 0. Returns their
// number. weights: 512.
int choose_voxels(const std::int16_t* sdf, const std::uint16_t* weight, std::uint16_t min_weight,
                  std::int16_t band, std::uint8_t* weights);

// Of the eight blocks of 4x4x4 voxels: number (x >> 2) + 2 (y >> 2) + 4 (z >> 2). weights <= kFullWeight.
void sum_octants(const std::int16_t* sdf, const std::uint8_t* weights, PlaneSums sums[8]);

// |sdf - model|, rounded, at most 65535, for all 512 voxels.
void plane_residuals(const std::int16_t* sdf, const PlaneModel& model, std::uint16_t* residuals);

// Tukey's biweight: kFullWeight (1 - (r / cut)^2)^2, rounded, where chosen is not 0 and r < cut; else 0.
// cut > 0. Returns the sum.
int tukey_weights(const std::uint16_t* residuals, const std::uint8_t* chosen, float cut,
                  std::uint8_t* weights);

struct Pull {
    PlaneModel plane;
    float strength;  // weight of the plane where the voxel agrees, in units of the stored weights
    float reach;     // voxels that differ by this or more stay; more where they were seen seldom
};
// Voxels beyond this are nearly truncated: their distances tell no more.
inline constexpr int kPullLimit = 30000;
inline constexpr float kSeenOften = 16.0f * kWeightOne;  // sixteen observations
inline constexpr float kLeastSeen = 1.0f / 9;            // three times the reach at most

// Each distance joins the plane of the `count` (1 to 4) that it differs least from (the first, of equals),
// with
// r = the difference: W sdf + s plane over W + s, s = strength (1 - t)^2, t = (r / reach)^2 seen, W its
// stored weight, seen = W / kSeenOften, but from kLeastSeen to 1: the noise of a mean of k readings falls
// with sqrt(k). Those beyond kPullLimit or with W = 0 stay as they are.
void pull_to_planes(const std::int16_t* sdf, const std::uint16_t* weight, const Pull* pulls, int count,
                    std::int16_t* out);

namespace scalar {
int choose_voxels(const std::int16_t* sdf, const std::uint16_t* weight, std::uint16_t min_weight,
                  std::int16_t band, std::uint8_t* weights);
void sum_octants(const std::int16_t* sdf, const std::uint8_t* weights, PlaneSums sums[8]);
void plane_residuals(const std::int16_t* sdf, const PlaneModel& model, std::uint16_t* residuals);
int tukey_weights(const std::uint16_t* residuals, const std::uint8_t* chosen, float cut,
                  std::uint8_t* weights);
void pull_to_planes(const std::int16_t* sdf, const std::uint16_t* weight, const Pull* pulls, int count,
                    std::int16_t* out);
}  // namespace scalar

}  // namespace burin::simd
