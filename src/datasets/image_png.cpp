// SPDX-License-Identifier: MIT
#include <png.h>

#include <bit>
#include <csetjmp>
#include <cstdio>
#include <cstring>

#include "core/atomic_file.h"
#include "core/camera.h"
#include "datasets/image_codecs.h"

namespace burin {
namespace codec {
namespace {

// deflate cannot shrink by more than 1032 : 1 (zlib's technical notes: 258 bytes from 2 bits). A header that
// promises more than the file can hold is refused before the memory is taken.
constexpr std::uint64_t kDeflateRatio = 1032;

struct Reader {
    std::string_view rest;
    char* reason;
};

[[noreturn]] void on_error(png_structp png, png_const_charp text) {
    std::snprintf(static_cast<Reader*>(png_get_error_ptr(png))->reason, kReasonBytes, "%s", text);
    png_longjmp(png, 1);
}
void on_warning(png_structp, png_const_charp) {}

void on_read(png_structp png, png_bytep out, png_size_t count) {
    Reader& reader = *static_cast<Reader*>(png_get_io_ptr(png));
    if (count > reader.rest.size()) png_error(png, "the file ends too early");
    std::memcpy(out, reader.rest.data(), count);
    reader.rest.remove_prefix(count);
}

}  // namespace

bool decode_png(std::string_view bytes, const Target& target, ImageInfo* info, char* reason) {
    Reader reader{bytes, reason};
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reader, on_error, on_warning);
    png_infop header = png ? png_create_info_struct(png) : nullptr;
    if (!header) {
        png_destroy_read_struct(&png, nullptr, nullptr);
        std::snprintf(reason, kReasonBytes, "no memory for libpng");
        return false;
    }
    if (setjmp(png_jmpbuf(png))) {
        png_destroy_read_struct(&png, &header, nullptr);
        return false;
    }
    png_set_read_fn(png, &reader, on_read);
    png_set_user_limits(png, kMaxImageSide, kMaxImageSide);
    png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, nullptr, 0);
    png_read_info(png, header);

    const int kind = png_get_color_type(png, header);
    info->width = static_cast<int>(png_get_image_width(png, header));
    info->height = static_cast<int>(png_get_image_height(png, header));
    info->bits = png_get_bit_depth(png, header);
    info->channels = kind == PNG_COLOR_TYPE_PALETTE ? 3 : png_get_channels(png, header);
    if (target.want != Want::info) {
        const std::uint64_t raw = std::uint64_t(png_get_rowbytes(png, header)) * info->height;
        if (raw > kDeflateRatio * bytes.size()) png_error(png, "the file is too short for its image size");
        auto* out = static_cast<png_bytep>(target.allocate(target.context, *info, reason));
        if (!out) {
            png_destroy_read_struct(&png, &header, nullptr);
            return false;
        }
        if (target.want == Want::rgb8) {
            png_set_strip_16(png);
            png_set_palette_to_rgb(png);
            png_set_expand_gray_1_2_4_to_8(png);
            png_set_strip_alpha(png);
            png_set_gray_to_rgb(png);
        } else if constexpr (std::endian::native == std::endian::little) {
            png_set_swap(png);  // PNG stores the high byte first
        }
        const int passes = png_set_interlace_handling(png);
        png_read_update_info(png, header);
        const std::size_t row_bytes = std::size_t(info->width) * (target.want == Want::rgb8 ? 3 : 2);
        if (png_get_rowbytes(png, header) != row_bytes) png_error(png, "its pixel layout is not understood");
        for (int pass = 0; pass < passes; ++pass)
            for (int y = 0; y < info->height; ++y) png_read_row(png, out + row_bytes * y, nullptr);
        png_read_end(png, nullptr);  // finds a missing end and damaged check sums
    }
    png_destroy_read_struct(&png, &header, nullptr);
    return true;
}

}  // namespace codec

