// SPDX-License-Identifier: MIT
#include "datasets/image_file.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <new>

#include "core/camera.h"
#include "datasets/file.h"
#include "datasets/image_codecs.h"

namespace burin {
namespace codec {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

// A number of a PNM header: blanks and comments (# to the end of the line) may stand before it.
bool header_number(std::string_view bytes, std::size_t* at, int* value) {
    while (*at < bytes.size() && (bytes[*at] == '#' || is_blank(bytes[*at]))) {
        if (bytes[*at] == '#')
            while (*at < bytes.size() && bytes[*at] != '\n') ++*at;
        else
            ++*at;
    }
    const auto [end, error] = std::from_chars(bytes.data() + *at, bytes.data() + bytes.size(), *value);
    if (error != std::errc() || *value < 0) return false;
    *at = static_cast<std::size_t>(end - bytes.data());
    return true;
}

}  // namespace

// Netpbm's binary greymap P5 and pixmap P6; above maxval 255 a value is two bytes, the high one first.
bool decode_pnm(std::string_view bytes, const Target& target, ImageInfo* info, char* reason) {
    std::size_t at = 2;
    int maximum = 0;
    if (!header_number(bytes, &at, &info->width) || !header_number(bytes, &at, &info->height) ||
        !header_number(bytes, &at, &maximum) || at >= bytes.size() || !is_blank(bytes[at])) {
        std::snprintf(reason, kReasonBytes, "its PNM header is damaged, expected 'P5 width height maximum'");
        return false;
    }
    ++at;  // exactly one blank before the pixels
    info->channels = bytes[1] == '6' ? 3 : 1;
    info->bits = maximum > 255 ? 16 : 8;
    if (info->width < 1 || info->height < 1 || info->width > kMaxImageSide || info->height > kMaxImageSide ||
        maximum < 1 || maximum > 65535) {
        std::snprintf(reason, kReasonBytes,
                      "its header says %dx%d maximum %d, expected 1..%d each way and 1..65535", info->width,
                      info->height, maximum, kMaxImageSide);
        return false;
    }
    if (target.want == Want::info) return true;
    const std::size_t values = std::size_t(info->width) * info->height * info->channels;
    const std::size_t expected = values * (info->bits / 8);
    if (bytes.size() - at < expected) {
        std::snprintf(reason, kReasonBytes, "the file ends too early: %zu bytes of pixels, expected %zu",
                      bytes.size() - at, expected);
        return false;
    }
    void* out = target.allocate(target.context, *info, reason);
    if (!out) return false;
    const auto* in = reinterpret_cast<const unsigned char*>(bytes.data() + at);
    if (target.want == Want::depth16) {
        auto* depth = static_cast<std::uint16_t*>(out);
        for (std::size_t i = 0; i < values; ++i)
            depth[i] = static_cast<std::uint16_t>(in[2 * i] << 8 | in[2 * i + 1]);
        return true;
    }
    auto* rgb = static_cast<std::uint8_t*>(out);
    const std::size_t step = static_cast<std::size_t>(info->bits) / 8;
    for (std::size_t i = 0; i < values; ++i) {
        const unsigned value = step == 2 ? in[2 * i] << 8 | in[2 * i + 1] : in[i];
        const auto scaled =
            static_cast<std::uint8_t>(std::min(value, unsigned(maximum)) * 255u / unsigned(maximum));
        if (info->channels == 3)
            rgb[i] = scaled;
        else
            rgb[3 * i] = rgb[3 * i + 1] = rgb[3 * i + 2] = scaled;
    }
    return true;
}

}  // namespace codec

namespace {

bool starts_with(std::string_view bytes, std::string_view magic) {
    return bytes.substr(0, magic.size()) == magic;
}

Status decode(std::string_view bytes, const std::string& name, const codec::Target& target, ImageInfo* info) {
    char reason[codec::kReasonBytes] = "";
    bool ok = false;
    if (starts_with(bytes, "\x89PNG\r\n\x1a\n"))
        ok = codec::decode_png(bytes, target, info, reason);
    else if (starts_with(bytes, "\xff\xd8\xff"))
        ok = codec::decode_jpeg(bytes, target, info, reason);
    else if (starts_with(bytes, "P5") || starts_with(bytes, "P6"))
        ok = codec::decode_pnm(bytes, target, info, reason);
    else
        return Status::error(Code::format,
                             "%s: %zu bytes that are no PNG, JPEG or binary PGM/PPM, expected an image",
                             name.c_str(), bytes.size());
    if (ok) return {};
    return Status::error(Code::format, "%s: %s%s", name.c_str(), reason,
                         std::strstr(reason, "expected") ? "" : ", expected a whole image");
}

// One of two image kinds, sized when the header is known.
template <class T>
void* allocate(void* context, const ImageInfo& info, char* reason) {
    auto* image = static_cast<Image<T>*>(context);
    constexpr int kChannels = sizeof(T) == 1 ? 3 : 1;
    if (sizeof(T) == 2 && (info.bits != 16 || info.channels != 1)) {
        std::snprintf(reason, codec::kReasonBytes, "%d-bit with %d channel%s, expected 16-bit grey depth",
                      info.bits, info.channels, info.channels == 1 ? "" : "s");
        return nullptr;
    }
    try {
        image->pixels.resize(std::size_t(info.width) * info.height * kChannels);
    } catch (...) {
        std::snprintf(reason, codec::kReasonBytes, "no memory for %dx%d pixels", info.width, info.height);
        return nullptr;
    }
    image->width = info.width;
    image->height = info.height;
    image->channels = kChannels;
    return image->pixels.data();
}

template <class T>
Status decode_into(std::string_view bytes, const std::string& name, codec::Want want, Image<T>* out) {
    codec::Target target{want, allocate<T>, out};
    ImageInfo info;
    const Status status = decode(bytes, name, target, &info);
    if (!status) {
        out->pixels.clear();
        out->width = out->height = 0;
    }
    return status;
}

template <class T>
Status read_into(const std::string& path, codec::Want want, Image<T>* out) {
    std::string bytes;
    Status status = read_file(path, kMaxImageBytes, &bytes);
    if (status) return decode_into(bytes, path, want, out);
    out->pixels.clear();
    out->width = out->height = 0;
    return status;
}

}  // namespace

Result<ImageInfo> decode_image_info(std::string_view bytes, const std::string& name) {
    ImageInfo info;
    BURIN_TRY(decode(bytes, name, {}, &info));
    return info;
}

Result<ImageInfo> read_image_info(const std::string& path) {
    std::string bytes;
    BURIN_TRY(read_file(path, kMaxImageBytes, &bytes));
    return decode_image_info(bytes, path);
}

Status decode_depth(std::string_view bytes, const std::string& name, Image<std::uint16_t>* out) {
    return decode_into(bytes, name, codec::Want::depth16, out);
}
Status read_depth(const std::string& path, Image<std::uint16_t>* out) {
    return read_into(path, codec::Want::depth16, out);
}
Status decode_rgb(std::string_view bytes, const std::string& name, Image<std::uint8_t>* out) {
    return decode_into(bytes, name, codec::Want::rgb8, out);
}
Status read_rgb(const std::string& path, Image<std::uint8_t>* out) {
    return read_into(path, codec::Want::rgb8, out);
}

}  // namespace burin
