// SPDX-License-Identifier: MIT
// Collects small values into blocks for an AtomicFile: a call per field into stdio would cost more than the
// disk.
#pragma once

#include <bit>
#include <cstring>
#include <string>
#include <string_view>

#include "core/atomic_file.h"

namespace burin {

static_assert(std::endian::native == std::endian::little,
              "the binary mesh formats are written as they lie in memory");

class BlockWriter {
  public:
    Status open(const std::string& path) { return file_.open(path.c_str()); }

    // The first error is kept and reported by finish(); what follows it is dropped.
    void bytes(const void* data, std::size_t count) {
        const char* from = static_cast<const char*>(data);
        while (count > 0) {
            if (used_ == kBlockBytes) flush();
            const std::size_t part = count < kBlockBytes - used_ ? count : kBlockBytes - used_;
            std::memcpy(block_ + used_, from, part);
            used_ += part;
            from += part;
            count -= part;
        }
    }
    template <class T>
    void value(const T& v) {
        if (kBlockBytes - used_ < sizeof(T)) flush();
        std::memcpy(block_ + used_, &v, sizeof(T));
        used_ += sizeof(T);
    }
    void text(std::string_view s) { bytes(s.data(), s.size()); }

    bool failed() const { return !status_.ok(); }  // lets long loops end early
    Status finish() {
        flush();
        return status_.ok() ? file_.commit() : status_;
    }

  private:
    void flush() {
        if (status_.ok() && used_ > 0) status_ = file_.write(block_, used_);
        used_ = 0;
    }

    static constexpr std::size_t kBlockBytes = 65536;  // past the size where a write() call still shows
    AtomicFile file_;
    Status status_;
    std::size_t used_ = 0;
    char block_[kBlockBytes];
};

}  // namespace burin
