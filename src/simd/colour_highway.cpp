// SPDX-License-Identifier: MIT
// The kernels of colour.h. Few voxels of a chunk lie near a surface: they are listed first, so that all lanes
// work.
#include <bit>
#include <cstring>

#include "simd/colour.h"

#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/colour_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"
#include "simd/set_bits.h"
#include "simd/vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

int SelectVoxels(const std::int16_t* distances, std::int16_t band, const std::uint8_t* colours,
                 std::uint16_t* list) {
    return scalar::select_voxels(distances, band, colours, list);
}
void FindPixels(const std::uint16_t* list, int count, const ColourFrame& frame, ProjectiveBase base,
                std::int32_t* offsets) {
    scalar::find_pixels(list, count, frame, base, offsets);
}
int FuseColours(const std::uint16_t* list, int count, const ColourFrame& frame, const std::int32_t* offsets,
                std::uint8_t* colours) {
    return scalar::fuse_colours(list, count, frame, offsets, colours);
}

#else

int SelectVoxels(const std::int16_t* HWY_RESTRICT distances, std::int16_t band,
                 const std::uint8_t* HWY_RESTRICT colours, std::uint16_t* HWY_RESTRICT list) {
    const hn::CappedTag<std::int16_t, 32> d;
    const hn::FixedTag<std::uint16_t, 8> d8;
    const hn::Rebind<std::uint8_t, decltype(d8)> bytes8;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const auto most = hn::Set(d, band), least = hn::Set(d, static_cast<std::int16_t>(-band));
    int count = 0;
    for (int i = 0; i < kChunkVoxels; i += lanes) {
        const auto v = hn::Load(d, distances + i);
        // Within the band, as equality with the clamped value.
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(d, hn::Eq(hn::Min(hn::Max(v, least), most), v), bits);
        std::uint64_t any;
        std::memcpy(&any, bits, 8);
        if (any == 0) continue;
        for (int k = 0; k < lanes; k += 16) __builtin_prefetch(colours + 4 * (i + k), 1);
        // Eight at a time: the places of the set bits, and how many are of use.
        for (int k = 0; k < lanes / 8; ++k) {
            const auto places = hn::PromoteTo(d8, hn::Load(bytes8, kSetBits.place[bits[k]]));
            hn::StoreU(hn::Add(places, hn::Set(d8, static_cast<std::uint16_t>(i + 8 * k))), d8, list + count);
            count += std::popcount(bits[k]);
        }
    }
    for (int i = count; i % 16 != 0; ++i) list[i] = list[count - 1];
    return count;
}

// Whole numbers of 0 <= v < 2^31, rounded down.
HWY_INLINE hn::Vec<DI> TruncateInRange(hn::Vec<DF> v) {
#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
    return hn::Vec<DI>{_mm512_cvttps_epi32(v.raw)};
#elif HWY_TARGET == HWY_AVX2
    return hn::Vec<DI>{_mm256_cvttps_epi32(v.raw)};
#elif HWY_TARGET == HWY_SSE4
    return hn::Vec<DI>{_mm_cvttps_epi32(v.raw)};
#else
    return hn::ConvertTo(DI(), v);
#endif
}

HWY_INLINE void Distort(const ColourFrame& frame, hn::Vec<DF>* u, hn::Vec<DF>* v) {
    const DF df;
    const auto one = hn::Set(df, 1.0f), two = hn::Set(df, 2.0f);
    const auto fx = hn::Set(df, frame.fx), fy = hn::Set(df, frame.fy), cx = hn::Set(df, frame.cx),
               cy = hn::Set(df, frame.cy), p1 = hn::Set(df, frame.p1), p2 = hn::Set(df, frame.p2);
    const auto x = hn::Div(hn::Sub(*u, cx), fx), y = hn::Div(hn::Sub(*v, cy), fy);
    const auto xx = hn::Mul(x, x), yy = hn::Mul(y, y), r2 = hn::Add(xx, yy),
               two_xy = hn::Mul(two, hn::Mul(x, y));
    const auto inner = hn::Add(hn::Set(df, frame.k2), hn::Mul(r2, hn::Set(df, frame.k3)));
    const auto radial = hn::Add(one, hn::Mul(r2, hn::Add(hn::Set(df, frame.k1), hn::Mul(r2, inner))));
    const auto tangent_x = hn::Add(hn::Mul(p1, two_xy), hn::Mul(p2, hn::Add(r2, hn::Mul(two, xx))));
    const auto tangent_y = hn::Add(hn::Mul(p1, hn::Add(r2, hn::Mul(two, yy))), hn::Mul(p2, two_xy));
    *u = hn::Add(hn::Mul(fx, hn::Add(hn::Mul(x, radial), tangent_x)), cx);
    *v = hn::Add(hn::Mul(fy, hn::Add(hn::Mul(y, radial), tangent_y)), cy);
}

