// SPDX-License-Identifier: MIT
#include "map/store_io.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace burin {

int read_all(StoreIo& io, std::uint64_t at, void* to, std::size_t bytes) {
    auto* p = static_cast<unsigned char*>(to);
    while (bytes > 0) {
        const std::int64_t got = io.read(at, p, bytes);
        if (got == -EINTR) continue;
        if (got <= 0) return got < 0 ? static_cast<int>(-got) : EIO;
        p += got;
        at += static_cast<std::uint64_t>(got);
        bytes -= static_cast<std::size_t>(got);
    }
    return 0;
}

int write_all(StoreIo& io, std::uint64_t at, const void* from, std::size_t bytes) {
    const auto* p = static_cast<const unsigned char*>(from);
    while (bytes > 0) {
        const std::int64_t put = io.write(at, p, bytes);
        if (put == -EINTR) continue;
        if (put <= 0) return put < 0 ? static_cast<int>(-put) : EIO;
        p += put;
        at += static_cast<std::uint64_t>(put);
        bytes -= static_cast<std::size_t>(put);
    }
    return 0;
}

// Not in the header: the runtime has no run-time types, which sanitized callers would look for.
FileIo::~FileIo() { close(); }
bool FileIo::is_open() const { return fd_ >= 0; }

Status FileIo::lock() {
    if (::flock(fd_, LOCK_EX | LOCK_NB) == 0) return {};
    const int error = errno;
    close();
    return Status::error(Code::io, "%s: store is in use: %s", path_, std::strerror(error));
}

Status FileIo::open(const char* path) {
    close();
    if (std::strlen(path) > kMaxPath)
        return Status::error(Code::invalid_argument, "store path of %zu bytes, expected at most %zu",
                             std::strlen(path), kMaxPath);
    std::strcpy(path_, path);
    fd_ = ::open(path, O_RDWR | O_CLOEXEC);
    if (fd_ < 0) return Status::error(Code::io, "%s: cannot open the store: %s", path, std::strerror(errno));
    struct stat info;
    if (::fstat(fd_, &info) == 0 && !S_ISREG(info.st_mode)) {
        close();
        return Status::error(Code::io, "%s: cannot open the store: it is no regular file", path);
    }
    return lock();
}

Status FileIo::create(const char* path) {
    close();
    const std::size_t length = std::strlen(path);
    if (length == 0 || length > kMaxPath)
        return Status::error(Code::invalid_argument, "store path of %zu bytes, expected 1 to %zu", length,
                             kMaxPath);
    std::memcpy(path_, path, length + 1);
    std::memcpy(part_, path, length);
    std::memcpy(part_ + length, ".part", 6);
    if (::access(path_, F_OK) == 0)
        return Status::error(Code::io, "%s: cannot create the store: it exists already", path_);
    ::unlink(part_);
    fd_ = ::open(part_, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    if (fd_ < 0) return Status::error(Code::io, "%s: cannot create: %s", part_, std::strerror(errno));
    unpublished_ = true;
    return lock();
}

Status FileIo::publish() {
    // A link fails where the name is taken, a rename would replace what is there.
    if (::link(part_, path_) != 0 && (errno == EEXIST || std::rename(part_, path_) != 0)) {
        const int error = errno;
        close();
        return Status::error(Code::io, "%s: cannot create the store: %s", path_, std::strerror(error));
    }
    ::unlink(part_);
    unpublished_ = false;
    // The name too must survive a power cut. Not every file system can sync a folder; then its name is as
    // safe as any.
    char folder[kMaxPath + 1];
    std::strcpy(folder, path_);
    char* slash = std::strrchr(folder, '/');
    if (slash) slash[slash == folder ? 1 : 0] = 0;
    const int fd = ::open(slash ? folder : ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) {
        (void)!::fsync(fd);
        ::close(fd);
    }
    return {};
}

void FileIo::close() {
    if (fd_ < 0) return;
    ::close(fd_);
    fd_ = -1;
    if (unpublished_) ::unlink(part_);
    unpublished_ = false;
}

std::int64_t FileIo::read(std::uint64_t at, void* to, std::size_t bytes) {
    const ssize_t got = ::pread(fd_, to, bytes, static_cast<off_t>(at));
    return got < 0 ? -errno : got;
}
std::int64_t FileIo::write(std::uint64_t at, const void* from, std::size_t bytes) {
    const ssize_t put = ::pwrite(fd_, from, bytes, static_cast<off_t>(at));
    return put < 0 ? -errno : put;
}
int FileIo::sync() {
#if defined(__linux__)
    return ::fdatasync(fd_) == 0 ? 0 : -errno;  // also makes a grown size durable
#else
    return ::fsync(fd_) == 0 ? 0 : -errno;
#endif
}
std::int64_t FileIo::size() {
    struct stat info;
    return ::fstat(fd_, &info) == 0 ? static_cast<std::int64_t>(info.st_size) : -errno;
}
int FileIo::truncate(std::uint64_t bytes) {
    return ::ftruncate(fd_, static_cast<off_t>(bytes)) == 0 ? 0 : -errno;
}

}  // namespace burin
