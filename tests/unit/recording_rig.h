// SPDX-License-Identifier: MIT
// A made-up sensor with every stream, whose frame number n can be made again by whoever reads it back; and
// files that misbehave.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "capture/recording_reader.h"
#include "capture/recording_writer.h"
#include "dataset_files.h"
#include "scene_helpers.h"

namespace burin {

inline DeviceInfo rig_device(int width = 16, int height = 12) {
    DeviceInfo info;
    std::snprintf(info.name, sizeof info.name, "a rig");
    std::snprintf(info.serial, sizeof info.serial, "007");
    info.has_imu = true;
    info.T_camera_imu.t = {0.01, 0.02, 0.03};
    for (int k = 0; k < kStreamKinds; ++k) {
        StreamInfo& s = info.streams[k];
        s.kind = static_cast<StreamKind>(k);
        if (s.kind == StreamKind::infrared_right) continue;  // one that is not there
        s.pixels = s.kind == StreamKind::colour       ? StreamPixels::colour
                   : s.kind == StreamKind::confidence ? StreamPixels::u8
                                                      : StreamPixels::u16;
        s.width = s.kind == StreamKind::colour ? width + 1 : width;
        s.height = height;
        s.fps = s.kind == StreamKind::colour ? 50 : 100;
        s.unit_m = 0.00125;
        s.camera = {s.width, s.height, width * 0.9 + k, width * 0.9, width / 2.0, height / 2.0, 0.01 * k};
        s.T_stream_depth.t = {0.02 * k, 0, 0.001};
        set_image_bytes(&s);
    }
    return info;
}

inline constexpr std::int64_t kRigPeriod_ns = 10'000'000;  // 100 Hz
inline constexpr std::int64_t kRigStart_ns = 5'000'000'000;
// Two depth images share a colour image.
inline int rig_colour_of(int n) { return n / 2; }

inline std::int64_t rig_imu_ns(int i) { return kRigStart_ns + i * (kRigPeriod_ns / 5) + 1'000'000; }

// Frame n with the memory it points to. The IMU reads five times a frame.
struct RigFrame {
    CapturedFrame captured;
    std::vector<std::uint8_t> pixels[kStreamKinds];
    std::vector<ImuSample> imu;
    Se3 T_world_camera;

    RigFrame(const DeviceInfo& info, int n) {
        captured.t_ns = kRigStart_ns + n * kRigPeriod_ns;
        for (int k = 0; k < kStreamKinds; ++k) {
            const StreamInfo& s = info.streams[k];
            if (s.width == 0) continue;
            if (s.kind == StreamKind::confidence && n % 3 == 2) continue;  // not in every frame
            const int number = s.kind == StreamKind::colour ? rig_colour_of(n) : n;
            draw(s, number, &pixels[k]);
            CapturedImage& image = captured.images[k];
            image.pixels = pixels[k].data();
            image.stride_bytes = s.row_bytes;
            image.camera = s.camera;
            if (number % 5 == 1) image.camera.fx += 0.25 * number;                   // a lens that moves
            image.stamp.sequence = static_cast<std::uint64_t>(number + number / 7);  // a gap now and then
            image.lost = number % 7 == 0 && number > 0;
            image.t_ns = kRigStart_ns + (s.kind == StreamKind::colour ? 2 : 1) * number * kRigPeriod_ns + k;
            image.stamp.host_ns = image.t_ns + 4'000'000;
            image.stamp.has_device_time = s.kind != StreamKind::confidence;
            image.stamp.device_ns = image.stamp.has_device_time ? image.t_ns - 1'000'000'000 : 0;
            image.stamp.damaged = s.kind == StreamKind::infrared && n % 4 == 3;
        }
        for (int i = 5 * n - 5; i <= 5 * n; ++i) {
            if (i < 0) continue;
            const double x = i * 0.25;
            imu.push_back({rig_imu_ns(i), {x, -x, 2 * x}, {x + 1, x - 9.81, x}});
        }
        captured.imu = imu.data();
        captured.imu_count = static_cast<int>(imu.size());
        T_world_camera.t = {0.001 * n, 0.5, -0.25};
    }
    RigFrame(const RigFrame&) = delete;
    RigFrame& operator=(const RigFrame&) = delete;