namespace {

// Rendering a data set is bound by deflate. A VGA pair (ICL office, 16-bit depth and colour) takes 65 ms and
// 667 KB at this level, 117 ms and 647 KB at 3, 349 ms and 593 KB at the default 6.
constexpr int kCompressionLevel = 2;

struct Writer {
    std::string* bytes;
    char* reason;
};

[[noreturn]] void on_write_error(png_structp png, png_const_charp text) {
    std::snprintf(static_cast<Writer*>(png_get_error_ptr(png))->reason, codec::kReasonBytes, "%s", text);
    png_longjmp(png, 1);
}
void on_write_warning(png_structp, png_const_charp) {}

void on_write(png_structp png, png_bytep data, png_size_t count) {
    bool ok = true;
    try {
        static_cast<Writer*>(png_get_io_ptr(png))->bytes->append(reinterpret_cast<const char*>(data), count);
    } catch (...) {
        ok = false;  // must not travel through libpng
    }
    if (!ok) png_error(png, "no memory for the file");
}

struct Source {
    const std::uint8_t* data;
    std::size_t stride_bytes;
    int width, height, channels, bits;
};

bool encode(const Source& source, std::string* bytes, char* reason) {
    Writer writer{bytes, reason};
    png_structp png =
        png_create_write_struct(PNG_LIBPNG_VER_STRING, &writer, on_write_error, on_write_warning);
    png_infop header = png ? png_create_info_struct(png) : nullptr;
    if (!header) {
        png_destroy_write_struct(&png, nullptr);
        std::snprintf(reason, codec::kReasonBytes, "no memory for libpng");
        return false;
    }
    if (setjmp(png_jmpbuf(png))) {
        png_destroy_write_struct(&png, &header);
        return false;
    }
    png_set_write_fn(png, &writer, on_write, nullptr);
    png_set_IHDR(png, header, source.width, source.height, source.bits,
                 source.channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_compression_level(png, kCompressionLevel);
    png_write_info(png, header);
    if (source.bits == 16 && std::endian::native == std::endian::little) png_set_swap(png);
    for (int y = 0; y < source.height; ++y)
        png_write_row(png, source.data + source.stride_bytes * static_cast<std::size_t>(y));
    png_write_end(png, nullptr);
    png_destroy_write_struct(&png, &header);
    return true;
}

template <class T>
Status encode_view(View<const T> image, std::string* bytes) {
    bytes->clear();
    const bool channels_fit = image.channels == 1 || (sizeof(T) == 1 && image.channels == 3);
    if (image.empty() || image.width > kMaxImageSide || image.height > kMaxImageSide || !channels_fit)
        return Status::error(Code::invalid_argument,
                             "image is %dx%d with %d channels, expected 1..%d each way and grey or 8-bit RGB",
                             image.width, image.height, image.channels, kMaxImageSide);
    char reason[codec::kReasonBytes] = "";
    const Source source{reinterpret_cast<const std::uint8_t*>(image.data),
                        static_cast<std::size_t>(image.stride) * sizeof(T),
                        image.width,
                        image.height,
                        image.channels,
                        static_cast<int>(8 * sizeof(T))};
    if (encode(source, bytes, reason)) return {};
    bytes->clear();
    return Status::error(Code::insufficient_memory, "PNG of %dx%d: %s", image.width, image.height, reason);
}

template <class T>
Status write_view(const std::string& path, View<const T> image) {
    std::string bytes;
    if (const Status status = encode_view(image, &bytes); !status)
        return Status::error(status.code(), "%s: %s", path.c_str(), status.text());
    return write_file_atomically(path.c_str(), bytes.data(), bytes.size());
}

}  // namespace

Status encode_png(View<const std::uint8_t> image, std::string* bytes) { return encode_view(image, bytes); }
Status encode_png(View<const std::uint16_t> image, std::string* bytes) { return encode_view(image, bytes); }
Status write_png(const std::string& path, View<const std::uint8_t> image) { return write_view(path, image); }
Status write_png(const std::string& path, View<const std::uint16_t> image) { return write_view(path, image); }

}  // namespace burin
