// SPDX-License-Identifier: MIT
#include "capture/depth_codec.h"

#define ZSTD_STATIC_LINKING_ONLY  // a coder in memory that we bring: one of its own would come and go with
                                  // sizes
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <new>

namespace burin {
namespace {

// Level 1: level 3 is within 2 % of its size on every sequence measured and takes up to twice the time.
constexpr int kLevel = 1;
constexpr std::size_t kValues = 65536;
constexpr std::size_t kCounts = 8;  // the two numbers in front
constexpr std::size_t kAlign = 64;  // of zstd's memory: it asks for 8

constexpr std::size_t mask_bytes(std::size_t pixels) { return (pixels + 7) / 8; }

template <class T>
bool make(std::unique_ptr<T[]>* array, std::size_t count) {
    array->reset(new (std::nothrow) T[count]);
    if (!*array) return false;
    std::fill_n(array->get(), count, T{});  // the pages come now, not while streaming
    return true;
}

std::size_t plain_room(std::size_t max_pixels, std::size_t max_bytes) {
    return std::max(kCounts + 2 * std::min(kValues, max_pixels) + mask_bytes(max_pixels) + 2 * max_pixels,
                    max_bytes);
}

std::uint16_t load16(const std::uint8_t* p) {
    std::uint16_t v;
    std::memcpy(&v, p, 2);
    return v;
}

}  // namespace

PixelEncoder::~PixelEncoder() = default;

Status PixelEncoder::reserve(std::size_t max_pixels, std::size_t max_bytes) {
    plain_bytes_ = plain_room(max_pixels, max_bytes);
    bound_ = ZSTD_compressBound(plain_bytes_);
    const std::size_t workspace = ZSTD_estimateCCtxSize(kLevel);
    bool made = make(&workspace_, workspace + kAlign) && make(&plain_, plain_bytes_) &&
                make(&values_, max_pixels + 1) && make(&rank_, kValues) && make(&seen_, kValues);
    if (made) {
        auto* start = workspace_.get();
        start += (kAlign - reinterpret_cast<std::uintptr_t>(start) % kAlign) % kAlign;
        context_ = ZSTD_initStaticCCtx(start, workspace);
        made = context_ && !ZSTD_isError(ZSTD_CCtx_setParameter(context_, ZSTD_c_compressionLevel, kLevel));
    }
    if (made) return {};
    return Status::error(Code::insufficient_memory, "no memory to code images of %zu pixels", max_pixels);
}

std::size_t PixelEncoder::compress(std::size_t bytes, std::uint8_t* out) {
    const std::size_t got = ZSTD_compress2(context_, out, bound_, plain_.get(), bytes);
    return ZSTD_isError(got) ? 0 : got;
}

std::size_t PixelEncoder::encode_depth(const std::uint8_t* rows, std::size_t stride, int width, int height,
                                       std::uint8_t* out) {
    const auto columns = static_cast<std::size_t>(width);
    const std::size_t pixels = columns * static_cast<std::size_t>(height);
    std::uint16_t* values = values_.get();
    std::uint8_t* seen = seen_.get();
    std::memset(seen, 0, kValues);
    std::uint8_t* mask = plain_.get();  // moved behind the list once its length is known
    std::size_t valid = 0, bits = 0, i = 0;
    for (int y = 0; y < height; ++y) {
        const std::uint8_t* row = rows + static_cast<std::size_t>(y) * stride;
        for (std::size_t x = 0; x < columns; ++x, ++i) {
            const std::uint16_t v = load16(row + 2 * x);
            values[valid] = v;  // overwritten by the next when it is 0
            valid += v != 0;
            seen[v] = 1;
            bits |= static_cast<std::size_t>(v != 0) << (i & 7);
            if ((i & 7) == 7) mask[i >> 3] = static_cast<std::uint8_t>(bits), bits = 0;
        }
    }
    if ((pixels & 7) != 0) mask[pixels >> 3] = static_cast<std::uint8_t>(bits);

    std::uint16_t* rank = rank_.get();
    std::uint32_t distinct = 0;
    for (std::size_t v = 1; v < kValues; ++v) {
        rank[v] = static_cast<std::uint16_t>(distinct);
        distinct += seen[v];
    }
    std::uint8_t* at = plain_.get() + kCounts + 2 * std::size_t{distinct};
    std::memmove(at, mask, mask_bytes(pixels));
    at += mask_bytes(pixels);
    const std::uint32_t counts[2] = {distinct, static_cast<std::uint32_t>(valid)};
    std::memcpy(plain_.get(), counts, kCounts);
    std::uint8_t* rise = plain_.get() + kCounts;
    for (std::size_t v = 1, before = 0; v < kValues; ++v) {
        if (!seen[v]) continue;
        const auto difference = static_cast<std::uint16_t>(v - before);
        std::memcpy(rise, &difference, 2);
        rise += 2;
        before = v;
    }
    std::uint8_t *low = at, *high = at + valid;
    std::uint16_t before = 0;
    for (std::size_t k = 0; k < valid; ++k) {
        const std::uint16_t place = rank[values[k]];
        const auto d = static_cast<std::uint16_t>(place - before);
        const auto z = static_cast<std::uint16_t>((d << 1) ^ (d & 0x8000 ? 0xffff : 0));
        before = place;
        low[k] = static_cast<std::uint8_t>(z);
        high[k] = static_cast<std::uint8_t>(z >> 8);
    }
    return compress(static_cast<std::size_t>(high + valid - plain_.get()), out);
}

std::size_t PixelEncoder::encode_bytes(const std::uint8_t* bytes, std::size_t count, std::size_t step,
                                       std::uint8_t* out) {
    std::uint8_t* plain = plain_.get();
    std::memcpy(plain, bytes, std::min(step, count));
    for (std::size_t i = step; i < count; ++i)
        plain[i] = static_cast<std::uint8_t>(bytes[i] - bytes[i - step]);
    return compress(count, out);
}

PixelDecoder::~PixelDecoder() { ZSTD_freeDCtx(context_); }

Status PixelDecoder::reserve(std::size_t max_pixels, std::size_t max_bytes) {
    plain_bytes_ = plain_room(max_pixels, max_bytes);
    if (!context_) context_ = ZSTD_createDCtx();
    if (context_ && make(&plain_, plain_bytes_) && make(&value_, kValues)) return {};
    return Status::error(Code::insufficient_memory, "no memory to decode images of %zu pixels", max_pixels);
}

bool PixelDecoder::decompress(const std::uint8_t* coded, std::size_t bytes, std::uint8_t* out,
                              std::size_t least, std::size_t most, std::size_t* got, const char** reason) {
    *got = ZSTD_decompressDCtx(context_, out, most, coded, bytes);
    *reason = "its zstd frame is damaged or longer than its image";
    if (ZSTD_isError(*got)) return false;
    *reason = "its zstd frame is shorter than its image";
    return *got >= least;
}

bool PixelDecoder::decode_depth(const std::uint8_t* coded, std::size_t bytes, std::size_t pixels,
                                std::uint16_t* out, const char** reason) {
    const std::uint8_t* plain = plain_.get();
    const std::size_t most = std::min(plain_room(pixels, 0), plain_bytes_);
    std::size_t got = 0;
    if (!decompress(coded, bytes, plain_.get(), kCounts + mask_bytes(pixels), most, &got, reason))
        return false;
    std::uint32_t counts[2];
    std::memcpy(counts, plain, kCounts);
    const std::size_t distinct = counts[0], valid = counts[1];
    *reason = "its counts do not fit its length";
    if (distinct >= kValues || valid > pixels ||
        got != kCounts + 2 * distinct + mask_bytes(pixels) + 2 * valid)
        return false;
    std::uint16_t* value = value_.get();
    std::uint16_t v = 0;
    for (std::size_t k = 0; k < distinct; ++k)
        value[k] = v = static_cast<std::uint16_t>(v + load16(plain + kCounts + 2 * k));
    const std::uint8_t* mask = plain + kCounts + 2 * distinct;
    const std::uint8_t *low = mask + mask_bytes(pixels), *high = low + valid;
    std::size_t k = 0;
    std::uint16_t place = 0;
    *reason = "its mask and its values do not agree";
    for (std::size_t i = 0; i < pixels; ++i) {
        if (((mask[i >> 3] >> (i & 7)) & 1) == 0) {
            out[i] = 0;
            continue;
        }
        if (k >= valid) return false;
        const auto z = static_cast<std::uint16_t>(low[k] | high[k] << 8);
        ++k;
        place = static_cast<std::uint16_t>(place + ((z >> 1) ^ (z & 1 ? 0xffff : 0)));
        if (place >= distinct) return false;
        out[i] = value[place];
    }
    return k == valid;
}

bool PixelDecoder::decode_bytes(const std::uint8_t* coded, std::size_t bytes, std::size_t count,
                                std::size_t step, std::uint8_t* out, const char** reason) {
    std::size_t got = 0;
    if (!decompress(coded, bytes, out, count, count, &got, reason)) return false;
    *reason = "its step is 0";
    if (step == 0) return false;
    for (std::size_t i = step; i < count; ++i) out[i] = static_cast<std::uint8_t>(out[i] + out[i - step]);
    return true;
}

}  // namespace burin
