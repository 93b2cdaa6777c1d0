// SPDX-License-Identifier: MIT
// The kernel of track.h, up to 16 points at a time: the same operations in the same order a lane.
#include "simd/track.h"

#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/track_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

void TrackSumsKernel(const TrackSamples& in, int count, const float R[9], const TrackRobust& robust,
                     TrackSums sums, float* normalised) {
    scalar::track_sums(in, count, R, robust, sums, normalised);
}

#else

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, kTrackLanes>;
using VF = hn::Vec<DF>;

// sums[term] += v in the lanes from `lane` on.
HWY_INLINE void AddTo(TrackSums sums, int term, int lane, VF v) {
    const DF df;
    hn::StoreU(hn::Add(hn::LoadU(df, sums[term] + lane), v), df, sums[term] + lane);
}

void TrackSumsKernel(const TrackSamples& in, int count, const float R[9], const TrackRobust& robust,
                     TrackSums sums, float* normalised) {
    const DF df;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto k = hn::Set(df, robust.threshold), inverse_k = hn::Set(df, 1.0f / robust.threshold),
               one = hn::Set(df, 1.0f), half_k = hn::Set(df, 0.5f * robust.threshold),
               limit = hn::Set(df, robust.limit_m), inverse_scale = hn::Set(df, robust.inverse_scale),
               most = hn::Set(df, robust.threshold * robust.threshold * (1.0f / 6.0f));
    for (int i = 0; i < count; i += lanes) {
        const auto d = hn::LoadU(df, in.distance + i);
        const auto there = hn::FirstN(df, static_cast<std::size_t>(count - i));
        const auto valid = hn::And(hn::Lt(hn::Abs(d), limit), there);
        if (hn::AllFalse(df, valid)) {
            hn::StoreU(hn::Set(df, -1.0f), df, normalised + i);
            continue;
        }
        const auto s = hn::IfThenElseZero(valid, hn::LoadU(df, in.inverse_sigma + i));
        const auto x = hn::IfThenElseZero(valid, hn::LoadU(df, in.x + i));
        const auto y = hn::IfThenElseZero(valid, hn::LoadU(df, in.y + i));
        const auto z = hn::IfThenElseZero(valid, hn::LoadU(df, in.z + i));
        // Not in arrays: vectors of SVE have no size.
        const auto gradient = [&](int r) {
            return hn::Mul(hn::IfThenElseZero(valid, hn::LoadU(df, in.gradient[r] + i)), s);
        };
        const auto g0 = gradient(0), g1 = gradient(1), g2 = gradient(2);
        const auto turned = [&](int c) {
            return hn::Add(hn::Add(hn::Mul(hn::Set(df, R[c]), g0), hn::Mul(hn::Set(df, R[3 + c]), g1)),
                           hn::Mul(hn::Set(df, R[6 + c]), g2));
        };
        const auto j0 = turned(0), j1 = turned(1), j2 = turned(2);
        const auto j3 = hn::Sub(hn::Mul(y, j2), hn::Mul(z, j1));
        const auto j4 = hn::Sub(hn::Mul(z, j0), hn::Mul(x, j2));
        const auto j5 = hn::Sub(hn::Mul(x, j1), hn::Mul(y, j0));
        const auto u = hn::Mul(hn::Mul(hn::IfThenElseZero(valid, d), s), inverse_scale);
        const auto a = hn::Abs(u);
        VF w, cost;
        if (robust.tukey) {
            const auto q = hn::Mul(u, inverse_k);
            const auto inside = hn::Sub(one, hn::Mul(q, q));
            const auto rest = hn::IfThenElseZero(hn::Gt(inside, hn::Zero(df)), inside);
            w = hn::Mul(rest, rest);
            cost = hn::Mul(most, hn::Sub(one, hn::Mul(w, rest)));
        } else {
            w = hn::IfThenElse(hn::Gt(a, k), hn::Div(k, a), one);
            cost = hn::IfThenElse(hn::Lt(a, k), hn::Mul(hn::Set(df, 0.5f), hn::Mul(u, u)),
                                  hn::Mul(k, hn::Sub(a, half_k)));
        }
        hn::StoreU(hn::IfThenElse(valid, a, hn::Set(df, -1.0f)), df, normalised + i);
        const int lane = i % kTrackLanes;
        int term = kTrackA, row = 0;
        const auto add_row = [&](VF jr, auto... rest) {
            const auto wj = hn::Mul(w, jr);
            AddTo(sums, term++, lane, hn::Mul(wj, jr));
            (AddTo(sums, term++, lane, hn::Mul(wj, rest)), ...);
            AddTo(sums, kTrackB + row++, lane, hn::Mul(wj, u));
        };
        add_row(j0, j1, j2, j3, j4, j5);
        add_row(j1, j2, j3, j4, j5);
        add_row(j2, j3, j4, j5);
        add_row(j3, j4, j5);
        add_row(j4, j5);
        add_row(j5);
        AddTo(sums, kTrackCost, lane, hn::IfThenElseZero(valid, cost));
        AddTo(sums, kTrackPoints, lane, hn::IfThenElseZero(valid, one));
        AddTo(sums, kTrackInliers, lane, hn::IfThenElseZero(hn::And(valid, hn::Lt(a, k)), one));
    }
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(TrackSumsKernel);

void track_sums(const TrackSamples& in, int count, const float R[9], const TrackRobust& robust,
                TrackSums sums, float* normalised) {
    if (scalar_selected()) return scalar::track_sums(in, count, R, robust, sums, normalised);
    BURIN_DISPATCH(TrackSumsKernel)(in, count, R, robust, sums, normalised);
}

}  // namespace burin::simd
#endif