    static void draw(const StreamInfo& s, int number, std::vector<std::uint8_t>* out) {
        out->resize(s.image_bytes);
        Rng rng(static_cast<std::uint64_t>(number) * 8 + static_cast<std::uint64_t>(s.kind));
        if (s.pixels != StreamPixels::u16) {
            for (std::size_t i = 0; i < out->size(); ++i)
                (*out)[i] = static_cast<std::uint8_t>(i + static_cast<std::size_t>(rng.below(9)));
            return;
        }
        for (std::size_t i = 0; i < out->size(); i += 2) {
            const int value = rng.below(4) == 0 ? 0 : 1000 + static_cast<int>(i) / 8 + 3 * rng.below(5);
            const auto v = static_cast<std::uint16_t>(value);
            std::memcpy(out->data() + i, &v, 2);
        }
    }
};

// Everything of frame n as the reader gives it is what the rig delivered.
inline void expect_rig_frame(const RecordingReader& reader, RecordedImages& images, int index, int n) {
    const DeviceInfo& info = reader.info();
    const RigFrame expected(info, n);
    const RecordingReader::Frame& frame = reader.frame(index);
    ASSERT_EQ(frame.t_ns, expected.captured.t_ns) << "frame " << index;
    for (int k = 0; k < kStreamKinds; ++k) {
        const CapturedImage& image = expected.captured.images[k];
        ASSERT_EQ(frame.recorded.images[k] != 0, image.pixels != nullptr) << k << " of frame " << n;
        if (!image.pixels) continue;
        const auto kind = static_cast<StreamKind>(k);
        std::vector<std::uint8_t> pixels(RecordedImages::image_room(info.at(kind)));
        RecordHead head;
        Camera camera;
        const Status got = images.read(reader, frame.recorded.images[k], kind, &head, &camera, pixels.data());
        ASSERT_TRUE(got.ok()) << got.text();
        ASSERT_EQ(head.sequence, image.stamp.sequence);
        ASSERT_EQ(head.t_ns, image.t_ns);
        ASSERT_EQ(head.host_ns, image.stamp.host_ns);
        ASSERT_EQ(head.device_ns, image.stamp.device_ns);
        ASSERT_EQ(head.lost, image.lost);
        ASSERT_EQ((head.flags & kRecordDeviceTime) != 0, image.stamp.has_device_time);
        ASSERT_EQ((head.flags & kRecordDamaged) != 0, image.stamp.damaged);
        ASSERT_EQ(camera.fx, image.camera.fx);
        ASSERT_EQ(camera.k1, image.camera.k1);
        ASSERT_EQ(camera.width, image.camera.width);
        if (head.codec != ImageCodec::jpeg) {
            ASSERT_EQ(std::memcmp(pixels.data(), image.pixels, info.at(kind).image_bytes), 0)
                << stream_name(kind) << " of frame " << n;
        }
    }
    int count = 0;
    const ImuSample* imu = reader.imu(frame.recorded, &count);
    ASSERT_EQ(count, expected.captured.imu_count) << "frame " << n;
    for (int i = 0; i < count; ++i) {
        ASSERT_EQ(imu[i].t_ns, expected.imu[static_cast<std::size_t>(i)].t_ns);
        ASSERT_EQ(imu[i].gyro_rad_s.z, expected.imu[static_cast<std::size_t>(i)].gyro_rad_s.z);
        ASSERT_EQ(imu[i].accel_m_s2.y, expected.imu[static_cast<std::size_t>(i)].accel_m_s2.y);
    }
    ASSERT_EQ(frame.recorded.has_pose, n % 2 == 0 ? 1u : 0u);
    if (n % 2 == 0) {
        ASSERT_EQ(pose_of(frame.recorded.T_world_camera).t.x, expected.T_world_camera.t.x);
    }
}

inline Status add_rig_frame(RecordingWriter& writer, const DeviceInfo& info, int n) {
    const RigFrame frame(info, n);
    return writer.add(frame.captured, n % 2 == 0 ? &frame.T_world_camera : nullptr);
}

inline RecordingOptions rig_options() {
    RecordingOptions options;
    options.lossless = true;
    options.colour = RecordedColour::lossless;
    return options;
}

// Writes frames 0 .. frames-1 into a folder.
inline void record_rig(const std::string& folder, int frames, RecordingOptions options = rig_options()) {
    const DeviceInfo info = rig_device();
    RecordingWriter writer;
    const Status opened = writer.open(folder.c_str(), "rig:", info, options);
    ASSERT_TRUE(opened.ok()) << opened.text();
    for (int n = 0; n < frames; ++n) ASSERT_TRUE(add_rig_frame(writer, info, n).ok());
    const Status closed = writer.close();
    ASSERT_TRUE(closed.ok()) << closed.text();
}

// A file in memory that can fill up, refuse, write short or stand still.
struct MemoryRecording final : RecordingFile {
    std::string bytes;
    std::size_t room = SIZE_MAX, most = SIZE_MAX;
    std::atomic<bool> held{false}, sync_fails{false};
    std::atomic<int> syncs{0};

    std::int64_t write(std::uint64_t at, const void* from, std::size_t n) override {
        while (held) std::this_thread::yield();
        if (at >= room) return -ENOSPC;
        n = std::min({n, most, room - static_cast<std::size_t>(at)});
        if (bytes.size() < at + n) bytes.resize(at + n);
        std::memcpy(bytes.data() + at, from, n);
        return static_cast<std::int64_t>(n);
    }
    int sync() override {
        ++syncs;
        return sync_fails ? -EIO : 0;
    }
    int truncate(std::uint64_t n) override {
        bytes.resize(n);
        return 0;
    }
    void flush_soon(std::uint64_t) override {}
};

}  // namespace burin
