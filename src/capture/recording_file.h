// SPDX-License-Identifier: MIT
// What the recorder asks of a file. Tests put one under it that writes short, fills up or dies.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/status.h"

namespace burin {

// Results below 0 are -errno.
class RecordingFile {
  public:
    virtual ~RecordingFile() = default;
    virtual std::int64_t write(std::uint64_t at, const void* from, std::size_t bytes) = 0;  // may be fewer
    virtual int sync() = 0;  // returns when what was written survives a power cut
    virtual int truncate(std::uint64_t bytes) = 0;
    // What was written since the last call may go to the disk now; does not wait. So that sync() is short.
    virtual void flush_soon(std::uint64_t end) = 0;
};

class DiskFile final : public RecordingFile {
  public:
    DiskFile() = default;
    ~DiskFile() override;
    DiskFile(const DiskFile&) = delete;
    DiskFile& operator=(const DiskFile&) = delete;

    // A new file in a folder, which is made when its parent is there. Error (io): it is there already.
    Status create(const char* folder, const char* name);
    bool is_open() const;
    const char* path() const;
    void close();

    std::int64_t write(std::uint64_t at, const void* from, std::size_t bytes) override;
    int sync() override;
    int truncate(std::uint64_t bytes) override;
    void flush_soon(std::uint64_t end) override;

  private:
    static constexpr std::size_t kMaxPath = 1000;  // as in core/atomic_file.h
    int fd_ = -1;
    std::uint64_t flushed_ = 0;
    char path_[kMaxPath + 1] = "";
};

}  // namespace burin
