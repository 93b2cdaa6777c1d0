// SPDX-License-Identifier: MIT
// The bytes of a recording: docs/recording.md is this in words. Records follow each other, each with a head
// of 64 bytes, its payload and zeros up to a multiple of 8. All numbers are little-endian. What is written is
// never changed.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include "capture/source.h"

namespace burin {

static_assert(std::endian::native == std::endian::little, "recordings are written as they lie in memory");

inline constexpr char kRecordingName[] = "recording.burinrec";  // in its folder
inline constexpr std::uint32_t kRecordMagic = 0x43455242;       // "BREC"
inline constexpr std::uint32_t kRecordingVersion = 1;

enum class RecordKind : std::uint8_t {
    header = 1,  // the first record: RecordedHeader
    image = 2,   // of one stream
    imu = 3,     // RecordedImu, samples
    frame = 4,   // RecordedFrame: which images belong together. They stand before it
    log = 5,     // a line of text; parameter is its LogLevel
    loss = 6,    // sequence: frames that the recorder itself has dropped until now
    mark = 7,    // all before it was on the disk when this was written
    end = 8,     // the recording was closed in order
};

// How the pixels of an image are written.
enum class ImageCodec : std::uint8_t {
    raw = 0,    // rows packed
    depth = 1,  // 16 bit: depth_codec.h
    bytes = 2,  // differences to the byte `parameter` before, zstd
    jpeg = 3,
};

inline constexpr std::uint8_t kRecordDeviceTime = 1;  // device_ns is the device's
inline constexpr std::uint8_t kRecordDamaged = 2;     // parts are missing
inline constexpr std::uint8_t kRecordCamera = 4;  // the payload begins with the image's own RecordedCamera

struct RecordHead {
    std::uint32_t magic = kRecordMagic;
    std::uint32_t payload_bytes = 0;
    RecordKind kind = RecordKind::header;
    std::uint8_t stream = 0;  // a StreamKind
    ImageCodec codec = ImageCodec::raw;
    std::uint8_t flags = 0;
    std::uint32_t payload_crc = 0;
    std::uint64_t sequence = 0;  // of an image, the device's; of a frame, its number from 0
    std::int64_t device_ns = 0;  // of an image, on the device's clock
    std::int64_t host_ns = 0;    // when the last byte had come; of others when they were written; monotonic
    std::int64_t t_ns = 0;       // when it was taken, on the clock that all streams share
    std::uint64_t lost = 0;      // images of this stream that are missing before it
    std::uint32_t parameter = 0;
    std::uint32_t head_crc = 0;  // of the 60 bytes before it
};
static_assert(sizeof(RecordHead) == 64);

inline constexpr std::uint64_t kRecordAlign = 8;
inline constexpr std::uint64_t record_bytes(std::uint32_t payload) {
    return sizeof(RecordHead) + (payload + kRecordAlign - 1) / kRecordAlign * kRecordAlign;
}

struct RecordedCamera {
    double fx = 0, fy = 0, cx = 0, cy = 0, k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
};
struct RecordedPose {
    double R[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // row-major
    double t[3] = {};
};

struct RecordedStream {
    std::uint32_t width = 0, height = 0;  // 0: not recorded
    std::uint8_t pixels = 0;              // a StreamPixels
    std::uint8_t colour_format = 0;       // a PixelFormat
    std::uint8_t calibrated = 0;
    std::uint8_t min_confidence = 0;  // of confidence: depth of less counts as none
    std::uint8_t zero[4] = {};
    char format[24] = "";
    double fps = 0, unit_m = 0;
    RecordedCamera camera;
    RecordedPose T_stream_depth;
};
static_assert(sizeof(RecordedStream) == 224);

struct RecordedHeader {
    std::uint32_t version = kRecordingVersion;
    std::uint32_t has_imu = 0;
    std::int64_t unix_ns = 0;  // the time of day at host_ns of this record
    char source[192] = "";     // where it came from: "v4l2:/dev/video0", a folder
    char name[96] = "";        // of the device
    char serial[64] = "";
    char location[64] = "";
    RecordedPose T_camera_imu;
    RecordedStream streams[kStreamKinds];
};
static_assert(sizeof(RecordedHeader) == 1648);

struct RecordedFrame {
    std::uint64_t images[kStreamKinds] = {};  // offsets of their records in the file, 0: none
    std::uint64_t imu_first = 0;              // number of its first sample, counted from 0 over the recording
    std::uint32_t imu_count = 0;
    std::uint32_t has_pose = 0;
    RecordedPose T_world_camera;
};
static_assert(sizeof(RecordedFrame) == 152);

struct RecordedImuSample {
    std::int64_t t_ns = 0;
    double gyro_rad_s[3] = {}, accel_m_s2[3] = {};
};
static_assert(sizeof(RecordedImuSample) == 56);
// An imu record: the number of its first sample as 8 bytes, then samples.

RecordedCamera recorded_camera(const Camera& camera);
Camera camera_of(const RecordedCamera& recorded, int width, int height);
RecordedPose recorded_pose(const Se3& T);
Se3 pose_of(const RecordedPose& recorded);
// Rows of the rotation as orthonormal as text with four digits leaves them. The bits stay as recorded.
bool pose_is_rigid(const RecordedPose& recorded);

void seal_head(RecordHead* head);  // sets head_crc
bool head_is_whole(const RecordHead& head);

}  // namespace burin
