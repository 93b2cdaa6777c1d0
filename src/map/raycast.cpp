// SPDX-License-Identifier: MIT
#include "map/raycast.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "map/sample.h"
#include "map/sample_batch.h"
#include "map/surface_bounds.h"
#include "simd/rays.h"

namespace burin {
namespace {

using simd::kRays;

constexpr int kSide = 8;  // pixels of a packet
static_assert(kSide * kSide == kRays && kRays <= simd::kSampleBatch);

struct View {
    const Volume& volume;
    const Camera& camera;
    const Se3& T_world_camera;
    float max_depth_m;
    LatticeFrame lattice;
    SurfaceBounds bounds;
    const RaycastImages& out;
};

// The rays of one square of pixels. One a thread; some 50 KiB.
class Caster {
  public:
    Caster(const View& view, int x0, int y0);
    void walk();
    void write();

  private:
    std::size_t pixel(int i) const {
        return static_cast<std::size_t>(y0_ + i / kSide) * static_cast<std::size_t>(view_.camera.width) +
               static_cast<std::size_t>(x0_ + i % kSide);
    }
    bool inside(int i) const {
        return x0_ + i % kSide < view_.camera.width && y0_ + i / kSide < view_.camera.height;
    }
    void read_nearest(std::uint64_t rays);
    void approach(std::uint64_t rays);
    void near_surface(int i, float d);
    void interpolate(bool with_gradients);
    void refine();

    // In the order of their alignment.
    simd::RayPacket rays_;
    alignas(64) std::int32_t readings_[kRays] = {};
    BatchSampler sampler_;
    const View& view_;
    std::uint64_t hits_ = 0;

    struct Entry {
        std::int32_t high = -1;  // RayPacket::chunk_high
        const ChunkGeometry* geometry = nullptr;
    };
    Entry memo_[512];  // by RayPacket::chunk_low

    Vec3d pixel_ray_[kRays];     // z = 1
    float voxels_per_z_[kRays];  // of the ray's length, a metre of depth
    // The rays whose field is interpolated, and where.
    struct Batch {
        int count = 0;
        int ray[kRays] = {};
        float t[kRays] = {};
        void add(int i, float at) {
            ray[count] = i;
            t[count++] = at;
        }
    };
    Batch batch_;
    float at_[3][kRays] = {};
    float distance_[kRays] = {}, gradient_[3][kRays] = {};

    float t_[2][kRays], d_[2][kRays];  // the crossing is between: d[0] > 0 >= d[1]
    const int x0_, y0_;
    const float units_, voxels_per_m_;  // voxels a stored unit, and a metre
    const LatticeFrame in_lattice_;     // of points that are in lattice coordinates already
};

Caster::Caster(const View& view, int x0, int y0)
    : sampler_(view.volume),
      view_(view),
      x0_(x0),
      y0_(y0),
      units_(view.volume.units_to_m() / view.volume.voxel_m()),
      voxels_per_m_(1.0f / view.volume.voxel_m()),
      in_lattice_{view.lattice.origin, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}}} {
    const float* m = view.lattice.map.m;
    const SurfaceBounds::Depths depths = view.bounds.at(x0, y0);
    // A ray may look behind its last chunk, as far as its longest step, and walk back from there.
    const float longest_step = view.volume.shape().truncation_m * voxels_per_m_;
    for (int k = 0; k < 3; ++k) rays_.start[k] = view.lattice.map.offset[k];
    for (int i = 0; i < kRays; ++i) {
        const int x = x0 + i % kSide, y = y0 + i / kSide;
        pixel_ray_[i] = unproject(view.camera, {static_cast<double>(x), static_cast<double>(y)});
        const Vec3f r = to_float(pixel_ray_[i]);
        const Vec3f along{m[0] * r.x + m[1] * r.y + m[2] * r.z, m[3] * r.x + m[4] * r.y + m[5] * r.z,
                          m[6] * r.x + m[7] * r.y + m[8] * r.z};
        const float length = norm(along);
        voxels_per_z_[i] = length;
        for (int k = 0; k < 3; ++k) {
            rays_.direction[k][i] = along[k] * (1.0f / length);
            rays_.inverse[k][i] = rays_.direction[k][i] != 0 ? 1.0f / rays_.direction[k][i] : 0.0f;
        }
        rays_.t[i] = depths.nearest_m * length;
        const bool any = inside(i) && depths.nearest_m <= depths.farthest_m;
        rays_.t_end[i] = any ? std::min({depths.farthest_m * length + longest_step, view.max_depth_m * length,
                                         simd::kRayLimit})
                             : -1.0f;
        rays_.front[i] = rays_.fine_end[i] = rays_.before_d[i] = -1.0f;
        rays_.before_t[i] = 0;
    }
}

// The first crossing from + to - on every ray.
void Caster::walk() {
    while (const std::uint64_t walking = simd::locate_voxels(&rays_)) {
        read_nearest(walking);
        approach(simd::step_rays(&rays_, readings_, units_));
    }
    refine();
}

void Caster::read_nearest(std::uint64_t rays) {
    for (; rays != 0; rays &= rays - 1) {
        const int i = std::countr_zero(rays);
        Entry& entry = memo_[rays_.chunk_low[i]];
        if (entry.high != rays_.chunk_high[i]) {
            const Vec3i& o = view_.lattice.origin;
            const Vec3i chunk{(o.x >> 3) + rays_.chunk[0][i], (o.y >> 3) + rays_.chunk[1][i],
                              (o.z >> 3) + rays_.chunk[2][i]};
            const std::uint32_t slot = chunk_in_range(chunk) ? view_.volume.find(pack_key(chunk)) : kNoChunk;
            entry = {rays_.chunk_high[i], slot == kNoChunk ? nullptr : &view_.volume.geometry(slot)};
        }
        const int v = rays_.voxel[i];
        readings_[i] = !entry.geometry                  ? simd::kNoChunkThere
                       : entry.geometry->weight[v] == 0 ? simd::kNotObserved
                                                        : entry.geometry->sdf[v];
    }
}

