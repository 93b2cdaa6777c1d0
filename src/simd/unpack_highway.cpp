// SPDX-License-Identifier: MIT
// The kernels of unpack.h. Eight pixels of any packing lie in at most 16 bytes: one look-up of bytes puts the
// high bits of each into the high byte of its lane, a second one what is missing below.
#include <algorithm>
#include <cstring>

#include "simd/unpack.h"

#include "simd/kernel_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/unpack_highway.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/kernel.h"
#include "simd/vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace burin::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

int Unpack(Packing p, const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* out) {
    return scalar::unpack(p, in, bytes, count, out);
}
int UnpackTable(Packing p, const std::uint8_t* in, std::size_t bytes, int count, const std::uint16_t* table,
                int entries, std::uint16_t* out) {
    return scalar::unpack_table(p, in, bytes, count, table, entries, out);
}

#else

namespace hn = hwy::HWY_NAMESPACE;

// Whole blocks of 128 bits, at most two: four loads for one vector cost more than they save.
#if HWY_HAVE_SCALABLE
using DB = hn::CappedTag<std::uint8_t, 16>;
#else
using DB = hn::CappedTag<std::uint8_t, 32>;
#endif
using DW = hn::Repartition<std::uint16_t, DB>;
using DBlock = hn::Full128<std::uint8_t>;
constexpr int kBlockPixels = 8;

// How eight pixels are made: value = (high * times_high | (low * times_low >> low_shift & low_mask)) >> down,
// where high and low are lanes of 16 bits whose bytes come from `high_bytes` and `low_bytes` (128 and above:
// 0).
struct Recipe {
    alignas(16) std::uint8_t high_bytes[16], low_bytes[16];
    alignas(16) std::uint16_t times_high[8], times_low[8];
    int low_shift;  // 0 or 8
    std::uint16_t low_mask;
    bool has_low;
};

constexpr Recipe recipe_of(Packing p) {
    constexpr std::uint8_t kNone = 0x80;
    Recipe r = {};
    const int bits = packing_bits(p);
    const PackedGroup group = packed_group(p);
    for (int i = 0; i < kBlockPixels; ++i) {
        std::uint8_t low = kNone, high = 0, tail = kNone;
        int up = 0, tail_up = 0;
        if (p == Packing::mipi10 || p == Packing::mipi12) {
            const int first = i / group.pixels * group.bytes, k = i % group.pixels;
            high = static_cast<std::uint8_t>(first + k);
            tail = static_cast<std::uint8_t>(first + group.bytes - 1);
            tail_up = (group.pixels - 1 - k) * (bits - 8);
        } else {
            const int first = i * bits;
            high = static_cast<std::uint8_t>(first / 8);
            low = static_cast<std::uint8_t>(first / 8 + 1);
            up = first % 8;
            if (up + bits > 16) {
                tail = static_cast<std::uint8_t>(first / 8 + 2);
                tail_up = up;
            }
        }
        r.high_bytes[2 * i] = low;
        r.high_bytes[2 * i + 1] = high;
        r.low_bytes[2 * i] = tail;
        r.low_bytes[2 * i + 1] = kNone;
        r.times_high[i] = static_cast<std::uint16_t>(1 << up);
        r.times_low[i] = static_cast<std::uint16_t>(1 << tail_up);
        r.has_low = r.has_low || tail != kNone;
    }
    const bool mipi = group.whole;
    r.low_shift = mipi ? 0 : 8;
    // What lies below the value falls off at the end; above it must be nothing.
    r.low_mask = static_cast<std::uint16_t>(mipi ? 0xff & ~((1 << (16 - bits)) - 1) : 0xff);
    return r;
}

