// SPDX-License-Identifier: MIT
#include "capture/recording_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace burin {

// Not in the header: capture has no run-time types, which sanitized callers would look for.
DiskFile::~DiskFile() { close(); }
bool DiskFile::is_open() const { return fd_ >= 0; }
const char* DiskFile::path() const { return path_; }

void DiskFile::close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
}

Status DiskFile::create(const char* folder, const char* name) {
    close();
    const int length = std::snprintf(path_, sizeof path_, "%s/%s", folder, name);
    if (*folder == 0 || length < 0 || static_cast<std::size_t>(length) > kMaxPath)
        return Status::error(Code::invalid_argument,
                             "recording: a folder's name of %zu bytes, expected 1 to %zu",
                             std::strlen(folder), kMaxPath - std::strlen(name) - 1);
    if (::mkdir(folder, 0755) != 0 && errno != EEXIST)
        return Status::error(Code::io, "%s: cannot create the folder: %s", folder, std::strerror(errno));
    fd_ = ::open(path_, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    if (fd_ < 0 && errno == EEXIST)
        return Status::error(Code::io, "%s: is there already, expected a folder without a recording", path_);
    if (fd_ < 0) return Status::error(Code::io, "%s: cannot create: %s", path_, std::strerror(errno));
    flushed_ = 0;
    // The name too must survive a power cut. Not every file system can sync a folder; then its name is as
    // safe as any.
    const int parent = ::open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (parent >= 0) {
        (void)!::fsync(parent);
        ::close(parent);
    }
    return {};
}

std::int64_t DiskFile::write(std::uint64_t at, const void* from, std::size_t bytes) {
    const ssize_t put = ::pwrite(fd_, from, bytes, static_cast<off_t>(at));
    return put < 0 ? -errno : put;
}

int DiskFile::sync() {
#if defined(__linux__)
    return ::fdatasync(fd_) == 0 ? 0 : -errno;  // also makes a grown size durable
#else
    return ::fsync(fd_) == 0 ? 0 : -errno;
#endif
}

int DiskFile::truncate(std::uint64_t bytes) {
    return ::ftruncate(fd_, static_cast<off_t>(bytes)) == 0 ? 0 : -errno;
}

void DiskFile::flush_soon(std::uint64_t end) {
#if defined(__linux__)
    ::sync_file_range(fd_, static_cast<off_t>(flushed_), static_cast<off_t>(end - flushed_),
                      SYNC_FILE_RANGE_WRITE);
#endif
    flushed_ = end;
}

}  // namespace burin
