// SPDX-License-Identifier: MIT
// What the store asks of a file. Tests put one under it that writes short, fills up or dies.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/status.h"

namespace burin {

// Results below 0 are -errno. Reading and writing may happen on two threads at once, at different offsets.
class StoreIo {
  public:
    virtual ~StoreIo() = default;
    // Bytes done, which may be fewer than asked for (reading: 0 at the end).
    virtual std::int64_t read(std::uint64_t at, void* to, std::size_t bytes) = 0;
    virtual std::int64_t write(std::uint64_t at, const void* from, std::size_t bytes) = 0;
    virtual int sync() = 0;  // returns when what was written survives a power cut
    virtual std::int64_t size() = 0;
    virtual int truncate(std::uint64_t bytes) = 0;
};

// All of it, in as many steps as it takes. 0, or an errno; EIO for an end of file too early.
int read_all(StoreIo& io, std::uint64_t at, void* to, std::size_t bytes);
int write_all(StoreIo& io, std::uint64_t at, const void* from, std::size_t bytes);

class FileIo final : public StoreIo {
  public:
    FileIo() = default;
    ~FileIo() override;
    FileIo(const FileIo&) = delete;
    FileIo& operator=(const FileIo&) = delete;

    // An existing file, locked against a second writer.
    Status open(const char* path);
    // A new file PATH.part, replacing a stale one; publish() gives it the name PATH, which must be free.
    Status create(const char* path);
    Status publish();
    void close();
    bool is_open() const;

    std::int64_t read(std::uint64_t at, void* to, std::size_t bytes) override;
    std::int64_t write(std::uint64_t at, const void* from, std::size_t bytes) override;
    int sync() override;
    std::int64_t size() override;
    int truncate(std::uint64_t bytes) override;

  private:
    Status lock();

    static constexpr std::size_t kMaxPath = 1000;  // as in core/atomic_file.h
    int fd_ = -1;
    bool unpublished_ = false;
    char path_[kMaxPath + 1] = "";
    char part_[kMaxPath + 6] = "";
};

}  // namespace burin
