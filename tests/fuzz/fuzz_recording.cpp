// SPDX-License-Identifier: MIT
// Recordings: the index, every image, readings, lines, and the data set on top. Random bytes never pass the
// checksums, so the input is also mended: each record that its lengths lead to gets the checksums that would
// be right.
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <vector>

#include "capture/crc32.h"
#include "capture/recording_reader.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

namespace {

// Above this an image is only allocated and thrown away, which is slow and finds nothing.
constexpr std::size_t kMostBytes = 1 << 20;

struct MemoryFile {
    MemoryFile() : fd(::memfd_create("input", 0)), path("/proc/self/fd/" + std::to_string(fd)) {}
    int fd;
    std::string path;
};

void check_line(const Status& status, const std::string& path) {
    fuzz::check(std::strncmp(status.text(), path.c_str(), path.size()) == 0);
    for (const char* c = status.text(); *c; ++c) fuzz::check(*c >= 0x20 && *c < 0x7f);
}

void use(const std::vector<std::uint8_t>& bytes) {
    static const MemoryFile file;
    fuzz::check(::ftruncate(file.fd, 0) == 0);
    fuzz::check(::pwrite(file.fd, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size()));
    RecordingReader reader;
    const Status opened = reader.open(file.path.c_str());
    if (!opened.ok()) return check_line(opened, file.path);
    std::size_t room = 0;
    for (const StreamInfo& s : reader.info().streams) {
        if (s.width == 0) continue;
        fuzz::check(s.width <= kMaxImageSide && s.height <= kMaxImageSide && s.camera.fx > 0);
        room = std::max(room, RecordedImages::image_room(s));
    }
    std::uint64_t at = 0;
    LogLevel level;
    char line[257];
    while (reader.next_line(&at, &level, line)) fuzz::check(std::strlen(line) <= 256);
    if (room > kMostBytes) return;
    RecordedImages images;
    fuzz::check(images.reserve(reader).ok());
    std::vector<std::uint8_t> pixels(room);
    for (int i = 0; i < std::min(reader.frame_count(), 50); ++i) {
        const RecordedFrame& frame = reader.frame(i).recorded;
        for (int k = 0; k < kStreamKinds; ++k) {
            if (frame.images[k] == 0) continue;
            RecordHead head;
            Camera camera;
            const Status read = images.read(reader, frame.images[k], static_cast<StreamKind>(k), &head,
                                            &camera, pixels.data());
            if (!read.ok())
                check_line(read, file.path);
            else
                fuzz::check(camera.fx > 0 && camera.width == reader.info().streams[k].width);
        }
        int count = 0;
        const ImuSample* imu = reader.imu(frame, &count);
        fuzz::check((imu != nullptr) == (count > 0));
        for (int s = 1; s < count; ++s) fuzz::check(imu[s].t_ns > imu[s - 1].t_ns);
    }
}

std::vector<std::uint8_t> mended(const std::uint8_t* data, std::size_t size) {
    std::vector<std::uint8_t> bytes(data, data + size);
    for (std::size_t at = 0; at + sizeof(RecordHead) <= bytes.size();) {
        RecordHead head;
        std::memcpy(&head, bytes.data() + at, sizeof head);
        const std::size_t left = bytes.size() - at - sizeof head;
        head.magic = kRecordMagic;
        head.payload_bytes = static_cast<std::uint32_t>(std::min<std::size_t>(head.payload_bytes, left));
        if (at == 0) {
            head.kind = RecordKind::header;
            head.payload_bytes = sizeof(RecordedHeader);
            if (left < sizeof(RecordedHeader)) break;
        }
        head.payload_crc = crc32(bytes.data() + at + sizeof head, head.payload_bytes);
        seal_head(&head);
        std::memcpy(bytes.data() + at, &head, sizeof head);
        at += record_bytes(head.payload_bytes);
    }
    return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    use(std::vector<std::uint8_t>(data, data + size));
    use(mended(data, size));
    return 0;
}
