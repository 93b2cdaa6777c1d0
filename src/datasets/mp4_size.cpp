// SPDX-License-Identifier: MIT
#include "datasets/mp4_size.h"

#include "core/camera.h"

namespace burin {
namespace {

// A file has a handful of boxes on each level, a long one thousands; more are damage.
constexpr int kMostBoxes = 100000;

struct Box {
    std::uint64_t begin = 0, end = 0;  // of the content
    char name[4] = {};
    bool is(const char* four) const {
        return name[0] == four[0] && name[1] == four[1] && name[2] == four[2] && name[3] == four[3];
    }
};

std::uint64_t big(const unsigned char* p, int bytes) {
    std::uint64_t value = 0;
    for (int i = 0; i < bytes; ++i) value = value << 8 | p[i];
    return value;
}

Status read_box(const RandomFile& file, std::uint64_t at, std::uint64_t end, Box* box) {
    unsigned char head[16];
    if (end - at < 8)
        return Status::error(Code::format, "%s: box at byte %llu is cut, expected a whole one",
                             file.path().c_str(), static_cast<unsigned long long>(at));
    BURIN_TRY(file.read(at, 8, head));
    std::uint64_t size = big(head, 4);
    box->begin = at + 8;
    for (int i = 0; i < 4; ++i) box->name[i] = static_cast<char>(head[4 + i]);
    if (size == 0) size = end - at;  // to the end
    if (size == 1 && end - at >= 16) {
        BURIN_TRY(file.read(at, 16, head));
        size = big(head + 8, 8);
        box->begin = at + 16;
    }
    if (size < box->begin - at || size > end - at)
        return Status::error(
            Code::format, "%s: box at byte %llu has %llu bytes, expected at most the %llu that follow",
            file.path().c_str(), static_cast<unsigned long long>(at), static_cast<unsigned long long>(size),
            static_cast<unsigned long long>(end - at));
    box->end = at + size;
    return {};
}

Result<PictureSize> size_in_tkhd(const RandomFile& file, const Box& box) {
    PictureSize size;
    unsigned char last[8];
    if (box.end - box.begin < 84) return size;  // version 0 has 84 bytes
    BURIN_TRY(file.read(box.end - 8, 8, last));
    const std::uint64_t width = big(last, 4) >> 16, height = big(last + 4, 4) >> 16;
    if (width < 1 || height < 1 || width > kMaxImageSide || height > kMaxImageSide) return size;  // sound
    size.width = static_cast<int>(width);
    size.height = static_cast<int>(height);
    return size;
}

}  // namespace

Result<PictureSize> mp4_picture_size(const RandomFile& file) {
    std::uint64_t at = 0, end = file.size();
    int boxes = 0;
    // Goes into moov and into each trak, past everything else.
    while (at < end && boxes++ < kMostBoxes) {
        Box box;
        BURIN_TRY(read_box(file, at, end, &box));
        at = box.is("moov") || box.is("trak") ? box.begin : box.end;
        if (!box.is("tkhd")) continue;
        const Result<PictureSize> size = size_in_tkhd(file, box);
        if (!size || size->width > 0) return size;
    }
    return Status::error(Code::format, "%s: no track with pictures, expected an MP4 video",
                         file.path().c_str());
}

}  // namespace burin
