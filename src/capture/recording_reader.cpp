// SPDX-License-Identifier: MIT
// Opening a recording's header and reading its images; the index: recording_scan.cpp.
#include "capture/recording_reader.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>

#include "capture/crc32.h"

namespace burin {
namespace {

bool ends_in_zero(const char* text, std::size_t room) { return std::memchr(text, 0, room) != nullptr; }

}  // namespace

RecordingReader::~RecordingReader() { close(); }

void RecordingReader::close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
    frames_.clear();
    images_.clear();
    imu_.clear();
    lines_.clear();
    findings_ = Findings();
    max_payload_ = 0;
    imu_gap_ = 0;
}

bool RecordingReader::read(std::uint64_t at, void* to, std::size_t bytes) const {
    auto* p = static_cast<std::uint8_t*>(to);
    while (bytes > 0) {
        const ssize_t got = ::pread(fd_, p, bytes, static_cast<off_t>(at));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        p += got;
        at += static_cast<std::uint64_t>(got);
        bytes -= static_cast<std::size_t>(got);
    }
    return true;
}

Status RecordingReader::open(const char* path) {
    close();
    std::snprintf(path_, sizeof path_, "%s", path);
    struct stat info;
    if (::stat(path_, &info) == 0 && S_ISDIR(info.st_mode)) {
        const int length = std::snprintf(path_, sizeof path_, "%s/%s", path, kRecordingName);
        if (length < 0 || static_cast<std::size_t>(length) >= sizeof path_)
            return Status::error(Code::invalid_argument,
                                 "recording: a path of %d bytes, expected at most %zu", length,
                                 sizeof path_ - 1);
    }
    // O_NONBLOCK: opening a pipe by mistake must not wait for a writer.
    fd_ = ::open(path_, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd_ < 0)
        return Status::error(Code::io, "%s: cannot be opened (%s), expected a recording", path_,
                             std::strerror(errno));
    if (::fstat(fd_, &info) != 0 || !S_ISREG(info.st_mode)) {
        close();
        return Status::error(Code::io, "%s: is a folder or a device, expected a recording", path_);
    }
    size_ = static_cast<std::uint64_t>(info.st_size);
    Status status = read_header();
    if (status.ok()) status = scan();
    if (!status.ok()) close();
    return status;
}

Status RecordingReader::read_header() {
    const auto no = [&](const char* why) {
        return Status::error(Code::format, "%s: is no recording: %s", path_, why);
    };
    RecordHead head;
    if (size_ < sizeof head + sizeof header_) return no("it is shorter than a header");
    if (!read(0, &head, sizeof head) || !read(sizeof head, &header_, sizeof header_))
        return Status::error(Code::io, "%s: its header cannot be read (%s)", path_, std::strerror(errno));
    if (head.magic != kRecordMagic) return no("its first four bytes are not BREC");
    if (!head_is_whole(head) || head.kind != RecordKind::header || head.payload_bytes != sizeof header_ ||
        head.payload_crc != crc32(&header_, sizeof header_))
        return no("its header is damaged");
    if (header_.version != kRecordingVersion)
        return Status::error(Code::unsupported, "%s: is a recording of version %u, expected %u", path_,
                             header_.version, kRecordingVersion);
    return check_header();
}