// Offsets of the voxels' pixels in the colour image, -1 for those that have none.
template <bool kDistorted>
void PixelOffsets(const std::uint16_t* HWY_RESTRICT list, int count, const ColourFrame& frame,
                  ProjectiveBase base, std::int32_t* HWY_RESTRICT offsets) {
    const DF df;
    const DI di;
    const DU16 du16;
    const auto one = hn::Set(df, 1.0f), half = hn::Set(df, 0.5f), zero = hn::Zero(df),
               least_z = hn::Set(df, kLeastZ);
    const auto width = hn::Set(df, static_cast<float>(frame.width)),
               height = hn::Set(df, static_cast<float>(frame.height));
    const auto last =
        hn::Set(di, static_cast<std::int32_t>((frame.height - 1) * frame.stride + 3 * frame.width - 4));
    const auto stride = hn::Set(di, static_cast<std::int32_t>(frame.stride)), seven = hn::Set(di, 7);
    for (int k = 0; k < ((count + 15) & ~15); k += static_cast<int>(hn::Lanes(df))) {
        const auto voxel = hn::PromoteTo(di, hn::Load(du16, list + k));
        const auto at_x = hn::ConvertTo(df, hn::And(voxel, seven)),
                   at_y = hn::ConvertTo(df, hn::And(hn::ShiftRight<3>(voxel), seven)),
                   at_z = hn::ConvertTo(df, hn::ShiftRight<6>(voxel));
        const auto sum = [&](const float step[3], float start) {
            const auto xy = hn::Add(hn::Mul(at_x, hn::Set(df, step[0])), hn::Mul(at_y, hn::Set(df, step[1])));
            return hn::Add(hn::Add(xy, hn::Mul(at_z, hn::Set(df, step[2]))), hn::Set(df, start));
        };
        const auto z = sum(frame.step_z, base.z);
        const auto inverse_z = hn::Div(one, hn::Max(z, least_z));
        auto u = hn::Mul(sum(frame.step_u, base.u), inverse_z),
             v = hn::Mul(sum(frame.step_v, base.v), inverse_z);
        if constexpr (kDistorted) Distort(frame, &u, &v);
        u = hn::Add(u, half);
        v = hn::Add(v, half);
        const auto inside = hn::And(hn::And(hn::Gt(z, least_z), hn::And(hn::Ge(u, zero), hn::Ge(v, zero))),
                                    hn::And(hn::Lt(u, width), hn::Lt(v, height)));
        const auto column = TruncateInRange(hn::IfThenElseZero(inside, u)),
                   row = TruncateInRange(hn::IfThenElseZero(inside, v));
        const auto offset = hn::Add(hn::Mul(row, stride), hn::Add(column, hn::Add(column, column)));
        const auto wanted = hn::And(hn::RebindMask(di, inside), hn::Not(hn::Gt(offset, last)));
        hn::Store(hn::IfThenElse(wanted, offset, hn::Set(di, -1)), di, offsets + k);
    }
}

