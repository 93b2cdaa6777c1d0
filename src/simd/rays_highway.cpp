// SPDX-License-Identifier: MIT
// The kernels of rays.h, up to 16 rays at a time: every branch is computed, masks choose.
#include "simd/rays.h"

#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/rays_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

std::uint64_t LocateVoxels(RayPacket* rays) { return scalar::locate_voxels(rays); }
std::uint64_t StepRays(RayPacket* rays, const std::int32_t* readings, float units) {
    return scalar::step_rays(rays, readings, units);
}

#else

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, 16>;
using DI = hn::RebindToSigned<DF>;

HWY_INLINE std::uint64_t Bits(hn::Mask<DF> mask, int first) {
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(DF(), mask, bits);
    return static_cast<std::uint64_t>(bits[0] | bits[1] << 8) << first;
}

std::uint64_t LocateVoxels(RayPacket* rays) {
    const DF df;
    const DI di;
    RayPacket& r = *rays;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto seven = hn::Set(di, 7), ten_bits = hn::Set(di, 1023);
    std::uint64_t walking = 0;
    for (int i = 0; i < kRays; i += lanes) {
        const auto t = hn::Load(df, r.t + i);
        const auto walks = hn::Lt(t, hn::Load(df, r.t_end + i));
        if (hn::AllFalse(df, walks)) continue;
        walking |= Bits(walks, i);
        auto low = hn::Zero(di), high = low, voxel = low;
        for (int k = 2; k >= 0; --k) {
            const auto at =
                hn::Add(hn::Add(hn::Set(df, r.start[k]), hn::Mul(hn::Load(df, r.direction[k] + i), t)),
                        hn::Set(df, 0.5f));
            const auto v = hn::IfThenElseZero(walks, at);
            auto floor = hn::ConvertTo(di, v);
            const auto above = hn::RebindMask(di, hn::Gt(hn::ConvertTo(df, floor), v));
            floor = hn::Add(floor, hn::VecFromMask(di, above));  // -1 where truncation went up
            const auto chunk = hn::ShiftRight<3>(floor);
            hn::Store(chunk, di, r.chunk[k] + i);
            low = hn::Or(hn::ShiftLeft<3>(low), hn::And(chunk, seven));
            high = hn::Or(hn::ShiftLeft<10>(high), hn::And(hn::ShiftRight<3>(chunk), ten_bits));
            voxel = hn::Or(hn::ShiftLeft<3>(voxel), hn::And(floor, seven));
        }
        hn::Store(low, di, r.chunk_low + i);
        hn::Store(high, di, r.chunk_high + i);
        hn::Store(voxel, di, r.voxel + i);
    }
    return walking;
}

std::uint64_t StepRays(RayPacket* rays, const std::int32_t* readings, float units) {
    const DF df;
    const DI di;
    RayPacket& r = *rays;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto zero = hn::Zero(df), minus_one = hn::Set(df, -1.0f), no_wall = hn::Set(df, 1e30f);
    std::uint64_t near = 0;
    for (int i = 0; i < kRays; i += lanes) {
        const auto t = hn::Load(df, r.t + i);
        const auto walks = hn::Lt(t, hn::Load(df, r.t_end + i));
        if (hn::AllFalse(df, walks)) continue;
        const auto reading = hn::LoadU(di, readings + i);
        const auto front = hn::Load(df, r.front + i), fine_end = hn::Load(df, r.fine_end + i);
        const auto known = hn::RebindMask(df, hn::Gt(reading, hn::Set(di, kNotObserved)));
        const auto observed_not = hn::RebindMask(df, hn::Eq(reading, hn::Set(di, kNotObserved)));
        const auto fine = hn::Lt(t, fine_end);
        const auto d = hn::Mul(hn::ConvertTo(df, reading), hn::Set(df, units));
        const auto coarse = hn::AndNot(fine, hn::And(known, hn::Gt(d, hn::Set(df, kFarVoxels))));
        const auto wants = hn::AndNot(coarse, hn::And(known, walks));
        near |= Bits(wants, i);
        const auto moves = hn::AndNot(wants, walks);
        if (hn::AllFalse(df, moves)) continue;

        auto exit = no_wall;
        for (int k = 0; k < 3; ++k) {
            const auto direction = hn::Load(df, r.direction[k] + i);
            const auto side = hn::IfThenElse(hn::Gt(direction, zero), hn::Set(df, 7.5f), hn::Set(df, -0.5f));
            const auto corner = hn::ConvertTo(df, hn::ShiftLeft<3>(hn::Load(di, r.chunk[k] + i)));
            const auto at = hn::Mul(hn::Sub(hn::Add(corner, side), hn::Set(df, r.start[k])),
                                    hn::Load(df, r.inverse[k] + i));
            exit = hn::Min(hn::IfThenElse(hn::Eq(direction, zero), no_wall, at), exit);
        }
        const auto behind_wall = hn::Add(hn::Max(exit, t), hn::Set(df, kBehindWall));
        const auto short_step = hn::Add(t, hn::Set(df, kShortStep));
        const auto long_step = hn::Add(t, hn::Mul(hn::Set(df, kLongStep), d));
        const auto again = hn::AndNot(coarse, hn::Ge(front, zero));
        const auto in_unknown = hn::IfThenElse(hn::Or(fine, observed_not), short_step, behind_wall);
        const auto to = hn::IfThenElse(coarse, long_step, hn::IfThenElse(again, front, in_unknown));
        const auto front_after = hn::IfThenElse(coarse, t, hn::IfThenElse(again, minus_one, front));
        hn::Store(hn::IfThenElse(moves, to, t), df, r.t + i);
        hn::Store(hn::IfThenElse(moves, front_after, front), df, r.front + i);
        hn::Store(hn::IfThenElse(hn::And(moves, again), t, fine_end), df, r.fine_end + i);
        hn::Store(hn::IfThenElse(moves, minus_one, hn::Load(df, r.before_d + i)), df, r.before_d + i);
    }
    return near;
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(LocateVoxels);
HWY_EXPORT(StepRays);

std::uint64_t locate_voxels(RayPacket* rays) {
    return scalar_selected() ? scalar::locate_voxels(rays) : BURIN_DISPATCH(LocateVoxels)(rays);
}

std::uint64_t step_rays(RayPacket* rays, const std::int32_t* readings, float units) {
    return scalar_selected() ? scalar::step_rays(rays, readings, units)
                             : BURIN_DISPATCH(StepRays)(rays, readings, units);
}

}  // namespace burin::simd
#endif
