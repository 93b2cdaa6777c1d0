// SPDX-License-Identifier: MIT
// Inside of the integrator: what all chunks of a frame share, and where a chunk stands in the image.
#pragma once

#include <algorithm>
#include <cmath>

#include "map/integrator.h"
#include "map/projector.h"

namespace burin {

struct Integrator::Job {
    Volume& volume;
    Jobs& jobs;
    const DepthImage& image;
    const DepthRanges& ranges;
    const simd::DepthProjection& projection;
    std::uint32_t frame_number;
    float units_per_raw;  // stored units a step of the depth image
    bool along_ray;
    float group_reach;  // chunks whose groups reach less far are projected by groups; 0: none
    Vec3i origin;       // chunk that chunk_projection counts from
    simd::ChunkProjection chunk_projection;
    bool with_colour;
    simd::ColourFrame colour;
    std::int16_t colour_band;  // voxels with |distance| up to this take colour
    std::uint16_t mesh_band;   // steps of voxels with |sdf| up to this move the mesh
    Projector colour_projector;
    const FrameView& frame;  // for its colour, where the format is not RGB
    Vec3i camera;            // the chunk that it is in
    ChunkStore* store;
};

// A relative error of sums of four products in single precision is below 16 of its steps.
inline constexpr float kRounding = 1e-6f;

// Fills in where a chunk of a projected batch stands in the image, in place: a copy of what was written in
// pieces waits for the pieces. And the range of depth where it falls (in stored units; most < 0 when there is
// no reading).
struct ChunkReach {
    simd::ProjectedChunk& projected;
    float least, most;

    template <class Job>  // Integrator::Job
    ChunkReach(const Job& job, const simd::ChunkBatch& batch, int i, simd::ProjectedChunk* out)
        : projected(*out) {
        projected.u = batch.base_u[i];
        projected.v = batch.base_v[i];
        projected.z = batch.base_z[i];
        projected.far = projected.inside = false;
        projected.pixels = simd::Pixels::exact;
        projected.along = 1.0f;
        DepthRange range = job.ranges.all();
        // Nearer than the truncation, pixels may mean nothing, and missing readings need a test of their own.
        if (batch.least_z[i] > 32800.0f) {
            const float u0 = batch.least_u[i], u1 = batch.most_u[i], v0 = batch.least_v[i],
                        v1 = batch.most_v[i];
            // Nearest pixels of the image without its border, half a pixel, and a tenth for affine groups,
            // around.
            const auto pixel = [](float x) { return static_cast<int>(std::min(std::max(x, 0.0f), 1e6f)); };
            range =
                job.ranges.over(pixel(u0 - 1.61f), pixel(v0 - 1.61f), pixel(u1 - 0.39f), pixel(v1 - 0.39f));
            projected.far = true;
            projected.inside = u0 > 1 && v0 > 1 && u1 < static_cast<float>(job.image.width) &&
                               v1 < static_cast<float>(job.image.height);
            const float reach = batch.group_reach[i];
            if (projected.inside && reach < job.group_reach)
                projected.pixels = reach < simd::kNarrowReach ? simd::Pixels::narrow
                                   : reach < simd::kWideReach ? simd::Pixels::wide
                                                              : simd::Pixels::exact;
        }
        if (job.along_ray) projected.along = ray_length(job, batch, i);
        least = static_cast<float>(range.least) * job.units_per_raw;
        most = range.largest == 0 ? -1.0f : static_cast<float>(range.largest) * job.units_per_raw;
    }

    // Might a voxel of the chunk, whose nearest lies at least_z, be free?
    bool may_be_free(float least_z) const {
        return most >= (least_z + 32767.0f / projected.along) * (1 - kRounding);
    }

  private:
    // Length of the ray with z = 1 through the middle of the chunk: distances along the ray are so much
    // longer than along z. It changes by a few percent over a chunk and does not move the zero, so one serves
    // all its voxels.
    template <class Job>
    static float ray_length(const Job& job, const simd::ChunkBatch& batch, int i) {
        const simd::ChunkProjection& p = job.chunk_projection;
        const Camera& c = job.image.camera;
        const float z = std::max(batch.base_z[i] + 0.5f * p.corner_z[7], 1.0f);
        // Clipped to the image: where the middle lies beside it or behind the camera, the voxels seen do not.
        const float u = std::clamp((batch.base_u[i] + 0.5f * p.corner_u[7]) / z - 1.0f, 0.0f,
                                   static_cast<float>(job.image.width - 1));
        const float v = std::clamp((batch.base_v[i] + 0.5f * p.corner_v[7]) / z - 1.0f, 0.0f,
                                   static_cast<float>(job.image.height - 1));
        const float x = (u - static_cast<float>(c.cx)) / static_cast<float>(c.fx);
        const float y = (v - static_cast<float>(c.cy)) / static_cast<float>(c.fy);
        return std::sqrt(1.0f + x * x + y * y);
    }
};

}  // namespace burin
