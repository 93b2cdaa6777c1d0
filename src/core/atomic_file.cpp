// SPDX-License-Identifier: MIT
#include "core/atomic_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace burin {

Status AtomicFile::open(const char* path) {
    if (file_)
        return Status::error(Code::state, "cannot open '%s': '%s' is still being written", path, path_);
    const std::size_t length = std::strlen(path);
    if (length == 0)
        return Status::error(Code::invalid_argument, "the output path is empty, expected a file name");
    if (length > kMaxPath)
        return Status::error(Code::invalid_argument,
                             "output path of %zu bytes ('%.40s...'), expected at most %zu", length, path,
                             kMaxPath);
    std::memcpy(path_, path, length + 1);
    std::memcpy(part_, path, length);
    std::memcpy(part_ + length, ".part", 6);

    // A rename would replace a device node (/dev/full) or fail late on a folder, and it would ignore write
    // protection.
    struct stat info;
    if (::stat(path_, &info) == 0) {
        if (!S_ISREG(info.st_mode))
            return Status::error(Code::io, "cannot write '%s': it exists and is no regular file", path_);
        if (::access(path_, W_OK) != 0)
            return Status::error(Code::io, "cannot write '%s': %s", path_, std::strerror(errno));
    }
    // A stale part of a killed process goes; "x" then refuses to write through a link somebody put there.
    ::unlink(part_);
    file_ = std::fopen(part_, "wbx");
    if (!file_) return Status::error(Code::io, "cannot create '%s': %s", part_, std::strerror(errno));
    constexpr std::size_t kBufferBytes = 65536;  // fewer system calls than stdio's 4 KiB; freed with the file
    std::setvbuf(file_, nullptr, _IOFBF, kBufferBytes);
    return {};
}

Status AtomicFile::write(const void* data, std::size_t bytes) {
    if (!file_) return Status::error(Code::state, "cannot write '%s': the file is not open", path_);
    errno = 0;
    if (bytes != 0 && std::fwrite(data, 1, bytes, file_) != bytes) return fail("write", errno);
    return {};
}

Status AtomicFile::commit(bool sync) {
    if (!file_) return Status::error(Code::state, "cannot finish '%s': the file is not open", path_);
    errno = 0;
    if (std::fflush(file_) != 0) return fail("write", errno);
    if (sync && ::fsync(::fileno(file_)) != 0) return fail("sync", errno);
    std::FILE* file = file_;
    file_ = nullptr;
    if (std::fclose(file) != 0) {  // network file systems report a full disk only here
        const int error_number = errno;
        ::unlink(part_);
        return fail("write", error_number);
    }
    if (std::rename(part_, path_) != 0) {
        const int error_number = errno;
        ::unlink(part_);
        return fail("rename the finished", error_number);
    }
    return {};
}

void AtomicFile::discard() {
    if (!file_) return;
    std::fclose(file_);
    file_ = nullptr;
    ::unlink(part_);
}

Status AtomicFile::fail(const char* doing, int error_number) {
    discard();
    return Status::error(Code::io, "cannot %s '%s': %s", doing, path_,
                         error_number ? std::strerror(error_number) : "output error");
}

Status write_file_atomically(const char* path, const void* data, std::size_t bytes) {
    AtomicFile file;
    BURIN_TRY(file.open(path));
    BURIN_TRY(file.write(data, bytes));
    return file.commit();
}

}  // namespace burin