Status RecordingReader::check_header() {
    const auto damaged = [&](const char* what) {
        return Status::error(Code::format, "%s: the header's %s is out of range", path_, what);
    };
    if (!ends_in_zero(header_.source, sizeof header_.source) ||
        !ends_in_zero(header_.name, sizeof header_.name) ||
        !ends_in_zero(header_.serial, sizeof header_.serial) ||
        !ends_in_zero(header_.location, sizeof header_.location))
        return damaged("text");
    info_ = DeviceInfo();
    std::memcpy(info_.name, header_.name, sizeof info_.name);
    std::memcpy(info_.serial, header_.serial, sizeof info_.serial);
    std::memcpy(info_.location, header_.location, sizeof info_.location);
    if (header_.has_imu > 1 || !pose_is_rigid(header_.T_camera_imu)) return damaged("IMU");
    info_.has_imu = header_.has_imu == 1;
    info_.T_camera_imu = pose_of(header_.T_camera_imu);
    bool any = false;
    for (int k = 0; k < kStreamKinds; ++k) {
        const RecordedStream& r = header_.streams[k];
        if (r.width == 0 && r.height == 0) continue;
        StreamInfo& s = info_.streams[k];
        s.kind = static_cast<StreamKind>(k);
        const auto most = static_cast<std::uint32_t>(kMaxImageSide);
        if (r.width == 0 || r.height == 0 || r.width > most || r.height > most) return damaged("image size");
        if (r.pixels > static_cast<std::uint8_t>(StreamPixels::colour) ||
            (r.pixels == static_cast<std::uint8_t>(StreamPixels::colour)) != (s.kind == StreamKind::colour) ||
            r.colour_format > static_cast<std::uint8_t>(PixelFormat::nv21) || r.calibrated > 1 ||
            !ends_in_zero(r.format, sizeof r.format))
            return damaged("pixel format");
        if (s.kind == StreamKind::depth && r.pixels != static_cast<std::uint8_t>(StreamPixels::u16))
            return damaged("pixel format");
        if (!(r.fps >= 0 && r.fps <= 1e6) || !(r.unit_m > 0 && r.unit_m <= 1)) return damaged("unit or rate");
        s.pixels = static_cast<StreamPixels>(r.pixels);
        s.colour_format = static_cast<PixelFormat>(r.colour_format);
        s.width = static_cast<int>(r.width);
        s.height = static_cast<int>(r.height);
        s.calibrated = r.calibrated == 1;
        s.fps = r.fps;
        s.unit_m = r.unit_m;
        std::memcpy(s.format, r.format, sizeof s.format);
        s.camera = camera_of(r.camera, s.width, s.height);
        if (const Status status = check_camera(s.camera, stream_name(s.kind)); !status.ok())
            return Status::error(Code::format, "%s: %s", path_, status.text());
        if (!pose_is_rigid(r.T_stream_depth)) return damaged("extrinsic");
        s.T_stream_depth = pose_of(r.T_stream_depth);
        set_image_bytes(&s);
        any = true;
    }
    return any ? Status() : damaged("list of streams");
}

bool RecordingReader::read_head(std::uint64_t offset, RecordHead* head) const {
    return read(offset, head, sizeof *head) && head_is_whole(*head);
}

Status RecordingReader::read_image(std::uint64_t offset, RecordHead* head, Camera* camera, std::uint8_t* out,
                                   std::size_t* bytes) const {
    const auto damaged = [&](const char* what) {
        return Status::error(Code::format, "%s: the image at byte %llu is damaged: %s", path_,
                             static_cast<unsigned long long>(offset), what);
    };
    if (!read(offset, head, sizeof *head)) return damaged("it cannot be read");
    if (!head_is_whole(*head) || head->kind != RecordKind::image || head->stream >= kStreamKinds)
        return damaged("its head has changed");
    const StreamInfo& s = info_.streams[head->stream];
    std::size_t size = head->payload_bytes;
    std::uint64_t at = offset + sizeof *head;
    *camera = s.camera;
    std::uint32_t crc = 0;
    if (head->flags & kRecordCamera) {
        RecordedCamera own;
        if (size < sizeof own || !read(at, &own, sizeof own)) return damaged("it has no intrinsics");
        crc = crc32(&own, sizeof own);
        size -= sizeof own;
        at += sizeof own;
        *camera = camera_of(own, s.width, s.height);
    }
    if (size > max_payload_) return damaged("its head has changed");
    if (!read(at, out, size)) return damaged("it cannot be read");
    if (crc32(out, size, crc) != head->payload_crc) return damaged("its checksum is another");
    if (head->flags & kRecordCamera)
        if (const Status status = check_camera(*camera, stream_name(s.kind)); !status.ok())
            return damaged(status.text());
    *bytes = size;
    return {};
}

std::size_t RecordedImages::image_room(const StreamInfo& stream) {
    return std::max(stream.image_bytes, decoded_stream(stream, ImageCodec::jpeg).image_bytes);
}

Status RecordedImages::reserve(const RecordingReader& reader) {
    payload_.reset(new (std::nothrow) std::uint8_t[reader.max_payload() + 1]);
    if (!payload_)
        return Status::error(Code::insufficient_memory, "%s: no memory for records of %zu bytes",
                             reader.path(), reader.max_payload());
    return decoder_.reserve(reader.info());
}

Status RecordedImages::read(const RecordingReader& reader, std::uint64_t offset, StreamKind kind,
                            RecordHead* head, Camera* camera, std::uint8_t* out) {
    std::size_t bytes = 0;
    BURIN_TRY(reader.read_image(offset, head, camera, payload_.get(), &bytes));
    if (head->stream != static_cast<std::uint8_t>(kind))
        return Status::error(Code::format, "%s: the image at byte %llu is of another stream", reader.path(),
                             static_cast<unsigned long long>(offset));
    return decoder_.decode(reader.info().at(kind), *head, payload_.get(), bytes, reader.path(), out);
}

}  // namespace burin
