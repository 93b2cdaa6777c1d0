// SPDX-License-Identifier: MIT
// One /dev/videoN: questions, buffers, streaming.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "core/status.h"

struct v4l2_buffer;

namespace burin {

// ioctl() again after an interruption; -1 with errno.
int v4l2_call(int fd, unsigned long request, void* argument);
// A refused call as a status: ENODEV and ENXIO disconnected, EBUSY busy, EACCES denied, else io.
Status v4l2_error(const char* node, const char* what, int error);

struct V4l2Mapped {
    std::uint8_t* memory = nullptr;
    std::size_t bytes = 0;
    int dmabuf = -1;
};

struct V4l2Filled {
    int index = -1;
    std::size_t bytes = 0;
    std::uint32_t sequence = 0;
    std::int64_t stamp_ns = 0;  // of the driver
    bool monotonic = false;     // on CLOCK_MONOTONIC
    bool damaged = false;
};

class V4l2Node {
  public:
    static constexpr int kMaxBuffers = 32;
    ~V4l2Node() { close(); }

    // Takes a descriptor of its own, or a copy of `fd` when that is not -1.
    Status open(const char* path, int fd, bool metadata);
    void close();
    int fd() const { return fd_; }
    const char* path() const { return path_; }
    bool is_open() const { return fd_ >= 0; }

    // Buffers, mapped and queued, and the stream on. Descriptors of their memory where the driver exports
    // them.
    Status start(int buffers, bool export_memory);
    // Idempotent; the buffers stay mapped until close or the next start.
    Status stop();
    bool streaming() const { return streaming_; }

    // A filled buffer; index -1: none now.
    Status take(V4l2Filled* filled);
    // Back to the driver; nothing when the stream is off. Any thread.
    Status give(int index);
    Status queue(int index);
    V4l2Mapped& buffer(int index) { return buffers_[index]; }
    int buffers() const { return count_; }

  private:
    Status request(int count);
    void release();

    int fd_ = -1;
    char path_[64] = "";
    unsigned type_ = 0;
    std::atomic<bool> streaming_{false};  // give() comes from any thread
    V4l2Mapped buffers_[kMaxBuffers];
    int count_ = 0;
};

}  // namespace burin
