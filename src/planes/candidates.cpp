// SPDX-License-Identifier: MIT
#include "planes/candidates.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "simd/plane_fit.h"
#include "simd/tsdf.h"

namespace burin {
namespace {

using simd::PlaneModel;
using simd::PlaneSums;

constexpr float kBand = 0.6f;     // of the truncation: distances beyond hold more of it than of the surface
constexpr int kLeastVoxels = 40;  // a plane through a chunk has 64 voxels within half a voxel
constexpr int kLeastLeft = 64;    // of what one plane leaves, for another: fewer are its noise
constexpr float kFlat = 0.15f;    // of the truncation: rms of what is still a plane, not a curve or clutter
constexpr float kTukey = 4.685f;  // 95 % efficiency for normal residuals
constexpr float kMadToSigma = 1.4826f;
constexpr float kLeastSigma = 0.02f;  // voxels: below, quantisation and interpolation rule
constexpr float kMostSigma = 0.15f;   // of the truncation
constexpr float kInlierShare = 0.6f;  // of the voxels near a plane that must agree with it
// The same for one plane of several: at a corner of three it holds 16 of the 41 voxels near it that are
// within the band.
constexpr float kInlierShareOfSome = 0.35f;
constexpr int kIterations = 3;
constexpr std::uint16_t kMinWeight = simd::kWeightOne;  // one observation: less is the rim of what was seen

// f = a . u + c by least squares: Cholesky on the 4x4 normal equations. False: the voxels do not span it.
// Where `flat` is an axis, a[flat] is given (by `slope`) and not sought.
bool solve(const PlaneSums& s, int flat, float slope, PlaneModel* out) {
    // The constant first: the other pivots are then variances of the voxels about their mean.
    double m[4][4] = {}, b[4];
    m[0][0] = s.w;
    b[0] = s.f;
    const double given = flat < 3 ? static_cast<double>(slope) : 0;
    int at = 0;
    for (int r = 0; r < 3; ++r) {
        m[r + 1][0] = s.u[r];
        b[r + 1] = s.fu[r];
        for (int c = r; c < 3; ++c) m[c + 1][r + 1] = s.uu[at++];
    }
    if (flat < 3) {
        for (int r = 0; r < 3; ++r) {
            double& product = r < flat ? m[flat + 1][r + 1] : m[r + 1][flat + 1];
            b[r + 1] -= given * product;
            if (r != flat) product = 0;
        }
        b[0] -= given * m[flat + 1][0];
        m[flat + 1][0] = 0;
        m[flat + 1][flat + 1] = s.w;
        b[flat + 1] = given * s.w;
    }
    for (int j = 0; j < 4; ++j) {
        for (int k = 0; k < j; ++k) m[j][j] -= m[j][k] * m[j][k];
        // A quarter of a voxel (u is in half voxels) is the least spread that holds a direction.
        if (!(m[j][j] > 0.25 * s.w)) return false;
        m[j][j] = std::sqrt(m[j][j]);
        for (int i = j + 1; i < 4; ++i) {
            for (int k = 0; k < j; ++k) m[i][j] -= m[i][k] * m[j][k];
            m[i][j] /= m[j][j];
        }
    }
    for (int i = 0; i < 4; ++i) {
        for (int k = 0; k < i; ++k) b[i] -= m[i][k] * b[k];
        b[i] /= m[i][i];
    }
    for (int i = 3; i >= 0; --i) {
        for (int k = i + 1; k < 4; ++k) b[i] -= m[k][i] * b[k];
        b[i] /= m[i][i];
    }
    for (int r = 0; r < 3; ++r) out->a[r] = static_cast<float>(b[r + 1]);
    out->c = static_cast<float>(b[0]);
    return true;
}

// The median of the residuals of the chosen voxels that are `within`, to one part in 256 of `most`: by
// bisection, since counting is what vectors are good at.
float median(const std::uint16_t* residuals, const std::uint8_t* chosen, float within, float most) {
    std::uint16_t masked[512], count = 0;
    const auto limit = static_cast<std::uint16_t>(std::min(within, 65534.0f));
    for (int i = 0; i < 512; ++i) {
        masked[i] = static_cast<std::uint16_t>(residuals[i] | (chosen[i] ? 0 : 0xffff));
        masked[i] = masked[i] <= limit ? masked[i] : std::uint16_t{0xffff};
        count = static_cast<std::uint16_t>(count + (masked[i] != 0xffff));
    }
    int low = 0, high = static_cast<int>(std::min(most, 65534.0f));
    const int step = std::max(1, high / 256);
    while (high - low > step) {
        const auto middle = static_cast<std::uint16_t>((low + high) / 2);
        std::uint16_t below = 0;
        for (int i = 0; i < 512; ++i) below = static_cast<std::uint16_t>(below + (masked[i] <= middle));
        (2 * below > count ? high : low) = middle;
    }
    return 0.5f * static_cast<float>(low + high);
}

class ChunkFit {
  public:
    ChunkFit(const Volume& volume, std::uint32_t slot)
        : volume_(volume), chunk_(volume.geometry(slot)), key_(volume.key(slot)), voxel_m_(volume.voxel_m()) {
        units_per_voxel_ = voxel_m_ / volume.units_to_m();
        const float band = std::max(kBand * 32767.0f, std::min(2 * units_per_voxel_, 30000.0f));
        left_ = simd::choose_voxels(chunk_.sdf, chunk_.weight, kMinWeight, static_cast<std::int16_t>(band),
                                    chosen_);
    }
    int left() const { return left_; }
    // One plane among the chosen voxels; those that belong to it are then no longer chosen.
    bool next(Patch* out) {
        PlaneSums octants[8], all;
        simd::sum_octants(chunk_.sdf, chosen_, octants);
        for (const PlaneSums& s : octants) all += s;
        PlaneModel model;
        // The whole chunk as one plane; where that does not hold, the octant whose plane most voxels share.
        find_flat(all);
        if (flat_ == 3 && !in_front()) return false;
        if (!(solve(all, flat_, slope_, &model) && settle(&model, 65535, kInlierShare))) {
            flat_ = 3;
            int most = kLeastVoxels - 1;
            PlaneModel best;
            for (const PlaneSums& s : octants) {
                if (s.w < 16 * simd::kFullWeight || !solve(s, flat_, slope_, &model)) continue;
                const int votes = count_near(model);
                if (votes > most) most = votes, best = model;
            }
            if (most < kLeastVoxels) return false;
            model = best;
            if (!settle(&model, 2 * kFlat * 32767.0f, kInlierShareOfSome)) return false;
        }
        describe(model, out);
        const auto taken = static_cast<std::uint16_t>(std::min(cut_, 65535.0f));
        std::uint16_t left = 0;
        for (int i = 0; i < 512; ++i) {
            chosen_[i] = residuals_[i] < taken ? std::uint8_t{0} : chosen_[i];
            left = static_cast<std::uint16_t>(left + (chosen_[i] != 0));
        }
        left_ = left;
        return true;
    }

