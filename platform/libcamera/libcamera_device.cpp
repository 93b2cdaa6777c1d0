// SPDX-License-Identifier: MIT
#include "platform/libcamera/libcamera_device.h"

#include <sys/mman.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "capture/monotonic.h"

namespace burin {
namespace {

struct Format {
    libcamera::PixelFormat theirs;
    PixelFormat ours;
};

// What needs no unpacking, the best first. Names of DRM count from the low byte: its RGB888 is B G R in
// memory.
const Format* find_format(const libcamera::PixelFormat& theirs) {
    static const Format kFormats[] = {
        {libcamera::formats::YUYV, PixelFormat::yuyv},   {libcamera::formats::NV12, PixelFormat::nv12},
        {libcamera::formats::NV21, PixelFormat::nv21},   {libcamera::formats::BGR888, PixelFormat::rgb8},
        {libcamera::formats::RGB888, PixelFormat::bgr8}, {libcamera::formats::R8, PixelFormat::grey8},
    };
    for (const Format& f : kFormats)
        if (f.theirs == theirs) return &f;
    return nullptr;
}

}  // namespace

Status LibcameraDevice::open(const std::shared_ptr<libcamera::Camera>& camera, const SourceOptions& options) {
    camera_ = camera;
    lend_ = options.lend;
    if (camera_->acquire() != 0)
        return Status::error(Code::busy, "libcamera: %.200s is in use by another program",
                             camera_->id().c_str());
    acquired_ = true;
    std::snprintf(info_.name, sizeof info_.name, "%.95s", camera_->id().c_str());
    std::snprintf(info_.location, sizeof info_.location, "%.63s", camera_->id().c_str());
    BURIN_TRY(configure(options));
    camera_->requestCompleted.connect(this, &LibcameraDevice::completed);
    camera_->disconnected.connect(this, &LibcameraDevice::gone);
    return {};
}

Status LibcameraDevice::configure(const SourceOptions& o) {
    configuration_ = camera_->generateConfiguration({libcamera::StreamRole::Viewfinder});
    if (!configuration_ || configuration_->size() != 1)
        return Status::error(Code::unsupported, "libcamera: %.200s has no viewfinder stream",
                             camera_->id().c_str());
    libcamera::StreamConfiguration& s = configuration_->at(0);
    for (const libcamera::PixelFormat& f : s.formats().pixelformats()) {
        if (!find_format(f) || (*o.colour_format && f.toString() != o.colour_format)) continue;
        s.pixelFormat = f;
        break;
    }
    const auto width = static_cast<unsigned>(o.colour_width > 0 ? o.colour_width : 640);
    const auto height = static_cast<unsigned>(o.colour_height > 0 ? o.colour_height : 480);
    s.size = libcamera::Size(width, height);
    s.bufferCount = static_cast<unsigned>(o.buffers);
    const Format* format = nullptr;
    if (configuration_->validate() == libcamera::CameraConfiguration::Invalid ||
        !(format = find_format(s.pixelFormat)) || s.size.width == 0 || s.size.height == 0 ||
        s.size.width > static_cast<unsigned>(kMaxImageSide) ||
        s.size.height > static_cast<unsigned>(kMaxImageSide) ||
        (o.colour_width > 0 && (s.size.width != width || s.size.height != height)))
        return Status::error(Code::unsupported, "libcamera: %.150s offers %.60s, expected %ux%u of %s",
                             camera_->id().c_str(), s.toString().c_str(), width, height,
                             *o.colour_format ? o.colour_format : "YUYV, NV12, NV21, RGB888, BGR888 or R8");
    if (camera_->configure(configuration_.get()) != 0)
        return Status::error(Code::io, "libcamera: %.150s refuses %.60s", camera_->id().c_str(),
                             s.toString().c_str());
    StreamInfo& info = info_.at(StreamKind::colour);
    info.kind = StreamKind::colour;
    info.pixels = StreamPixels::colour;
    info.colour_format = format->ours;
    std::snprintf(info.format, sizeof info.format, "%.23s", s.pixelFormat.toString().c_str());
    info.width = static_cast<int>(s.size.width);
    info.height = static_cast<int>(s.size.height);
    info.fps = o.fps;
    // No camera tells its lens; a horizontal view of 62 degrees is that of the Raspberry Pi's camera
    // module 2.
    const double f = info.width / (2 * std::tan(62.2 * 3.14159265358979 / 360));
    info.camera = {info.width, info.height, f, f, (info.width - 1) / 2.0, (info.height - 1) / 2.0};
    set_image_bytes(&info);
    stride_ = s.stride > 0 ? s.stride : info.row_bytes;
    return {};
}

Status LibcameraDevice::map_buffers() {
    libcamera::Stream* stream = configuration_->at(0).stream();
    allocator_ = std::make_unique<libcamera::FrameBufferAllocator>(camera_);
    if (allocator_->allocate(stream) < 0)
        return Status::error(Code::insufficient_memory, "libcamera: %.200s gives no buffers",
                             camera_->id().c_str());
    const StreamInfo& info = info_.at(StreamKind::colour);
    const std::size_t rows = info.image_bytes / info.row_bytes;  // with those of chroma
    for (const auto& buffer : allocator_->buffers(stream)) {
        if (mapped_.size() == kMaxBuffers) break;
        Mapped m;
        m.buffer = buffer.get();
        const libcamera::FrameBuffer::Plane& first = buffer->planes().front();
        m.offset = first.offset == libcamera::FrameBuffer::Plane::kInvalidOffset ? 0 : first.offset;
        // All planes in one dmabuf, one behind the other: what every format here is on the boards at hand.
        std::size_t planes = 0;
        for (const libcamera::FrameBuffer::Plane& p : buffer->planes()) planes += p.length;
        m.bytes = m.offset + planes;
        if (planes < stride_ * (rows - 1) + info.row_bytes)
            return Status::error(Code::format, "libcamera: a buffer of %zu bytes, expected %zu", planes,
                                 stride_ * rows);
        void* at = ::mmap(nullptr, m.bytes, PROT_READ, MAP_SHARED, first.fd.get(), 0);
        if (at == MAP_FAILED)
            return Status::error(Code::io, "libcamera: a buffer cannot be mapped: %s", std::strerror(errno));
        m.memory = static_cast<std::uint8_t*>(at);
        m.request = camera_->createRequest(mapped_.size());
        mapped_.push_back(std::move(m));
        if (!mapped_.back().request || mapped_.back().request->addBuffer(stream, buffer.get()) != 0)
            return Status::error(Code::io, "libcamera: %.200s takes no requests", camera_->id().c_str());
    }
    return {};
}

Status LibcameraDevice::start(SourceSink* sink) {
    sink_ = sink;
    if (mapped_.empty()) BURIN_TRY(map_buffers());
    done_count_ = 0;
    if (camera_->start() != 0)
        return Status::error(disconnected_ ? Code::disconnected : Code::io,
                             "libcamera: %.200s does not start", camera_->id().c_str());
    streaming_ = true;
    for (Mapped& m : mapped_) {
        m.request->reuse(libcamera::Request::ReuseBuffers);
        if (camera_->queueRequest(m.request.get()) != 0)
            return Status::error(Code::io, "libcamera: %.200s takes no requests", camera_->id().c_str());
    }
    return {};
}

void LibcameraDevice::completed(libcamera::Request* request) {
    if (request->status() == libcamera::Request::RequestCancelled) return;
    const std::lock_guard lock(mutex_);
    if (done_count_ < kMaxBuffers) done_[done_count_++] = static_cast<int>(request->cookie());
    arrived_.notify_all();
}

void LibcameraDevice::gone() {
    const std::lock_guard lock(mutex_);
    disconnected_ = true;
    arrived_.notify_all();
}

Status LibcameraDevice::pump(std::int64_t deadline_ns) {
    std::unique_lock lock(mutex_);
    const std::int64_t left_ns = std::max<std::int64_t>(deadline_ns - monotonic_ns(), 0);
    arrived_.wait_for(lock, std::chrono::nanoseconds(left_ns),
                      [&] { return done_count_ > 0 || disconnected_; });
    while (done_count_ > 0) {
        const int index = done_[0];
        std::copy(done_ + 1, done_ + done_count_, done_);
        --done_count_;
        lock.unlock();
        hand_over(index);
        lock.lock();
    }
    if (disconnected_)
        return Status::error(Code::disconnected, "libcamera: %.200s is unplugged", camera_->id().c_str());
    return {};
}

void LibcameraDevice::hand_over(int index) {
    const Mapped& m = mapped_[static_cast<std::size_t>(index)];
    const libcamera::FrameMetadata& metadata = m.buffer->metadata();
    ImageStamp stamp;
    stamp.sequence = metadata.sequence;
    stamp.device_ns = static_cast<std::int64_t>(metadata.timestamp);
    stamp.has_device_time = metadata.timestamp != 0;
    stamp.host_ns = monotonic_ns();
    stamp.damaged = metadata.status != libcamera::FrameMetadata::FrameSuccess;
    const std::uint8_t* image = m.memory + m.offset;
    if (lend_) {
        sink_->lend(StreamKind::colour, image, stride_, static_cast<std::uint64_t>(index),
                    m.buffer->planes()[0].fd.get(), stamp);
        return;
    }
    if (std::uint8_t* slot = sink_->acquire(StreamKind::colour)) {
        copy_image(image, slot);
        sink_->commit(StreamKind::colour, slot, stamp);
    }
    give_back(static_cast<std::uint64_t>(index));
}

void LibcameraDevice::copy_image(const std::uint8_t* from, std::uint8_t* to) const {
    const StreamInfo& info = info_.at(StreamKind::colour);
    for (std::size_t y = 0; y < info.image_bytes / info.row_bytes; ++y)
        std::memcpy(to + y * info.row_bytes, from + y * stride_, info.row_bytes);
}

void LibcameraDevice::give_back(std::uint64_t token) {
    const std::lock_guard lock(mutex_);
    if (!streaming_ || token >= mapped_.size()) return;
    mapped_[token].request->reuse(libcamera::Request::ReuseBuffers);
    (void)camera_->queueRequest(
        mapped_[token].request.get());  // refused only when the camera is gone, which is told
}

Status LibcameraDevice::stop() {
    {
        const std::lock_guard lock(mutex_);
        if (!streaming_) return {};
        streaming_ = false;
    }
    (void)camera_->stop();  // completes what is queued as cancelled
    return {};
}

void LibcameraDevice::close() {
    if (!camera_) return;
    (void)stop();
    camera_->requestCompleted.disconnect(this);
    camera_->disconnected.disconnect(this);
    for (Mapped& m : mapped_) {
        m.request.reset();
        if (m.memory) ::munmap(m.memory, m.bytes);
    }
    mapped_.clear();
    if (allocator_ && configuration_) allocator_->free(configuration_->at(0).stream());
    allocator_.reset();
    configuration_.reset();
    if (acquired_) camera_->release();
    camera_.reset();
}

}  // namespace burin