// Eight pixels a block from `in`, the blocks `step` bytes apart.
HWY_INLINE hn::Vec<DB> LoadBlocks(const std::uint8_t* in, int step) {
#if HWY_TARGET <= HWY_AVX2 && HWY_ARCH_X86
    const DBlock block;
    return hn::Vec<DB>{_mm256_inserti128_si256(_mm256_castsi128_si256(hn::LoadU(block, in).raw),
                                               hn::LoadU(block, in + step).raw, 1)};
#else
    static_cast<void>(step);
    return hn::LoadU(DB(), in);
#endif
}

// Pixels of whole blocks, from the first on: returns how many. body(vector of pixels, index of its first).
template <Packing kPacking, class Body>
HWY_INLINE int EachVector(const std::uint8_t* in, std::size_t bytes, int count, Body&& body) {
    const DW d;
    const int lanes = static_cast<int>(hn::Lanes(d));
    int i = 0;
    if constexpr (kPacking == Packing::u8) {
        const hn::Rebind<std::uint8_t, DW> half;
        for (; i + lanes <= count; i += lanes) body(hn::PromoteTo(d, hn::LoadU(half, in + i)), i);
    } else if constexpr (kPacking == Packing::le16 || kPacking == Packing::be16) {
        for (; i + lanes <= count; i += lanes) {
            auto v = hn::BitCast(d, hn::LoadU(DB(), in + 2 * i));
            if constexpr (kPacking == Packing::be16) v = hn::Or(hn::ShiftLeft<8>(v), hn::ShiftRight<8>(v));
            body(v, i);
        }
    } else {
        static constexpr Recipe kRecipe = recipe_of(kPacking);
        constexpr int kDown = 16 - packing_bits(kPacking);
        constexpr int kStep = packing_bits(kPacking);  // bytes of eight pixels
        const auto high_bytes = hn::LoadDup128(DB(), kRecipe.high_bytes),
                   low_bytes = hn::LoadDup128(DB(), kRecipe.low_bytes);
        const auto times_high = hn::LoadDup128(d, kRecipe.times_high),
                   times_low = hn::LoadDup128(d, kRecipe.times_low);
        const auto low_mask = hn::Set(d, kRecipe.low_mask);
        // The last block is loaded as 16 bytes.
        const int blocks = lanes / kBlockPixels;
        const std::size_t reach = static_cast<std::size_t>((blocks - 1) * kStep + 16);
        for (std::size_t at = 0; i + lanes <= count && at + reach <= bytes;
             i += lanes, at += static_cast<std::size_t>(blocks * kStep)) {
            const auto packed = LoadBlocks(in + at, kStep);
            auto v = hn::BitCast(d, hn::TableLookupBytesOr0(packed, high_bytes));
            v = hn::Mul(v, times_high);
            if constexpr (kRecipe.has_low) {
                auto low = hn::Mul(hn::BitCast(d, hn::TableLookupBytesOr0(packed, low_bytes)), times_low);
                if constexpr (kRecipe.low_shift == 8)
                    low = hn::ShiftRight<8>(low);
                else
                    low = hn::And(low, low_mask);
                v = hn::Or(v, low);
            }
            body(hn::ShiftRight<kDown>(v), i);
        }
    }
    return i;
}

// What vectors left over. The first pixel of the rest begins a group.
HWY_INLINE std::size_t BytesBefore(Packing p, int pixels) {
    return packed_bytes(p, static_cast<std::size_t>(pixels));
}

template <Packing kPacking>
int UnpackAs(const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* out) {
    const DW d;
    const int done =
        EachVector<kPacking>(in, bytes, count, [&](auto v, int i) { hn::StoreU(v, d, out + i); });
    const std::size_t before = BytesBefore(kPacking, done);
    return done + scalar::unpack(kPacking, in + before, bytes - before, count - done, out + done);
}