// The colours after one more reading; where there is none (-1), as they were. Returns the largest count.
int Mean(const std::uint16_t* HWY_RESTRICT list, int count, std::uint32_t number,
         const std::int32_t* HWY_RESTRICT offsets, const std::int32_t* HWY_RESTRICT readings,
         std::int32_t* HWY_RESTRICT values) {
    const DF df;
    const DI di;
    const DU16 du16;
    const auto one = hn::Set(df, 1.0f);
    const auto low_byte = hn::Set(di, 255);
    const auto frame_threshold = hn::Set(di, static_cast<std::int32_t>(number * 101u & 255u));
    auto most = hn::Zero(di);
    for (int k = 0; k < count; k += static_cast<int>(hn::Lanes(df))) {
        const auto voxel = hn::PromoteTo(di, hn::Load(du16, list + k));
        const auto reading = hn::Load(di, readings + k), colour = hn::Load(di, values + k);
        const auto before = hn::And(hn::ShiftRight<24>(colour), low_byte);
        const auto before_f = hn::ConvertTo(df, before);
        const auto scale = hn::Div(hn::Set(df, 256.0f), hn::Add(before_f, one));
        const auto threshold = hn::And(hn::Add(hn::Mul(voxel, hn::Set(di, 167)), frame_threshold), low_byte);
        const auto mean = [&](auto c, auto r) {  // products below 2^24: exact
            const auto total = hn::Add(hn::Mul(hn::ConvertTo(df, hn::And(c, low_byte)), before_f),
                                       hn::ConvertTo(df, hn::And(r, low_byte)));
            const auto scaled = TruncateInRange(hn::Mul(total, scale));
            return hn::Min(hn::ShiftRight<8>(hn::Add(scaled, threshold)), low_byte);
        };
        const auto red = mean(colour, reading);
        const auto green = mean(hn::ShiftRight<8>(colour), hn::ShiftRight<8>(reading));
        const auto blue = mean(hn::ShiftRight<16>(colour), hn::ShiftRight<16>(reading));
        const auto more = hn::Min(hn::Add(before, hn::Set(di, 1)), hn::Set(di, kColourMemory));
        const auto result = hn::Or(hn::Or(red, hn::ShiftLeft<8>(green)),
                                   hn::Or(hn::ShiftLeft<16>(blue), hn::ShiftLeft<24>(more)));
        const auto none = hn::Lt(hn::Load(di, offsets + k), hn::Zero(di));
        hn::Store(hn::IfThenElse(none, colour, result), di, values + k);
        most = hn::Max(most, hn::IfThenZeroElse(none, more));
    }
    return hn::GetLane(hn::MaxOfLanes(di, most));
}

// Two words at a time as one store: left to itself, the compiler builds vectors out of single words, which
// takes thrice as long.
HWY_INLINE void LoadTwo(const std::uint8_t* a, const std::uint8_t* b, std::int32_t* to) {
    std::uint32_t first, second;
    std::memcpy(&first, a, 4);
    std::memcpy(&second, b, 4);
    const std::uint64_t both = first | std::uint64_t{second} << 32;
    std::memcpy(to, &both, 8);
}

void FindPixels(const std::uint16_t* list, int count, const ColourFrame& frame, ProjectiveBase base,
                std::int32_t* offsets) {
    frame.distorted ? PixelOffsets<true>(list, count, frame, base, offsets)
                    : PixelOffsets<false>(list, count, frame, base, offsets);
    for (int k = 0; k < count; ++k) __builtin_prefetch(frame.rgb + offsets[k]);
}

int FuseColours(const std::uint16_t* list, int count, const ColourFrame& frame, const std::int32_t* offsets,
                std::uint8_t* colours) {
    alignas(64) std::int32_t readings[kChunkVoxels], values[kChunkVoxels];
    const auto pixel = [&](int k) { return frame.rgb + (offsets[k] < 0 ? 0 : offsets[k]); };
    const int whole = (count + 15) & ~15;
    for (int k = 0; k < whole; k += 2) LoadTwo(pixel(k), pixel(k + 1), readings + k);
    for (int k = 0; k < whole; k += 2) LoadTwo(colours + 4 * list[k], colours + 4 * list[k + 1], values + k);
    const int most = Mean(list, count, frame.number, offsets, readings, values);
    for (int k = 0; k < count;
         k += 2) {  // a voxel that is there twice, at the end, takes the same value twice
        std::uint64_t both;
        std::memcpy(&both, values + k, 8);
        const auto first = static_cast<std::uint32_t>(both), second = static_cast<std::uint32_t>(both >> 32);
        std::memcpy(colours + 4 * list[k], &first, 4);
        std::memcpy(colours + 4 * list[k + 1], &second, 4);
    }
    return most;
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(SelectVoxels);
HWY_EXPORT(FindPixels);
HWY_EXPORT(FuseColours);

int select_voxels(const std::int16_t* distances, std::int16_t band, const std::uint8_t* colours,
                  std::uint16_t* list) {
    if (scalar_selected()) return scalar::select_voxels(distances, band, colours, list);
    return BURIN_DISPATCH(SelectVoxels)(distances, band, colours, list);
}

void find_pixels(const std::uint16_t* list, int count, const ColourFrame& frame, ProjectiveBase base,
                 std::int32_t* offsets) {
    if (scalar_selected()) return scalar::find_pixels(list, count, frame, base, offsets);
    BURIN_DISPATCH(FindPixels)(list, count, frame, base, offsets);
}

int fuse_colours(const std::uint16_t* list, int count, const ColourFrame& frame, const std::int32_t* offsets,
                 std::uint8_t* colours) {
    if (scalar_selected()) return scalar::fuse_colours(list, count, frame, offsets, colours);
    return BURIN_DISPATCH(FuseColours)(list, count, frame, offsets, colours);
}

}  // namespace burin::simd
#endif