  private:
    // Some of the voxels lie in front of the surface. Where none do, and there is more than a layer, it
    // passes in the next chunk, whose own voxels in front of it tell of it.
    bool in_front() const {
        bool any = false;
        for (int i = 0; i < 512; ++i) any |= (chosen_[i] != 0) & (chunk_.sdf[i] >= 0);
        return any;
    }

    // Seen aslant, distances grow so fast that a plane between two chunks leaves one layer of voxels within
    // the truncation in each: the slope across it then comes from the layers at its sides.
    void find_flat(const PlaneSums& all) {
        flat_ = 3;
        if (all.w == 0) return;
        static constexpr int kSquare[3] = {0, 3, 5};
        for (int k = 0; k < 3 && flat_ == 3; ++k)
            if (std::int64_t{all.uu[kSquare[k]]} * all.w == std::int64_t{all.u[k]} * all.u[k]) flat_ = k;
        if (flat_ == 3) return;
        const int layer = (all.u[flat_] / all.w + 7) / 2;
        float steepest = 0;
        for (int side = -1; side <= 1; side += 2) {
            const int at = layer + side;
            Vec3i c = unpack_key(key_);
            c[flat_] += at >> 3;
            const std::uint32_t slot = chunk_in_range(c) ? volume_.find(pack_key(c)) : kNoChunk;
            if (slot == kNoChunk) continue;
            const ChunkGeometry& beside = volume_.geometry(slot);
            std::int32_t sum = 0, count = 0;
            for (int i = 0; i < 512; ++i) {
                if (!chosen_[i]) continue;
                const int step = flat_ == 0 ? 1 : flat_ == 1 ? 8 : 64, j = i + ((at & 7) - layer) * step;
                if (beside.weight[j] < kMinWeight) continue;
                sum += side * (beside.sdf[j] - chunk_.sdf[i]);
                ++count;
            }
            if (count == 0) continue;
            // Half, since u counts half voxels. Truncation makes slopes smaller, never larger.
            const float slope = 0.5f * static_cast<float>(sum) / static_cast<float>(count);
            if (std::fabs(slope) > std::fabs(steepest)) steepest = slope;
        }
        slope_ = steepest;
    }

    static float length(const PlaneModel& m) {
        return std::sqrt((m.a[0] * m.a[0] + m.a[1] * m.a[1]) + m.a[2] * m.a[2]);
    }
    // Units of stored distance along the normal for a voxel: u counts half voxels.
    float stretch(const PlaneModel& m) const { return 2 * length(m) / units_per_voxel_; }

