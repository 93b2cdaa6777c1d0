// SPDX-License-Identifier: MIT
// One camera of libcamera: configuration, mapped buffers, requests going round.
#pragma once

#include <libcamera/libcamera.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <vector>

#include "capture/source.h"

namespace burin {

class LibcameraDevice {
  public:
    ~LibcameraDevice() { close(); }
    Status open(const std::shared_ptr<libcamera::Camera>& camera, const SourceOptions& options);
    const DeviceInfo& info() const { return info_; }
    Status start(SourceSink* sink);
    Status pump(std::int64_t deadline_ns);
    Status stop();
    void give_back(std::uint64_t token);  // the index of a buffer
    void close();

  private:
    static constexpr int kMaxBuffers = 32;
    struct Mapped {
        libcamera::FrameBuffer* buffer = nullptr;
        std::unique_ptr<libcamera::Request> request;
        std::uint8_t* memory = nullptr;  // of the whole dmabuf
        std::size_t bytes = 0, offset = 0;
    };
    Status configure(const SourceOptions& options);
    Status map_buffers();
    void completed(libcamera::Request* request);  // on libcamera's thread
    void gone();
    void hand_over(int index);
    void copy_image(const std::uint8_t* from, std::uint8_t* to) const;

    std::shared_ptr<libcamera::Camera> camera_;
    std::unique_ptr<libcamera::CameraConfiguration> configuration_;
    std::unique_ptr<libcamera::FrameBufferAllocator> allocator_;
    std::vector<Mapped> mapped_;
    DeviceInfo info_;
    SourceSink* sink_ = nullptr;
    bool lend_ = true, acquired_ = false;
    std::size_t stride_ = 0;

    std::mutex mutex_;  // of all below
    std::condition_variable arrived_;
    int done_[kMaxBuffers] = {};  // buffers that were filled, in order
    int done_count_ = 0;
    bool streaming_ = false, disconnected_ = false;
};

}  // namespace burin
