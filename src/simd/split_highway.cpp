// SPDX-License-Identifier: MIT
// The kernels of split.h; what vectors leave over goes to the specification. Two bytes of a word are stored
// as interleaved vectors of bytes.
#include <algorithm>

#include "simd/split.h"

#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/split_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"
#include "simd/vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

int SplitY8i(const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* left, std::uint8_t* right) {
    return scalar::split_y8i(in, bytes, count, left, right);
}
int SplitY12i(const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* left,
              std::uint16_t* right) {
    return scalar::split_y12i(in, bytes, count, left, right);
}
int SplitY16i(const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* left,
              std::uint16_t* right) {
    return scalar::split_y16i(in, bytes, count, left, right);
}
int UnpackNibbles(const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* out) {
    return scalar::unpack_nibbles(in, bytes, count, out);
}
void AffineU16(const std::uint16_t* in, int count, const Affine& a, std::uint16_t* out) {
    scalar::affine_u16(in, count, a, out);
}
void AffineU8(const std::uint8_t* in, int count, const Affine& a, std::uint16_t* out) {
    scalar::affine_u8(in, count, a, out);
}
void NarrowU16(const std::uint16_t* in, int count, int shift, std::uint8_t* out) {
    scalar::narrow_u16(in, count, shift, out);
}

#else

namespace hn = hwy::HWY_NAMESPACE;
#if HWY_HAVE_SCALABLE
using D8 = hn::CappedTag<std::uint8_t, 16>;
#else
using D8 = hn::CappedTag<std::uint8_t, 32>;
#endif

HWY_INLINE int Complete(std::size_t pixels, int count) {
    return static_cast<int>(std::min(static_cast<std::size_t>(count), pixels));
}

int SplitY8i(const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* left, std::uint8_t* right) {
    const D8 d;
    const int lanes = static_cast<int>(hn::Lanes(d)), n = Complete(bytes / 2, count);
    int i = 0;
    for (; i + lanes <= n; i += lanes) {
        hn::Vec<D8> l, r;
        hn::LoadInterleaved2(d, in + 2 * i, l, r);
        hn::StoreU(l, d, left + i);
        hn::StoreU(r, d, right + i);
    }
    scalar::split_y8i(in + 2 * i, bytes - 2 * static_cast<std::size_t>(i), n - i, left + i, right + i);
    return n;
}

int SplitY12i(const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* left,
              std::uint16_t* right) {
    const D8 d;
    const int lanes = static_cast<int>(hn::Lanes(d)), n = Complete(bytes / 3, count);
    const auto low = hn::Set(d, 15);
    int i = 0;
    for (; i + lanes <= n; i += lanes) {
        hn::Vec<D8> a, b, c;
        hn::LoadInterleaved3(d, in + 3 * i, a, b, c);
        hn::StoreInterleaved2(a, hn::And(b, low), d, reinterpret_cast<std::uint8_t*>(left + i));
        hn::StoreInterleaved2(hn::Or(hn::ShiftRight<4>(b), hn::ShiftLeft<4>(c)), hn::ShiftRight<4>(c), d,
                              reinterpret_cast<std::uint8_t*>(right + i));
    }
    scalar::split_y12i(in + 3 * i, bytes - 3 * static_cast<std::size_t>(i), n - i, left + i, right + i);
    return n;
}

int SplitY16i(const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* left,
              std::uint16_t* right) {
    const D8 d;
    const hn::Repartition<std::uint16_t, D8> d16;
    const hn::Repartition<std::uint32_t, D8> d32;
    const int lanes = static_cast<int>(hn::Lanes(d16)), n = Complete(bytes / 4, count);
    int i = 0;
    for (; i + lanes <= n; i += lanes) {
        const auto a = hn::BitCast(d32, hn::LoadU(d, in + 4 * i)),
                   b = hn::BitCast(d32, hn::LoadU(d, in + 4 * i + 2 * lanes));
        hn::StoreU(hn::ConcatEven(d16, hn::BitCast(d16, b), hn::BitCast(d16, a)), d16, left + i);
        hn::StoreU(hn::ConcatOdd(d16, hn::BitCast(d16, b), hn::BitCast(d16, a)), d16, right + i);
    }
    scalar::split_y16i(in + 4 * i, bytes - 4 * static_cast<std::size_t>(i), n - i, left + i, right + i);
    return n;
}

int UnpackNibbles(const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* out) {
    const D8 d;
    const int lanes = static_cast<int>(hn::Lanes(d)), n = Complete(2 * bytes, count);
    const auto low = hn::Set(d, 15);
    int i = 0;
    for (; i + 2 * lanes <= n; i += 2 * lanes) {
        const auto v = hn::LoadU(d, in + i / 2);
        hn::StoreInterleaved2(hn::And(v, low), hn::ShiftRight<4>(v), d, out + i);
    }
    scalar::unpack_nibbles(in + i / 2, bytes - static_cast<std::size_t>(i / 2), n - i, out + i);
    return n;
}

