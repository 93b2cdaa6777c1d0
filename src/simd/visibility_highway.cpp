// SPDX-License-Identifier: MIT
// The kernels of visibility.h: a chunk, or a tile, a lane.
#include "simd/visibility.h"

#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/visibility_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"
#include "simd/vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

void ProjectChunks(const ChunkProjection& projection, ChunkBatch* batch) {
    scalar::project_chunks(projection, batch);
}
void DoubleRanges(const std::uint32_t* from, int count, int stride, int side, std::uint32_t* to) {
    scalar::double_ranges(from, count, stride, side, to);
}

#else

void ProjectChunks(const ChunkProjection& p, ChunkBatch* batch) {
    const DF df;
    const DI di;
    const auto one = hn::Set(df, 1.0f);
    for (std::size_t i = 0; i < kBatchChunks; i += hn::Lanes(df)) {
        const auto x = hn::ConvertTo(df, hn::Load(di, batch->x + i));
        const auto y = hn::ConvertTo(df, hn::Load(di, batch->y + i));
        const auto z = hn::ConvertTo(df, hn::Load(di, batch->z + i));
        const auto at = [&](const float step[3], float origin) {
            const auto xy = hn::Add(hn::Mul(x, hn::Set(df, step[0])), hn::Mul(y, hn::Set(df, step[1])));
            return hn::Add(hn::Add(xy, hn::Mul(z, hn::Set(df, step[2]))), hn::Set(df, origin));
        };
        const auto u = at(p.step_u, p.origin_u), v = at(p.step_v, p.origin_v), w = at(p.step_z, p.origin_z);
        hn::Store(u, df, batch->base_u + i);
        hn::Store(v, df, batch->base_v + i);
        hn::Store(w, df, batch->base_z + i);
        auto least_u = hn::Zero(df), most_u = least_u, least_v = least_u, most_v = least_u, least_z = least_u,
             most_z = least_u;
        for (int k = 0; k < 8; ++k) {
            const auto corner_z = hn::Add(w, hn::Set(df, p.corner_z[k]));
            const auto inverse_z = hn::Div(one, corner_z);
            const auto corner_u = hn::Mul(hn::Add(u, hn::Set(df, p.corner_u[k])), inverse_z);
            const auto corner_v = hn::Mul(hn::Add(v, hn::Set(df, p.corner_v[k])), inverse_z);
            // Comparisons, not Min and Max, whose answer to a NaN differs from target to target.
            const auto less = [&](auto a, auto b) { return k == 0 ? b : hn::IfThenElse(hn::Lt(a, b), a, b); };
            const auto more = [&](auto a, auto b) { return k == 0 ? b : hn::IfThenElse(hn::Gt(a, b), a, b); };
            least_u = less(least_u, corner_u);
            most_u = more(most_u, corner_u);
            least_v = less(least_v, corner_v);
            most_v = more(most_v, corner_v);
            least_z = less(least_z, corner_z);
            most_z = more(most_z, corner_z);
        }
        const auto larger = [](auto a, auto b) { return hn::IfThenElse(hn::Gt(a, b), a, b); };
        const auto steps = [&](const float pixel[3], const float depth[3], auto low, auto high) {
            const auto step = [&](int axis) {
                const auto across = hn::Set(df, pixel[axis]), along = hn::Set(df, depth[axis]);
                return larger(hn::Abs(hn::Sub(across, hn::Mul(low, along))),
                              hn::Abs(hn::Sub(across, hn::Mul(high, along))));
            };
            return hn::Add(hn::Mul(hn::Set(df, 1.5f), hn::Add(step(0), step(1))),
                           hn::Mul(hn::Set(df, 0.5f), step(2)));
        };
        const auto shear = [&](float centre, auto low, auto high) {
            const auto c = hn::Set(df, centre);
            return hn::Mul(hn::Set(df, p.most_z),
                           larger(hn::Abs(hn::Sub(c, low)), hn::Abs(hn::Sub(c, high))));
        };
        const auto across = larger(steps(p.voxel_u, p.voxel_z, least_u, most_u),
                                   steps(p.voxel_v, p.voxel_z, least_v, most_v));
        const auto sheared = larger(shear(p.centre_u, least_u, most_u), shear(p.centre_v, least_v, most_v));
        const auto reach = larger(larger(across, sheared), hn::Set(df, p.most_across));
        hn::Store(hn::Div(reach, least_z), df, batch->group_reach + i);
        hn::Store(least_u, df, batch->least_u + i);
        hn::Store(most_u, df, batch->most_u + i);
        hn::Store(least_v, df, batch->least_v + i);
        hn::Store(most_v, df, batch->most_v + i);
        hn::Store(least_z, df, batch->least_z + i);
        hn::Store(most_z, df, batch->most_z + i);
    }
}

void DoubleRanges(const std::uint32_t* HWY_RESTRICT from, int count, int stride, int side,
                  std::uint32_t* HWY_RESTRICT to) {
    const hn::CappedTag<std::uint16_t, 32> d16;
    const hn::Repartition<std::uint32_t, decltype(d16)> d32;
    const std::ptrdiff_t down = static_cast<std::ptrdiff_t>(side) * stride;
    const auto load = [&](const std::uint32_t* p) { return hn::BitCast(d16, hn::LoadU(d32, p)); };
    for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d32))) {
        const auto top = hn::Min(load(from + i), load(from + i + side));
        const auto bottom = hn::Min(load(from + i + down), load(from + i + down + side));
        hn::StoreU(hn::BitCast(d32, hn::Min(top, bottom)), d32, to + i);
    }
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(ProjectChunks);
HWY_EXPORT(DoubleRanges);

void project_chunks(const ChunkProjection& projection, ChunkBatch* batch) {
    if (scalar_selected()) return scalar::project_chunks(projection, batch);
    BURIN_DISPATCH(ProjectChunks)(projection, batch);
}

void double_ranges(const std::uint32_t* from, int count, int stride, int side, std::uint32_t* to) {
    if (scalar_selected()) return scalar::double_ranges(from, count, stride, side, to);
    BURIN_DISPATCH(DoubleRanges)(from, count, stride, side, to);
}

}  // namespace burin::simd
#endif
