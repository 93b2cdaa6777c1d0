// SPDX-License-Identifier: MIT
// Output that is either complete or not there: bytes go to "PATH.part", which takes the name PATH only when
// the last byte has been accepted. Whatever fails on the way (full disk, no permission), the part file is
// removed and a file that stood under PATH before is untouched.
#pragma once

#include <cstddef>
#include <cstdio>

#include "core/status.h"

namespace burin {

class AtomicFile {
  public:
    AtomicFile() = default;
    ~AtomicFile() { discard(); }
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    // Creates PATH.part, replacing a stale one. Error: PATH exists but is no regular file or is
    // write-protected, its folder is missing or unwritable, or PATH is longer than 1000 bytes. One file at a
    // time.
    Status open(const char* path);

    // Appends. Buffered by stdio (64 KiB), so a full disk may show up only in a later write or in commit().
    // After an error the part file is gone and further writes return the same kind of error.
    Status write(const void* data, std::size_t bytes);

    // Flushes, with `sync` also waits until the disk has the bytes (some 10 ms; for what must survive a power
    // cut), and renames. On error the part file is gone.
    Status commit(bool sync = false);

    // Closes and removes the part file; does nothing after commit() or before open().
    void discard();

    bool is_open() const { return file_ != nullptr; }

  private:
    Status fail(const char* doing, int error_number);

    static constexpr std::size_t kMaxPath = 1000;  // a Status holds some 500 bytes; longer paths help nobody
    std::FILE* file_ = nullptr;
    char path_[kMaxPath + 1] = "";
    char part_[kMaxPath + 6] = "";
};

// The whole of a small file (a report, a trajectory) in one call.
Status write_file_atomically(const char* path, const void* data, std::size_t bytes);

}  // namespace burin
