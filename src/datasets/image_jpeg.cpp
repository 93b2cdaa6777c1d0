// SPDX-License-Identifier: MIT
#include <csetjmp>
#include <cstdio>  // jpeglib.h needs FILE and forgets to ask for it

#include <jpeglib.h>

#include <jerror.h>

#include "core/camera.h"
#include "datasets/image_codecs.h"

namespace burin::codec {
namespace {

// A Huffman-coded block of 8x8 pixels takes at least one bit (the DC symbol of a progressive file), so a byte
// holds at most 512 pixels. A header that promises more is refused before the memory is taken.
constexpr std::uint64_t kPixelsPerByte = 512;
// Each progressive scan passes over the whole image, so a small file can ask for hours. Encoders write about
// ten.
constexpr int kMaxScans = 64;

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
    char text[JMSG_LENGTH_MAX];
    common->err->format_message(common, text);
    std::snprintf(errors.reason, kReasonBytes, "%.150s", text);
    std::longjmp(errors.jump, 1);
}

// libjpeg fills what is missing with grey and only warns. Here that is an error; the exceptions leave the
// pixels whole.
void on_message(j_common_ptr common, int level) {
    if (level >= 0) return;
    const int code = common->err->msg_code;
    if (code == JWRN_EXTRANEOUS_DATA || code == JWRN_ADOBE_XFORM || code == JWRN_JFIF_MAJOR) return;
    fail(common);
}

void on_progress(j_common_ptr common) {
    void* whole = common;
    if (static_cast<j_decompress_ptr>(whole)->input_scan_number <= kMaxScans) return;
    Errors& errors = errors_of(common);
    std::snprintf(errors.reason, kReasonBytes, "it has more than %d scans", kMaxScans);
    std::longjmp(errors.jump, 1);
}

}  // namespace

bool decode_jpeg(std::string_view bytes, const Target& target, ImageInfo* info, char* reason) {
    jpeg_decompress_struct jpeg = {};
    Errors errors = {};
    jpeg_progress_mgr progress = {};
    errors.reason = reason;
    jpeg.err = jpeg_std_error(&errors.base);
    errors.base.error_exit = fail;
    errors.base.emit_message = on_message;
    progress.progress_monitor = on_progress;
    if (setjmp(errors.jump)) {
        jpeg_destroy_decompress(&jpeg);
        return false;
    }
    jpeg_create_decompress(&jpeg);
    jpeg.progress = &progress;
    jpeg_mem_src(&jpeg, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
    jpeg_read_header(&jpeg, TRUE);
    info->width = static_cast<int>(jpeg.image_width);
    info->height = static_cast<int>(jpeg.image_height);
    info->channels = jpeg.num_components;
    info->bits = jpeg.data_precision;
    bool ok = info->width >= 1 && info->height >= 1 && info->width <= kMaxImageSide &&
              info->height <= kMaxImageSide;
    if (!ok)
        std::snprintf(reason, kReasonBytes, "its size is %dx%d, expected 1..%d each way", info->width,
                      info->height, kMaxImageSide);
    if (ok && target.want != Want::info) {
        if (std::uint64_t(info->width) * info->height > kPixelsPerByte * bytes.size()) {
            std::snprintf(reason, kReasonBytes, "the file is too short for its image size");
            ok = false;
        }
        auto* out = ok ? static_cast<JSAMPROW>(target.allocate(target.context, *info, reason)) : nullptr;
        ok = out != nullptr;
        if (ok) {
            jpeg.out_color_space = JCS_RGB;
            jpeg.dct_method = JDCT_ISLOW;  // exact integers: the same pixels with and without SIMD
            jpeg_start_decompress(&jpeg);
            while (jpeg.output_scanline < jpeg.output_height) {
                JSAMPROW row = out + std::size_t(jpeg.output_scanline) * jpeg.output_width * 3;
                jpeg_read_scanlines(&jpeg, &row, 1);
            }
            jpeg_finish_decompress(&jpeg);
        }
    }
    jpeg_destroy_decompress(&jpeg);
    return ok;
}

}  // namespace burin::codec