    int count_near(const PlaneModel& model) {
        const float s = stretch(model);
        if (!plausible(s)) return 0;
        simd::plane_residuals(chunk_.sdf, model, residuals_);
        return simd::tukey_weights(residuals_, chosen_, 2 * kFlat * 32767.0f, weights_) / simd::kFullWeight;
    }
    // Distances along the optical axis grow by 1 / cos of the angle of view; below 1 only by noise.
    static bool plausible(float s) { return s > 0.6f && s < 5; }

    // Iteratively re-weighted least squares from `model`. True when what is left is a plane.
    // within: residuals of voxels that the scale is taken from.
    bool settle(PlaneModel* model, float within, float least_share) {
        float sigma = 0;
        for (int i = 0; i < kIterations; ++i) {
            const float s = stretch(*model), voxel = units_per_voxel_ * s;
            if (!plausible(s)) return false;
            simd::plane_residuals(chunk_.sdf, *model, residuals_);
            // The scale settles before the plane does.
            if (i < kIterations - 1) {
                const float mad = median(residuals_, chosen_, within, 4 * voxel);
                sigma = std::clamp(kMadToSigma * mad, kLeastSigma * voxel,
                                   std::max(kMostSigma * 32767.0f, kLeastSigma * voxel));
            }
            cut_ = kTukey * sigma;
            if (simd::tukey_weights(residuals_, chosen_, cut_, weights_) <
                kLeastVoxels * simd::kFullWeight / 2)
                return false;
            PlaneSums octants[8];
            simd::sum_octants(chunk_.sdf, weights_, octants);
            sums_ = {};
            for (const PlaneSums& o : octants) sums_ += o;
            const PlaneModel before = *model;
            if (!solve(sums_, flat_, slope_, model)) return false;
            // Nowhere in the chunk farther than a fiftieth of a voxel from the last: settled.
            float change = std::fabs(model->c - before.c);
            for (int r = 0; r < 3; ++r) change += 7 * std::fabs(model->a[r] - before.a[r]);
            if (change < 0.02f * voxel) break;
        }
        const float s = stretch(*model), voxel = units_per_voxel_ * s;
        if (!plausible(s)) return false;
        simd::plane_residuals(chunk_.sdf, *model, residuals_);
        return judge(*model, voxel, least_share);
    }

    // Enough voxels, close enough, and few others beside the plane that contradict it.
    bool judge(const PlaneModel& model, float voxel, float least_share) {
        // Whole numbers, 128 units (1/256 of the truncation) a step, so that the loops become vectors.
        std::int32_t squares = 0, weight = 0, near = 0, agree = 0;
        for (int i = 0; i < 512; ++i) {
            const std::int32_t w = weights_[i], q = (residuals_[i] + 64) >> 7;
            weight += w;
            squares += w * q * q;
        }
        // Where the plane would have surface, within a voxel of it, its voxels have to agree.
        for (int row = 0; row < 64; ++row) {
            const float y = static_cast<float>(2 * (row & 7) - 7), z = static_cast<float>(2 * (row >> 3) - 7);
            const float base = (model.a[1] * y + model.a[2] * z) + model.c;
            const std::uint8_t *chosen = chosen_ + 8 * row, *weights = weights_ + 8 * row;
            for (int x = 0; x < 8; ++x) {
                const float at = base + model.a[0] * static_cast<float>(2 * x - 7);
                const int here = (std::fabs(at) <= voxel) & (chosen[x] != 0);
                near += here;
                agree += here & (weights[x] != 0);
            }
        }
        if (weight == 0 || near == 0) return false;
        rms_voxels_ = 128 * std::sqrt(static_cast<float>(squares) / static_cast<float>(weight)) / voxel;
        return weight >= kLeastVoxels * simd::kFullWeight && rms_voxels_ * voxel <= kFlat * 32767.0f &&
               static_cast<float>(agree) >= least_share * static_cast<float>(near);
    }