// distance_[n] in voxels, NaN where unknown, and gradient_ at every point of the batch.
void Caster::interpolate(bool with_gradients) {
    for (int k = 0; k < 3; ++k)
        for (int n = 0; n < batch_.count; ++n)
            at_[k][n] = rays_.start[k] + rays_.direction[k][batch_.ray[n]] * batch_.t[n];
    float* const gradients[3] = {gradient_[0], gradient_[1], gradient_[2]};
    sampler_.sample(in_lattice_, at_[0], at_[1], at_[2], static_cast<std::size_t>(batch_.count), distance_,
                    with_gradients ? gradients : nullptr);
    for (int n = 0; n < batch_.count; ++n) distance_[n] *= voxels_per_m_;
}

void Caster::approach(std::uint64_t rays) {
    if (rays == 0) return;
    batch_.count = 0;
    for (; rays != 0; rays &= rays - 1) {
        const int i = std::countr_zero(rays);
        batch_.add(i, rays_.t[i]);
    }
    interpolate(false);
    for (int n = 0; n < batch_.count; ++n) near_surface(batch_.ray[n], distance_[n]);
}

// The other half of simd::step_rays: ray i reads d, NaN when a voxel of the cell was never observed.
void Caster::near_surface(int i, float d) {
    const float t = rays_.t[i];
    const bool fine = t < rays_.fine_end[i];
    if (d <= 0 && rays_.before_d[i] > 0) {
        hits_ |= std::uint64_t{1} << i;
        t_[0][i] = rays_.before_t[i];
        d_[0][i] = rays_.before_d[i];
        t_[1][i] = t;
        d_[1][i] = d;
        rays_.t_end[i] = -1;
        return;
    }
    if (d > 0) {
        rays_.before_d[i] = d;
        rays_.before_t[i] = t;
        if (!fine) rays_.front[i] = t;
        rays_.t[i] = t + (fine ? simd::kShortStep : std::max(simd::kLongStep * d, 0.25f));
        return;
    }
    rays_.before_d[i] = -1;
    if (rays_.front[i] >= 0) {
        rays_.fine_end[i] = t;
        rays_.t[i] = rays_.front[i];
        rays_.front[i] = -1;
    } else {
        // A thin known layer in front of the surface must not be jumped over: the nearest voxel is known from
        // half a voxel before its centre on, a cell only from there.
        rays_.t[i] = t + (fine ? simd::kShortStep : 0.25f);
    }
}

// The crossing by linear interpolation, and once more since the field is only nearly linear.
void Caster::refine() {
    const auto between = [&](int i) {
        return t_[0][i] + (t_[1][i] - t_[0][i]) * d_[0][i] / (d_[0][i] - d_[1][i]);
    };
    batch_.count = 0;
    for (std::uint64_t hits = hits_; hits != 0; hits &= hits - 1) {
        const int i = std::countr_zero(hits);
        batch_.add(i, between(i));
    }
    interpolate(false);
    for (int n = 0; n < batch_.count; ++n) {
        const int i = batch_.ray[n];
        const float d = distance_[n];
        if (d == d) {
            const int end = d > 0 ? 0 : 1;
            t_[end][i] = batch_.t[n];
            d_[end][i] = d;
            batch_.t[n] = between(i);
        }
        rays_.t[i] = batch_.t[n];
    }
    if (view_.out.normals) interpolate(true);
}

void Caster::write() {
    const RaycastImages& out = view_.out;
    Sampler colours(view_.volume);
    int n = 0;  // of the hits
    for (int i = 0; i < kRays; ++i) {
        const bool hit = hits_ >> i & 1;
        const int at = n;
        n += hit;
        if (!inside(i)) continue;
        const float depth = hit ? rays_.t[i] / voxels_per_z_[i] : 0.0f;
        if (out.depth_m) out.depth_m[pixel(i)] = depth;
        if (out.normals) {
            Vec3f normal{};
            if (hit && gradient_[0][at] == gradient_[0][at])
                normal = normalised(Vec3f{gradient_[0][at], gradient_[1][at], gradient_[2][at]});
            for (int k = 0; k < 3; ++k) out.normals[3 * pixel(i) + static_cast<std::size_t>(k)] = normal[k];
        }
        if (out.rgb) {
            float rgb[3] = {};
            if (hit &&
                !colours.colour(view_.T_world_camera * (pixel_ray_[i] * static_cast<double>(depth)), rgb))
                rgb[0] = rgb[1] = rgb[2] = 255;
            for (int k = 0; k < 3; ++k)
                out.rgb[3 * pixel(i) + static_cast<std::size_t>(k)] =
                    static_cast<std::uint8_t>(rgb[k] + 0.5f);
        }
    }
}

}  // namespace

void raycast(const Volume& volume, const Camera& camera, const Se3& T, float max_depth_m,
             const RaycastImages& out, Jobs& jobs) {
    const View view{volume,
                    camera,
                    T,
                    max_depth_m,
                    LatticeFrame(volume, T),
                    SurfaceBounds(volume, camera, T, max_depth_m, jobs),
                    out};
    const int columns = (camera.width + kSide - 1) / kSide, rows = (camera.height + kSide - 1) / kSide;
    jobs.run(columns * rows, [&](int square, int) {
        Caster caster(view, square % columns * kSide, square / columns * kSide);
        caster.walk();
        caster.write();
    });
}

}  // namespace burin
