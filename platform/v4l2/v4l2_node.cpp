// SPDX-License-Identifier: MIT
#include "platform/v4l2/v4l2_node.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace burin {

int v4l2_call(int fd, unsigned long request, void* argument) {
    int result = 0;
    do result = ::ioctl(fd, request, argument);
    while (result < 0 && errno == EINTR);
    return result;
}

Status v4l2_error(const char* node, const char* what, int error) {
    const Code code = error == ENODEV || error == ENXIO || error == ENOENT ? Code::disconnected
                      : error == EBUSY                                     ? Code::busy
                      : error == EACCES || error == EPERM                  ? Code::denied
                                                                           : Code::io;
    if (code == Code::denied)
        return Status::error(
            code, "%s: %s: no permission; put your user into the group 'video' and log in again", node, what);
    if (code == Code::disconnected) return Status::error(code, "%s: %s: the device is gone", node, what);
    return Status::error(code, "%s: %s: %s", node, what, std::strerror(error));
}

Status V4l2Node::open(const char* path, int fd, bool metadata) {
    std::snprintf(path_, sizeof path_, "%s", path);
    fd_ = fd >= 0 ? ::fcntl(fd, F_DUPFD_CLOEXEC, 0) : ::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (fd_ < 0) return v4l2_error(path_, "open", errno);
    if (fd >= 0) ::fcntl(fd_, F_SETFL, ::fcntl(fd_, F_GETFL) | O_NONBLOCK);
    type_ = metadata ? V4L2_BUF_TYPE_META_CAPTURE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
    v4l2_capability caps = {};
    if (v4l2_call(fd_, VIDIOC_QUERYCAP, &caps) < 0) return v4l2_error(path_, "is no V4L2 device", errno);
    const std::uint32_t has = caps.capabilities & V4L2_CAP_DEVICE_CAPS ? caps.device_caps : caps.capabilities;
    const std::uint32_t wanted = metadata ? V4L2_CAP_META_CAPTURE : V4L2_CAP_VIDEO_CAPTURE;
    if (!(has & wanted) || !(has & V4L2_CAP_STREAMING))
        return Status::error(Code::unsupported, "%s: cannot stream %s into memory (capabilities %#x)", path_,
                             metadata ? "metadata" : "images", has);
    return {};
}

void V4l2Node::release() {
    for (int i = 0; i < count_; ++i) {
        if (buffers_[i].dmabuf >= 0) ::close(buffers_[i].dmabuf);
        if (buffers_[i].memory) ::munmap(buffers_[i].memory, buffers_[i].bytes);
        buffers_[i] = V4l2Mapped();
    }
    count_ = 0;
}

void V4l2Node::close() {
    (void)stop();
    release();
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
}

Status V4l2Node::request(int count) {
    v4l2_requestbuffers r = {};
    r.count = static_cast<std::uint32_t>(count);
    r.type = type_;
    r.memory = V4L2_MEMORY_MMAP;
    if (v4l2_call(fd_, VIDIOC_REQBUFS, &r) < 0) return v4l2_error(path_, "no buffers (REQBUFS)", errno);
    if (count > 0 && (r.count < 2 || r.count > kMaxBuffers))
        return Status::error(Code::io, "%s: the driver gives %u buffers, expected 2..%d", path_, r.count,
                             kMaxBuffers);
    count_ = 0;
    for (std::uint32_t i = 0; i < r.count && count > 0; ++i) {
        v4l2_buffer b = {};
        b.index = i;
        b.type = type_;
        b.memory = V4L2_MEMORY_MMAP;
        if (v4l2_call(fd_, VIDIOC_QUERYBUF, &b) < 0) return v4l2_error(path_, "QUERYBUF", errno);
        void* at = ::mmap(nullptr, b.length, PROT_READ | PROT_WRITE, MAP_SHARED, fd_,
                          static_cast<off_t>(b.m.offset));
        if (at == MAP_FAILED) return v4l2_error(path_, "a buffer cannot be mapped", errno);
        buffers_[i].memory = static_cast<std::uint8_t*>(at);
        buffers_[i].bytes = b.length;
        count_ = static_cast<int>(i) + 1;
    }
    return {};
}

Status V4l2Node::start(int buffers, bool export_memory) {
    release();
    (void)request(0);  // what an earlier stream left
    BURIN_TRY(request(buffers));
    for (int i = 0; i < count_; ++i) {
        v4l2_exportbuffer e = {};
        e.type = type_;
        e.index = static_cast<std::uint32_t>(i);
        e.flags = O_CLOEXEC | O_RDONLY;
        // Not every driver can; then there is no descriptor.
        if (export_memory && v4l2_call(fd_, VIDIOC_EXPBUF, &e) == 0) buffers_[i].dmabuf = e.fd;
        BURIN_TRY(queue(i));
    }
    int type = static_cast<int>(type_);
    if (v4l2_call(fd_, VIDIOC_STREAMON, &type) < 0) {
        const int error = errno;
        release();
        return v4l2_error(path_, "does not start (STREAMON)", error);
    }
    streaming_ = true;
    return {};
}

Status V4l2Node::stop() {
    if (!streaming_) return {};
    streaming_ = false;
    int type = static_cast<int>(type_);
    if (v4l2_call(fd_, VIDIOC_STREAMOFF, &type) < 0 && errno != ENODEV)
        return v4l2_error(path_, "STREAMOFF", errno);
    return {};
}

Status V4l2Node::take(V4l2Filled* filled) {
    filled->index = -1;
    v4l2_buffer b = {};
    b.type = type_;
    b.memory = V4L2_MEMORY_MMAP;
    if (v4l2_call(fd_, VIDIOC_DQBUF, &b) < 0) {
        if (errno == EAGAIN) return {};
        return v4l2_error(path_, "no image (DQBUF)", errno);
    }
    if (b.index >= static_cast<std::uint32_t>(count_))
        return Status::error(Code::format, "%s: the driver gives buffer %u of %d", path_, b.index, count_);
    filled->index = static_cast<int>(b.index);
    filled->bytes = b.bytesused < buffers_[b.index].bytes ? b.bytesused : buffers_[b.index].bytes;
    filled->sequence = b.sequence;
    filled->stamp_ns = static_cast<std::int64_t>(b.timestamp.tv_sec) * 1'000'000'000 +
                       static_cast<std::int64_t>(b.timestamp.tv_usec) * 1000;
    filled->monotonic = (b.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    filled->damaged = (b.flags & V4L2_BUF_FLAG_ERROR) != 0;
    return {};
}

Status V4l2Node::give(int index) { return streaming_ ? queue(index) : Status(); }

Status V4l2Node::queue(int index) {
    v4l2_buffer b = {};
    b.index = static_cast<std::uint32_t>(index);
    b.type = type_;
    b.memory = V4L2_MEMORY_MMAP;
    if (v4l2_call(fd_, VIDIOC_QBUF, &b) < 0) return v4l2_error(path_, "a buffer is refused (QBUF)", errno);
    return {};
}

}  // namespace burin
