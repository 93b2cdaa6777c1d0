// SPDX-License-Identifier: MIT
// Reads pieces of a large file where they lie, from any number of threads; or of bytes in memory, for tests.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/status.h"

namespace burin {

class RandomFile {
  public:
    RandomFile() = default;
    ~RandomFile();
    RandomFile(RandomFile&& other) noexcept { swap(other); }
    RandomFile& operator=(RandomFile&& other) noexcept {
        swap(other);
        return *this;
    }

    // Error (io): missing, a folder, not readable.
    Status open(const std::string& path);
    // The bytes must outlive it; `name` stands for the file in messages.
    static RandomFile over(std::string_view bytes, const std::string& name);

    const std::string& path() const { return path_; }
    std::uint64_t size() const { return size_; }

    // Exactly `bytes` bytes from `offset` on. Error (format): the file ends before; (io): the disk.
    Status read(std::uint64_t offset, std::size_t bytes, void* out) const;
    Status read(std::uint64_t offset, std::size_t bytes, std::string* out) const;

  private:
    void swap(RandomFile& other);
    Status check(std::uint64_t offset, std::size_t bytes) const;

    std::string path_;
    std::string_view memory_;
    std::uint64_t size_ = 0;
    int descriptor_ = -1;
};

}  // namespace burin
