// SPDX-License-Identifier: MIT
// Filled buffers to images.
#include <algorithm>
#include <cstring>
#include <new>

#include "capture/raw_image.h"
#include "platform/v4l2/v4l2_device.h"

namespace burin {
namespace {

View<std::uint16_t> words(std::uint8_t* image, const StreamInfo& s) {
    return {reinterpret_cast<std::uint16_t*>(image), s.width, s.height,
            static_cast<std::ptrdiff_t>(s.row_bytes / 2)};
}
View<std::uint8_t> bytes(std::uint8_t* image, const StreamInfo& s, int channels = 1) {
    return {image, s.width, s.height, static_cast<std::ptrdiff_t>(s.row_bytes), channels};
}

// Images of two streams in one.
bool splits(const V4l2Format& f) {
    return f.way == V4l2Way::inzi || f.way == V4l2Way::y8i || f.way == V4l2Way::y12i ||
           f.way == V4l2Way::y16i;
}

// One image of a board's raw words: `part` of `parts` that lie one below the other.
RawBytes part_of(const RawBytes& raw, int part, int rows, std::uint64_t last_row_bytes) {
    const std::size_t begin = raw.stride * static_cast<std::size_t>(part) * static_cast<std::size_t>(rows);
    if (begin >= raw.size) return {raw.data, 0, raw.stride};
    std::size_t size = raw.stride * static_cast<std::size_t>(rows - 1) + last_row_bytes;
    if (size > raw.size - begin) size = raw.size - begin;
    return {raw.data + begin, size, raw.stride};
}

// Confidence comes first through the memory of `depth`.
void run_layout(const V4l2Device& d, const V4l2Stream& s, const RawBytes& raw, std::uint8_t* depth,
                std::uint8_t* infrared, std::uint8_t* confidence) {
    const StreamInfo& info = d.info.at(StreamKind::depth);
    const std::uint64_t row = v4l2_row_bytes(*s.choice.format, s.choice.width);
    const auto take = [&](int part, std::uint8_t* out) {
        const View<std::uint16_t> view = words(out, info);
        (void)unpack_image(s.choice.format->packing, part_of(raw, part, info.height, row), {}, view);
        return view;
    };
    if (confidence) {
        const View<std::uint16_t> view = take(d.layout.confidence, depth);
        const View<std::uint8_t> out = bytes(confidence, d.info.at(StreamKind::confidence));
        const auto certain = static_cast<std::uint32_t>(d.layout.certain);
        for (int y = 0; y < view.height; ++y)
            for (int x = 0; x < view.width; ++x)
                out.row(y)[x] = static_cast<std::uint8_t>(std::min<std::uint32_t>(view.row(y)[x], certain) *
                                                          255 / certain);
    }
    const View<std::uint16_t> view = take(d.layout.take, depth);
    for (int y = 0; y < view.height; ++y)
        simd::affine_u16(view.row(y), view.width, d.layout.affine, view.row(y));
    if (infrared) (void)take(d.layout.brightness, infrared);
}

}  // namespace

Status prepare_v4l2_stream(V4l2Device* d, V4l2Stream* s) {
    const V4l2Format& f = *s->choice.format;
    StreamInfo info;
    info.kind = s->kind;
    info.pixels = s->kind == StreamKind::depth ? StreamPixels::u16 : f.pixels;
    info.colour_format = f.colour;
    std::snprintf(info.format, sizeof info.format, "%s", f.name);
    info.width = s->choice.width;
    info.height = s->choice.height;
    info.fps = s->choice.fps;
    const bool raw = s->kind == StreamKind::depth && d->has_layout;
    if (raw) {
        if (info.height % d->layout.images != 0)
            return Status::error(Code::invalid_argument,
                                 "layout: images of %d rows are not %d one below the other", info.height,
                                 d->layout.images);
        info.height /= d->layout.images;
        info.unit_m = d->layout.unit_m;
    }
    if (f.way == V4l2Way::y8i || f.way == V4l2Way::y12i || f.way == V4l2Way::y16i)
        info.pixels = f.way == V4l2Way::y8i ? StreamPixels::u8 : StreamPixels::u16;
    set_image_bytes(&info);
    // A view of 60 degrees: between what structured light and stereo sensors have. Until somebody knows
    // better.
    const double focal = info.width * 0.866;
    info.camera = {info.width, info.height, focal, focal, (info.width - 1) / 2.0, (info.height - 1) / 2.0};
    d->info.at(s->kind) = info;
    const auto beside = [&](StreamKind kind) {
        StreamInfo other = info;
        other.kind = kind;
        if (d->options.streams & stream_bit(kind)) d->info.at(kind) = other;
    };
    if (f.way == V4l2Way::inzi) beside(StreamKind::infrared);
    if (f.way == V4l2Way::y8i || f.way == V4l2Way::y12i || f.way == V4l2Way::y16i)
        beside(StreamKind::infrared_right);
    if (raw && d->layout.brightness >= 0) beside(StreamKind::infrared);
    if (raw && d->layout.confidence >= 0 && d->options.streams & stream_bit(StreamKind::confidence)) {
        StreamInfo confidence = info;
        confidence.kind = StreamKind::confidence;
        confidence.pixels = StreamPixels::u8;
        set_image_bytes(&confidence);
        d->info.at(StreamKind::confidence) = confidence;
    }
    if (s->kind != StreamKind::depth && f.way == V4l2Way::bayer)
        s->demosaic.reset(new (std::nothrow) Demosaic);
    if (f.way == V4l2Way::mjpeg) s->jpeg.reset(new (std::nothrow) JpegDecoder);
    if (splits(f)) s->scratch.reset(new (std::nothrow) std::uint8_t[info.image_bytes]);
    const bool lacks = (f.way == V4l2Way::bayer && s->kind != StreamKind::depth && !s->demosaic) ||
                       (f.way == V4l2Way::mjpeg && !s->jpeg) || (splits(f) && !s->scratch);
    return lacks ? Status::error(Code::insufficient_memory, "v4l2: no memory to decode images") : Status();
}

Status hand_over_v4l2(V4l2Device* d, int index, const V4l2Filled& filled, const ImageStamp& given) {
    V4l2Stream& s = d->streams[index];
    const V4l2Format& f = *s.choice.format;
    const StreamInfo& info = d->info.at(s.kind);
    const V4l2Mapped& buffer = s.node.buffer(filled.index);
    ImageStamp stamp = given;
    const std::uint64_t wanted = v4l2_image_bytes(f, s.choice.width, s.choice.height, s.choice.stride);
    if (filled.bytes < wanted || filled.bytes == 0) stamp.damaged = true;
    const bool raw_layout = s.kind == StreamKind::depth && d->has_layout;
    if (f.way == V4l2Way::as_is && d->options.lend && !raw_layout) {
        d->sink->lend(s.kind, buffer.memory, s.choice.stride,
                      static_cast<std::uint64_t>(index) << 32 | static_cast<std::uint64_t>(filled.index),
                      buffer.dmabuf, stamp);
        return {};
    }
    const RawBytes raw = {buffer.memory, filled.bytes, s.choice.stride};
    std::uint8_t* image = d->sink->acquire(s.kind);
    // The stream beside it, out of the same buffer.
    const StreamKind second =
        f.way == V4l2Way::inzi || raw_layout ? StreamKind::infrared : StreamKind::infrared_right;
    const bool two = raw_layout ? d->layout.brightness >= 0 : splits(f);
    std::uint8_t* other = two && d->info.has(second) ? d->sink->acquire(second) : nullptr;
    std::uint8_t* confidence = raw_layout && d->layout.confidence >= 0 && d->info.has(StreamKind::confidence)
                                   ? d->sink->acquire(StreamKind::confidence)
                                   : nullptr;
    char reason[160];
    bool whole = true;
    if (image) {
        std::uint8_t* half = other ? other : s.scratch.get();
        if (raw_layout) {
            run_layout(*d, s, raw, image, other, confidence);
        } else if (f.way == V4l2Way::as_is) {
            for (std::size_t y = 0; y < info.image_bytes / info.row_bytes; ++y) {
                const std::size_t from = y * s.choice.stride;
                if (from + info.row_bytes <= filled.bytes)
                    std::memcpy(image + y * info.row_bytes, buffer.memory + from, info.row_bytes);
                else
                    std::memset(image + y * info.row_bytes, 0, info.row_bytes);
            }
        } else if (f.way == V4l2Way::packed || (f.way == V4l2Way::bayer && s.kind == StreamKind::depth)) {
            (void)unpack_image(f.packing, raw, {}, words(image, info));
        } else if (f.way == V4l2Way::inzi) {
            (void)unpack_inzi(raw, words(half, info), words(image, info));
        } else if (f.way == V4l2Way::y8i) {
            (void)unpack_y8i(raw, bytes(image, info), bytes(half, info));
        } else if (f.way == V4l2Way::y12i) {
            (void)unpack_y12i(raw, words(image, info), words(half, info));
        } else if (f.way == V4l2Way::y16i) {
            (void)unpack_y16i(raw, words(image, info), words(half, info));
        } else if (f.way == V4l2Way::cnf4) {
            (void)unpack_confidence(raw, bytes(image, info));
        } else if (f.way == V4l2Way::uyvy) {
            (void)unpack_yuv422(simd::Yuv422::uyvy, raw, bytes(image, info, 3));
        } else if (f.way == V4l2Way::bayer) {
            (void)s.demosaic->run({f.order, f.packing, f.bits}, raw, bytes(image, info, 3));
        } else if (f.way == V4l2Way::mjpeg) {
            whole = s.jpeg->decode(buffer.memory, filled.bytes, info.width, info.height, 3, image,
                                   info.row_bytes, reason);
        }
    }
    const Status given_back = s.node.give(filled.index);
    if (image && !whole) {
        d->sink->log(LogLevel::warning, "%s: an image of %zu bytes is no JPEG of %dx%d: %s", s.node.path(),
                     filled.bytes, info.width, info.height, reason);
        d->sink->abandon(s.kind, image);
        return given_back;
    }
    // What was asked for together is told together: without depth, nothing.
    const auto tell = [&](StreamKind kind, std::uint8_t* filled_image) {
        if (filled_image && image) d->sink->commit(kind, filled_image, stamp);
        if (filled_image && !image) d->sink->abandon(kind, filled_image);
    };
    tell(second, other);
    tell(StreamKind::confidence, confidence);
    tell(s.kind, image);
    return given_back;
}

}  // namespace burin
