// SPDX-License-Identifier: MIT
#include "datasets/random_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace burin {

RandomFile::~RandomFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

void RandomFile::swap(RandomFile& other) {
    std::swap(path_, other.path_);
    std::swap(memory_, other.memory_);
    std::swap(size_, other.size_);
    std::swap(descriptor_, other.descriptor_);
}

Status RandomFile::open(const std::string& path) {
    RandomFile file;
    file.path_ = path;
    file.descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    struct stat info;
    if (file.descriptor_ < 0 || ::fstat(file.descriptor_, &info) != 0)
        return Status::error(Code::io, "%s: %s", path.c_str(), std::strerror(errno));
    if (!S_ISREG(info.st_mode))
        return Status::error(Code::io, "%s: is no regular file, expected one", path.c_str());
    file.size_ = static_cast<std::uint64_t>(info.st_size);
    swap(file);
    return {};
}

RandomFile RandomFile::over(std::string_view bytes, const std::string& name) {
    RandomFile file;
    file.path_ = name;
    file.memory_ = bytes;
    file.size_ = bytes.size();
    return file;
}

Status RandomFile::check(std::uint64_t offset, std::size_t bytes) const {
    if (offset <= size_ && bytes <= size_ - offset) return {};
    return Status::error(Code::format, "%s: ends at byte %llu, expected %zu bytes at %llu", path_.c_str(),
                         static_cast<unsigned long long>(size_), bytes,
                         static_cast<unsigned long long>(offset));
}

Status RandomFile::read(std::uint64_t offset, std::size_t bytes, void* out) const {
    BURIN_TRY(check(offset, bytes));
    if (descriptor_ < 0) {
        std::memcpy(out, memory_.data() + offset, bytes);
        return {};
    }
    for (std::size_t done = 0; done < bytes;) {
        const ssize_t got = ::pread(descriptor_, static_cast<char*>(out) + done, bytes - done,
                                    static_cast<off_t>(offset + done));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0)
            return Status::error(Code::io, "%s: %s at byte %llu", path_.c_str(),
                                 got < 0 ? std::strerror(errno) : "became shorter",
                                 static_cast<unsigned long long>(offset + done));
        done += static_cast<std::size_t>(got);
    }
    return {};
}

Status RandomFile::read(std::uint64_t offset, std::size_t bytes, std::string* out) const {
    BURIN_TRY(check(offset, bytes));  // before the memory is taken
    out->resize(bytes);
    return read(offset, bytes, static_cast<void*>(out->data()));
}

}  // namespace burin