template <Packing kPacking>
int UnpackTableAs(const std::uint8_t* in, std::size_t bytes, int count, const std::uint16_t* table,
                  int entries, std::uint16_t* out) {
    const DW d;
    const int lanes = static_cast<int>(hn::Lanes(d));
    alignas(64) std::uint16_t readings[hn::MaxLanes(DW())];
    int done;
    if (entries >= 1 << packing_bits(kPacking)) {
        done = EachVector<kPacking>(in, bytes, count, [&](auto v, int i) {
            hn::Store(v, d, readings);
            for (int k = 0; k < lanes; k += 4) LookUp4(table, readings + k, out + i + k);
        });
    } else {
        // As equality with the smaller one: not every target compares unsigned lanes by order.
        const auto last = hn::Set(d, static_cast<std::uint16_t>(entries - 1));
        alignas(64) std::uint16_t values[hn::MaxLanes(DW())];
        done = EachVector<kPacking>(in, bytes, count, [&](auto v, int i) {
            const auto there = hn::Eq(hn::Min(v, last), v);
            hn::Store(hn::IfThenElseZero(there, v), d, readings);
            for (int k = 0; k < lanes; k += 4) LookUp4(table, readings + k, values + k);
            hn::StoreU(hn::IfThenElseZero(there, hn::Load(d, values)), d, out + i);
        });
    }
    const std::size_t before = BytesBefore(kPacking, done);
    return done + scalar::unpack_table(kPacking, in + before, bytes - before, count - done, table, entries,
                                       out + done);
}

using UnpackFunction = int (*)(const std::uint8_t*, std::size_t, int, std::uint16_t*);
using UnpackTableFunction = int (*)(const std::uint8_t*, std::size_t, int, const std::uint16_t*, int,
                                    std::uint16_t*);
constexpr UnpackFunction kUnpack[kPackings] = {
    UnpackAs<Packing::u8>,    UnpackAs<Packing::le16>,  UnpackAs<Packing::be16>,   UnpackAs<Packing::msb10>,
    UnpackAs<Packing::msb11>, UnpackAs<Packing::msb12>, UnpackAs<Packing::mipi10>, UnpackAs<Packing::mipi12>,
};
constexpr UnpackTableFunction kUnpackTable[kPackings] = {
    UnpackTableAs<Packing::u8>,     UnpackTableAs<Packing::le16>,   UnpackTableAs<Packing::be16>,
    UnpackTableAs<Packing::msb10>,  UnpackTableAs<Packing::msb11>,  UnpackTableAs<Packing::msb12>,
    UnpackTableAs<Packing::mipi10>, UnpackTableAs<Packing::mipi12>,
};

int Unpack(Packing p, const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* out) {
    count = static_cast<int>(std::min(static_cast<std::size_t>(count), packed_pixels(p, bytes)));
    return kUnpack[static_cast<int>(p)](in, bytes, count, out);
}
int UnpackTable(Packing p, const std::uint8_t* in, std::size_t bytes, int count, const std::uint16_t* table,
                int entries, std::uint16_t* out) {
    count = static_cast<int>(std::min(static_cast<std::size_t>(count), packed_pixels(p, bytes)));
    return kUnpackTable[static_cast<int>(p)](in, bytes, count, table, entries, out);
}

#endif  // HWY_SCALAR

}  // namespace burin::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace burin::simd {

HWY_EXPORT(Unpack);
HWY_EXPORT(UnpackTable);

int unpack(Packing p, const std::uint8_t* in, std::size_t bytes, int count, std::uint16_t* out) {
    if (scalar_selected()) return scalar::unpack(p, in, bytes, count, out);
    return BURIN_DISPATCH(Unpack)(p, in, bytes, count, out);
}

int unpack_table(Packing p, const std::uint8_t* in, std::size_t bytes, int count, const std::uint16_t* table,
                 int entries, std::uint16_t* out) {
    if (scalar_selected()) return scalar::unpack_table(p, in, bytes, count, table, entries, out);
    return BURIN_DISPATCH(UnpackTable)(p, in, bytes, count, table, entries, out);
}

}  // namespace burin::simd
#endif
