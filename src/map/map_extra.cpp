// SPDX-License-Identifier: MIT
#include "map/map_extra.h"

#include <algorithm>
#include <cstring>

#include "core/hash.h"

namespace burin {
namespace {

// The last word of the last page is the digest of all before it.
constexpr std::size_t kLastPage = kMapFilePage - sizeof(std::uint64_t);

// Not inlined: five copies of it would be 4 KB of code.
[[gnu::noinline]] std::uint64_t digest_of(const unsigned char* page, std::size_t bytes,
                                          std::uint64_t before) {
    return hash_bytes(page, bytes, before);
}

class PageWriter final : public MapWriter {
  public:
    explicit PageWriter(MapWriter& to) : to_(to) {}
    Status write(const void* data, std::size_t bytes) override {
        const auto* from = static_cast<const unsigned char*>(data);
        total_ += bytes;
        while (bytes > 0) {
            if (used_ == kMapFilePage) BURIN_TRY(flush());
            const std::size_t piece = std::min(bytes, kMapFilePage - used_);
            std::memcpy(page_ + used_, from, piece);
            used_ += piece;
            from += piece;
            bytes -= piece;
        }
        return {};
    }
    Status finish() {
        if (used_ > kLastPage) BURIN_TRY(flush());
        digest_ = digest_of(page_, kLastPage, digest_);
        std::memcpy(page_ + kLastPage, &digest_, sizeof digest_);
        return to_.write(page_, sizeof page_);
    }
    std::uint64_t total() const { return total_; }

  private:
    [[gnu::noinline]] Status flush() {  // what is not used of the page is 0
        BURIN_TRY(to_.write(page_, sizeof page_));
        digest_ = digest_of(page_, sizeof page_, digest_);
        std::memset(page_, 0, sizeof page_);
        used_ = 0;
        return {};
    }

    MapWriter& to_;
    unsigned char page_[kMapFilePage] = {};
    std::size_t used_ = 0;
    std::uint64_t total_ = 0, digest_ = 0;
};

class PageReader final : public MapReader {
  public:
    PageReader(MapReader& from, std::uint32_t bytes, const char* name)
        : from_(from), left_(bytes), pages_(extra_section_bytes(bytes) / kMapFilePage), name_(name) {}
    Status read(void* to, std::size_t bytes) override {
        if (bytes > left_) return damaged("what lies behind the chunks is too short");
        return take(static_cast<unsigned char*>(to), bytes);
    }
    std::uint64_t left() const { return left_; }
    // Reads what is left, and the digest.
    Status finish() {
        BURIN_TRY(take(nullptr, left_));
        bool zeros = true;
        if (pages_ > 0) {  // the digest has a page of its own
            zeros = rest_is_zero(kMapFilePage);
            BURIN_TRY(next_page());
        }
        zeros = zeros && rest_is_zero(kLastPage);
        std::uint64_t digest;
        std::memcpy(&digest, page_ + kLastPage, sizeof digest);
        if (digest != digest_) return damaged("the checksum of what lies behind the chunks does not match");
        if (!zeros) return damaged("bytes behind the last section are not 0");
        return {};
    }
    Status damaged(const char* what) const {
        return Status::error(Code::format, "%s: map file is damaged: %s", name_, what);
    }

  private:
    [[gnu::noinline]] Status take(unsigned char* to, std::uint64_t bytes) {
        left_ -= bytes;
        while (bytes > 0) {
            if (at_ == kMapFilePage) BURIN_TRY(next_page());
            const auto piece = static_cast<std::size_t>(std::min<std::uint64_t>(bytes, kMapFilePage - at_));
            if (to) to = std::copy_n(page_ + at_, piece, to);
            at_ += piece;
            bytes -= piece;
        }
        return {};
    }
    bool rest_is_zero(std::size_t end) const {
        return std::all_of(page_ + at_, page_ + end, [](unsigned char b) { return b == 0; });
    }
    [[gnu::noinline]] Status next_page() {
        BURIN_TRY(from_.read(page_, sizeof page_));
        --pages_;
        digest_ = digest_of(page_, pages_ == 0 ? kLastPage : sizeof page_, digest_);
        at_ = 0;
        return {};
    }

    MapReader& from_;
    unsigned char page_[kMapFilePage];
    std::size_t at_ = kMapFilePage;
    std::uint64_t left_, pages_, digest_ = 0;
    const char* name_;
};

}  // namespace

std::uint64_t extra_section_bytes(std::uint32_t bytes) {
    if (bytes == 0) return 0;
    return (bytes + sizeof(std::uint64_t) + kMapFilePage - 1) / kMapFilePage * kMapFilePage;
}

Status save_extra(const MapExtra& extra, MapWriter& writer, const char* name) {
    const std::uint32_t bytes = extra.bytes();
    if (bytes == 0) return {};
    PageWriter pages(writer);
    BURIN_TRY(extra.save(pages));
    if (pages.total() != bytes)  // the head has announced it
        return Status::error(Code::state, "%s: %llu bytes to keep with the map, expected %u", name,
                             static_cast<unsigned long long>(pages.total()), bytes);
    return pages.finish();
}

Status load_extra(MapExtra* extra, std::uint32_t bytes, MapReader& reader, const char* name) {
    if (extra) extra->clear();
    if (bytes == 0) return {};
    PageReader pages(reader, bytes, name);
    Status status = extra ? extra->load(pages, bytes, name) : Status();
    if (status.ok() && extra && pages.left() > 0)
        status = pages.damaged("what lies behind the chunks is too long");
    if (status.ok()) status = pages.finish();
    if (!status.ok() && extra) extra->clear();
    return status;
}

}  // namespace burin