    void describe(const PlaneModel& m, Patch* out) const {
        *out = {};
        const float inverse = 1 / length(m), half = 0.5f * voxel_m_;
        const double h = static_cast<double>(half);
        for (int r = 0; r < 3; ++r) out->normal[r] = m.a[r] * inverse;
        out->offset = m.c * inverse * half;
        out->stretch = stretch(m);
        out->rms_m = rms_voxels_ * voxel_m_;
        out->plane = kNoPlane;
        out->axis = static_cast<std::uint8_t>(Axes(out->unit_normal()).axis);

        // Foot points p = x - n (n . x + offset): their sums from those of x.
        const Vec3d n = out->unit_normal();
        const double w = static_cast<double>(sums_.w), d = static_cast<double>(out->offset);
        const Vec3d x = Vec3d{h * sums_.u[0], h * sums_.u[1], h * sums_.u[2]};
        double xx[3][3];
        int at = 0;
        for (int r = 0; r < 3; ++r)
            for (int c = r; c < 3; ++c) xx[r][c] = xx[c][r] = h * h * sums_.uu[at++];
        // p = P x - n d with P = I - n n^T: sum p = P sum x - n d w, sum p p^T = P X P - d (P s n^T + n s^T
        // P) + w d^2 n n^T.
        Vec3d Xn;  // X n
        for (int r = 0; r < 3; ++r) Xn[r] = (xx[r][0] * n.x + xx[r][1] * n.y) + xx[r][2] * n.z;
        const double nXn = dot(n, Xn);
        const Vec3d Ps = x - n * dot(n, x);
        const double unit = 1.0 / simd::kFullWeight,
                     spread = static_cast<double>(out->rms_m) * static_cast<double>(out->rms_m);
        out->n = static_cast<float>(w * unit);
        at = 0;
        for (int r = 0; r < 3; ++r) {
            out->p[r] = static_cast<float>((Ps[r] - n[r] * (d * w)) * unit);
            for (int c = r; c < 3; ++c) {
                const double pxp = xx[r][c] - n[r] * Xn[c] - Xn[r] * n[c] + n[r] * n[c] * nXn;
                const double pp =
                    pxp - d * (Ps[r] * n[c] + n[r] * Ps[c]) + w * (d * d + spread) * n[r] * n[c];
                out->pp[at++] = static_cast<float>(pp * unit);
            }
        }
        mark_cells(out);
    }

    // Columns with a voxel of the plane where the surface passes: within half a voxel along the axis, and
    // some noise.
    void mark_cells(Patch* out) const {
        const float most = 0.6f * units_per_voxel_ * out->stretch * std::fabs(out->normal[out->axis]);
        const auto limit = static_cast<std::int16_t>(std::min(most, 32767.0f));
        std::uint8_t here[512];
        for (int i = 0; i < 512; ++i)
            here[i] = (chunk_.sdf[i] <= limit) & (chunk_.sdf[i] >= -limit) & (weights_[i] != 0);
        for (int row = 0; row < 64; ++row) {  // y + 8 z
            std::uint64_t eight;
            std::memcpy(&eight, here + 8 * row, 8);
            // The eight bytes of 0 or 1 as the highest byte of the product: byte x is bit x (little-endian).
            const std::uint64_t bits = eight * 0x0102040810204080u >> 56;
            if (out->axis == 2) out->cells |= bits << (8 * (row & 7));
            if (out->axis == 1) out->cells |= bits << (8 * (row >> 3));
            if (out->axis == 0) out->cells |= std::uint64_t{bits != 0} << row;
        }
    }

    const Volume& volume_;
    const ChunkGeometry& chunk_;
    ChunkKey key_;
    float units_per_voxel_, voxel_m_;
    int flat_ = 3;  // the axis along which all chosen voxels are in one layer; 3: none
    float slope_ = 0;
    int left_ = 0;
    float cut_ = 0, rms_voxels_ = 0;
    PlaneSums sums_;
    alignas(64) std::uint8_t chosen_[512], weights_[512];
    alignas(64) std::uint16_t residuals_[512];
};

}  // namespace

Axes::Axes(Vec3d normal) {
    int facing = 0;
    for (int r = 1; r < 3; ++r)
        if (std::fabs(normal[r]) > std::fabs(normal[facing])) facing = r;
    *this = Axes(facing);
}

Vec3d Patch::middle(Vec3d centre) const {
    return centre + Vec3d{p[0], p[1], p[2]} * (1 / static_cast<double>(n));
}

Scatter Patch::scatter(Vec3d c) const {
    Scatter s;
    s.n = static_cast<double>(n);
    const Vec3d q{p[0], p[1], p[2]};
    s.p = q + c * s.n;
    int at = 0;
    for (int r = 0; r < 3; ++r)
        for (int k = r; k < 3; ++k, ++at)
            s.pp[at] = static_cast<double>(pp[at]) + q[r] * c[k] + c[r] * q[k] + s.n * c[r] * c[k];
    return s;
}

int find_candidates(const Volume& volume, std::uint32_t slot, Patch* out) {
    ChunkFit fit(volume, slot);
    int count = 0;
    while (count < kChunkPlanes && fit.left() >= (count == 0 ? kLeastVoxels : kLeastLeft) &&
           fit.next(out + count))
        ++count;
    return count;
}

}  // namespace burin