// scaled() of split.cpp.
HWY_INLINE hn::Vec<DU16> Scaled(hn::Vec<DI> reading, hn::Vec<DI> mask, hn::Vec<DI> none, hn::Vec<DF> scale,
                                hn::Vec<DF> offset) {
    const DF df;
    const DU16 du16;
    const auto value = hn::And(reading, mask);
    const auto y = hn::Add(hn::Mul(hn::ConvertTo(df, value), scale), offset);
    const auto limited = hn::Min(hn::Max(y, hn::Zero(df)), hn::Set(df, 65535.0f));
    const auto whole = TruncateInRange(hn::Add(limited, hn::Set(df, 0.5f)));
    return hn::DemoteTo(du16, hn::IfThenZeroElse(hn::Eq(value, none), whole));
}

template <class T>
HWY_INLINE int AffineAll(const T* in, int count, const Affine& a, std::uint16_t* out) {
    const DF df;
    const DI di;
    const DU16 du16;
    const hn::Rebind<T, DF> d;
    const int lanes = static_cast<int>(hn::Lanes(df));
    const auto mask = hn::Set(di, a.mask),
               none = hn::Set(di, static_cast<std::int32_t>(std::min(a.none, 0x10000u)));
    const auto scale = hn::Set(df, a.scale), offset = hn::Set(df, a.offset);
    int i = 0;
    for (; i + lanes <= count; i += lanes)
        hn::StoreU(Scaled(hn::PromoteTo(di, hn::LoadU(d, in + i)), mask, none, scale, offset), du16, out + i);
    return i;
}

void AffineU16(const std::uint16_t* in, int count, const Affine& a, std::uint16_t* out) {
    const int i = AffineAll(in, count, a, out);
    scalar::affine_u16(in + i, count - i, a, out + i);
}

void AffineU8(const std::uint8_t* in, int count, const Affine& a, std::uint16_t* out) {
    const int i = AffineAll(in, count, a, out);
    scalar::affine_u8(in + i, count - i, a, out + i);
}

void NarrowU16(const std::uint16_t* in, int count, int shift, std::uint8_t* out) {
    const hn::Repartition<std::uint16_t, D8> d;
    const hn::RebindToSigned<decltype(d)> signed_d;
    const hn::Rebind<std::uint8_t, decltype(d)> half;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const auto most = hn::Set(d, 255);
    int i = 0;
    for (; i + lanes <= count; i += lanes) {
        const auto v = hn::Min(hn::ShiftRightSame(hn::LoadU(d, in + i), shift), most);
        hn::StoreU(hn::DemoteTo(half, hn::BitCast(signed_d, v)), half, out + i);
    }
    scalar::narrow_u16(in + i, count - i, shift, out + i);
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(SplitY8i);
HWY_EXPORT(SplitY12i);
HWY_EXPORT(SplitY16i);
HWY_EXPORT(UnpackNibbles);
HWY_EXPORT(AffineU16);
HWY_EXPORT(AffineU8);
HWY_EXPORT(NarrowU16);

int split_y8i(const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* left, std::uint8_t* right) {
    if (scalar_selected()) return scalar::split_y8i(in, bytes, count, left, right);
    return BURIN_DISPATCH(SplitY8i)(in, bytes, count, left, right);
}

int split_y12i(const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* left,
               std::uint16_t* right) {
    if (scalar_selected()) return scalar::split_y12i(in, bytes, count, left, right);
    return BURIN_DISPATCH(SplitY12i)(in, bytes, count, left, right);
}

int split_y16i(const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* left,
               std::uint16_t* right) {
    if (scalar_selected()) return scalar::split_y16i(in, bytes, count, left, right);
    return BURIN_DISPATCH(SplitY16i)(in, bytes, count, left, right);
}

int unpack_nibbles(const std::uint8_t* in, std::size_t bytes, int count, std::uint8_t* out) {
    if (scalar_selected()) return scalar::unpack_nibbles(in, bytes, count, out);
    return BURIN_DISPATCH(UnpackNibbles)(in, bytes, count, out);
}

void affine_u16(const std::uint16_t* in, int count, const Affine& a, std::uint16_t* out) {
    if (scalar_selected()) return scalar::affine_u16(in, count, a, out);
    BURIN_DISPATCH(AffineU16)(in, count, a, out);
}

void affine_u8(const std::uint8_t* in, int count, const Affine& a, std::uint16_t* out) {
    if (scalar_selected()) return scalar::affine_u8(in, count, a, out);
    BURIN_DISPATCH(AffineU8)(in, count, a, out);
}

void narrow_u16(const std::uint16_t* in, int count, int shift, std::uint8_t* out) {
    if (scalar_selected()) return scalar::narrow_u16(in, count, shift, out);
    BURIN_DISPATCH(NarrowU16)(in, count, shift, out);
}

}  // namespace burin::simd
#endif
