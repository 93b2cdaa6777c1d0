// SPDX-License-Identifier: MIT
#include "picture.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace rig {

namespace {
constexpr std::size_t kHeader = 4096;
}

int Picture::argument(int argc, char** argv, int i) {
    if (i + 1 >= argc) return 0;
    if (std::strcmp(argv[i], "--still") == 0) {
        still_ = std::atoi(argv[i + 1]);
        return 2;
    }
    if (std::strcmp(argv[i], "--hold") == 0) {
        hold_ = std::max(0, std::atoi(argv[i + 1]));
        return 2;
    }
    if (std::strcmp(argv[i], "--frames") == 0) {
        if (!open(argv[i + 1])) std::exit(2);
        return 2;
    }
    return 0;
}

bool Picture::open(const char* path) {
    const int fd = ::open(path, O_RDONLY | O_CLOEXEC);
    char line[128] = "";
    if (fd < 0 || pread(fd, line, sizeof line - 1, 0) < 16 ||
        std::sscanf(line, "rig %d %d %d %d %d %lf %lf %lf %lf", &frames_, &depth_w_, &depth_h_, &colour_w_,
                    &colour_h_, &k_[0], &k_[1], &k_[2], &k_[3]) != 9 ||
        frames_ < 1) {
        std::fprintf(stderr, "emulator: %s: expected a file of rendered frames\n", path);
        if (fd >= 0) close(fd);
        return false;
    }
    frame_bytes_ = 2 * static_cast<std::size_t>(depth_w_) * depth_h_ +
                   3 * static_cast<std::size_t>(colour_w_) * colour_h_;
    void* p = mmap(nullptr, kHeader + frame_bytes_ * frames_, PROT_READ, MAP_SHARED, fd, 0);
    close(fd);
    if (p == MAP_FAILED) {
        std::perror(path);
        return false;
    }
    data_ = static_cast<const std::uint8_t*>(p);
    return true;
}

const std::uint8_t* Picture::at(std::uint32_t frame) const {
    return data_ + kHeader +
           frame_bytes_ * std::min<std::uint32_t>(frame, static_cast<std::uint32_t>(frames_) - 1);
}

std::uint16_t Picture::depth_mm(std::uint32_t frame, int x, int y) const {
    if (x >= depth_w_ || y >= depth_h_) return 0;
    const std::uint8_t* p = at(frame) + 2 * (static_cast<std::size_t>(y) * depth_w_ + x);
    return static_cast<std::uint16_t>(p[0] | p[1] << 8);
}

void Picture::rgb(std::uint32_t frame, int x, int y, std::uint8_t out[3]) const {
    out[0] = out[1] = out[2] = 0;
    if (x >= colour_w_ || y >= colour_h_) return;
    const std::uint8_t* p = at(frame) + 2 * static_cast<std::size_t>(depth_w_) * depth_h_ +
                            3 * (static_cast<std::size_t>(y) * colour_w_ + x);
    std::copy_n(p, 3, out);
}

}  // namespace rig
