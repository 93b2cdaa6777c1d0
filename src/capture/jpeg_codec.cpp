// SPDX-License-Identifier: MIT
#include "capture/jpeg_codec.h"

#include <csetjmp>
#include <cstdio>  // jpeglib.h needs FILE and forgets to ask for it

#include <jpeglib.h>

#include <jerror.h>

#include <algorithm>
#include <new>

namespace burin {
namespace {

std::uint8_t to_byte(int fixed) {
    return static_cast<std::uint8_t>(std::clamp((fixed + 32768) >> 16, 0, 255));
}

// ITU-R BT.601 times 65536, Y of 0..255 as in JFIF 1.02.
void full_range(int y, int u, int v, std::uint8_t* rgb) {
    rgb[0] = to_byte(65536 * y + 91881 * v);
    rgb[1] = to_byte(65536 * y - 22554 * u - 46802 * v);
    rgb[2] = to_byte(65536 * y + 116130 * u);
}

// The same with Y of 16..235 and U, V of 16..240.
void video_range(int y, int u, int v, std::uint8_t* rgb) {
    y = 76309 * (y - 16);
    rgb[0] = to_byte(y + 104597 * v);
    rgb[1] = to_byte(y - 25675 * u - 53279 * v);
    rgb[2] = to_byte(y + 132201 * u);
}

void packed_to_rgb(const std::uint8_t* p, int width, int step, int red, int green, int blue,
                   std::uint8_t* rgb) {
    for (int x = 0; x < width; ++x, p += step, rgb += 3) rgb[0] = p[red], rgb[1] = p[green], rgb[2] = p[blue];
}

struct Errors {
    jpeg_error_mgr base;  // first: libjpeg hands this pointer back
    std::jmp_buf jump;
    char* reason;
};

// Through void*: the whole is aligned more strictly than its first member on 32-bit ARM, where a direct cast
// warns.
Errors& errors_of(j_common_ptr common) {
    void* base = common->err;
    return *static_cast<Errors*>(base);
}

[[noreturn]] void fail(j_common_ptr common) {
    Errors& errors = errors_of(common);
    if (errors.reason) {
        char text[JMSG_LENGTH_MAX];
        common->err->format_message(common, text);
        std::snprintf(errors.reason, 160, "%.150s", text);
    }
    std::longjmp(errors.jump, 1);
}

// What is missing would be filled with grey; here that is an error. The exceptions leave the pixels whole.
void on_message(j_common_ptr common, int level) {
    if (level >= 0) return;
    const int code = common->err->msg_code;
    if (code == JWRN_EXTRANEOUS_DATA || code == JWRN_ADOBE_XFORM || code == JWRN_JFIF_MAJOR) return;
    fail(common);
}

// The encoder's output: a buffer that does not grow.
void start_output(j_compress_ptr) {}
void end_output(j_compress_ptr) {}
boolean output_is_full(j_compress_ptr jpeg) {
    ERREXIT(jpeg, JERR_BUFFER_SIZE);
    return FALSE;
}

// Each progressive scan passes over the whole image, so a small file can ask for hours. We write none.
constexpr int kMaxScans = 64;
void on_progress(j_common_ptr common) {
    void* whole = common;
    if (static_cast<j_decompress_ptr>(whole)->input_scan_number <= kMaxScans) return;
    Errors& errors = errors_of(common);
    if (errors.reason) std::snprintf(errors.reason, 160, "it has more than %d scans", kMaxScans);
    std::longjmp(errors.jump, 1);
}

}  // namespace

void row_to_rgb(const ColourRows& image, int row, std::uint8_t* rgb) {
    const std::uint8_t* p = image.pixels + static_cast<std::size_t>(row) * image.stride_bytes;
    const int width = image.width;
    switch (image.format) {
        case PixelFormat::rgb8:
            std::copy_n(p, 3 * static_cast<std::size_t>(width), rgb);
            return;
        case PixelFormat::bgr8:
            return packed_to_rgb(p, width, 3, 2, 1, 0, rgb);
        case PixelFormat::rgba8:
            return packed_to_rgb(p, width, 4, 0, 1, 2, rgb);
        case PixelFormat::bgra8:
            return packed_to_rgb(p, width, 4, 2, 1, 0, rgb);
        case PixelFormat::grey8:
            return packed_to_rgb(p, width, 1, 0, 0, 0, rgb);
        case PixelFormat::yuyv:
            for (int x = 0; x < width; ++x) {
                const std::uint8_t* pair = p + 4 * (x / 2);
                video_range(p[2 * x], pair[1] - 128, pair[3] - 128, rgb + 3 * x);
            }
            return;
        case PixelFormat::nv12:
        case PixelFormat::nv21: {
            const std::uint8_t* uv =
                image.chroma + static_cast<std::size_t>(row / 2) * image.chroma_stride_bytes;
            const int u = image.format == PixelFormat::nv21 ? 1 : 0;
            for (int x = 0; x < width; ++x)
                full_range(p[x], uv[2 * (x / 2) + u] - 128, uv[2 * (x / 2) + 1 - u] - 128, rgb + 3 * x);
            return;
        }
    }
}

struct JpegEncoder::State {
    jpeg_compress_struct jpeg = {};
    Errors errors = {};
    jpeg_destination_mgr output = {};
    bool made = false;
};

JpegEncoder::JpegEncoder() = default;
JpegEncoder::~JpegEncoder() {
    if (state_ && state_->made) jpeg_destroy_compress(&state_->jpeg);
}

Status JpegEncoder::reserve(int max_width) {
    const auto row_bytes = 3 * static_cast<std::size_t>(max_width);
    state_.reset(new (std::nothrow) State);
    row_.reset(new (std::nothrow) std::uint8_t[row_bytes]);
    if (!state_ || !row_)
        return Status::error(Code::insufficient_memory, "no memory to code images of %d columns", max_width);
    State& s = *state_;
    s.jpeg.err = jpeg_std_error(&s.errors.base);
    s.errors.base.error_exit = fail;
    s.errors.base.emit_message = on_message;
    if (setjmp(s.errors.jump)) return Status::error(Code::insufficient_memory, "libjpeg could not be set up");
    jpeg_create_compress(&s.jpeg);
    s.made = true;
    s.output.init_destination = start_output;
    s.output.empty_output_buffer = output_is_full;
    s.output.term_destination = end_output;
    s.jpeg.dest = &s.output;
    return {};
}

std::size_t JpegEncoder::encode(const ColourRows& image, int quality, std::uint8_t* out, std::size_t room) {
    State& s = *state_;
    if (room == 0) return 0;  // libjpeg takes it that there is room for a byte
    if (setjmp(s.errors.jump)) {
        jpeg_abort_compress(&s.jpeg);
        return 0;
    }
    s.output.next_output_byte = out;
    s.output.free_in_buffer = room;
    s.jpeg.image_width = static_cast<JDIMENSION>(image.width);
    s.jpeg.image_height = static_cast<JDIMENSION>(image.height);
    const bool grey = image.format == PixelFormat::grey8;
    s.jpeg.input_components = grey ? 1 : 3;
    s.jpeg.in_color_space = grey ? JCS_GRAYSCALE : JCS_RGB;
    jpeg_set_defaults(&s.jpeg);
    jpeg_set_quality(&s.jpeg, quality, TRUE);
    s.jpeg.dct_method = JDCT_ISLOW;  // exact integers: the same bytes with and without SIMD
    jpeg_start_compress(&s.jpeg, TRUE);
    while (s.jpeg.next_scanline < s.jpeg.image_height) {
        const int y = static_cast<int>(s.jpeg.next_scanline);
        JSAMPROW row = row_.get();
        if (grey || image.format == PixelFormat::rgb8)  // libjpeg reads only, and has no const
            row = const_cast<JSAMPROW>(image.pixels + static_cast<std::size_t>(y) * image.stride_bytes);
        else
            row_to_rgb(image, y, row_.get());
        jpeg_write_scanlines(&s.jpeg, &row, 1);
    }
    jpeg_finish_compress(&s.jpeg);
    return room - s.output.free_in_buffer;
}

struct JpegDecoder::State {
    jpeg_decompress_struct jpeg = {};
    Errors errors = {};
    jpeg_progress_mgr progress = {};
    bool made = false;
};

JpegDecoder::JpegDecoder() = default;
JpegDecoder::~JpegDecoder() {
    if (state_ && state_->made) jpeg_destroy_decompress(&state_->jpeg);
}

bool JpegDecoder::decode(const std::uint8_t* bytes, std::size_t size, int width, int height, int channels,
                         std::uint8_t* out, std::size_t stride, char reason[160]) {
    if (!state_) state_.reset(new (std::nothrow) State);
    if (!state_) {
        std::snprintf(reason, 160, "no memory to decode it");
        return false;
    }
    State& s = *state_;
    s.errors.reason = reason;
    s.jpeg.err = jpeg_std_error(&s.errors.base);
    s.errors.base.error_exit = fail;
    s.errors.base.emit_message = on_message;
    if (setjmp(s.errors.jump)) {
        if (s.made) jpeg_abort_decompress(&s.jpeg);
        return false;
    }
    if (!s.made) {
        jpeg_create_decompress(&s.jpeg);
        s.progress.progress_monitor = on_progress;
        s.jpeg.progress = &s.progress;
        s.made = true;
    }
    jpeg_mem_src(&s.jpeg, bytes, size);
    jpeg_read_header(&s.jpeg, TRUE);
    if (s.jpeg.image_width != static_cast<JDIMENSION>(width) ||
        s.jpeg.image_height != static_cast<JDIMENSION>(height)) {
        std::snprintf(reason, 160, "it is %ux%u, expected %dx%d", s.jpeg.image_width, s.jpeg.image_height,
                      width, height);
        jpeg_abort_decompress(&s.jpeg);
        return false;
    }
    s.jpeg.out_color_space = channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
    s.jpeg.dct_method = JDCT_ISLOW;
    jpeg_start_decompress(&s.jpeg);
    while (s.jpeg.output_scanline < s.jpeg.output_height) {
        JSAMPROW row = out + static_cast<std::size_t>(s.jpeg.output_scanline) * stride;
        jpeg_read_scanlines(&s.jpeg, &row, 1);
    }
    jpeg_finish_decompress(&s.jpeg);
    return true;
}

}  // namespace burin
