// SPDX-License-Identifier: MIT
// Exports of phones and logs, written by the tests: nothing in here is shared with the readers but PNG.
#pragma once

#include <zlib.h>

#include <cstring>
#include <string>
#include <vector>

#include "dataset_files.h"
#include "datasets/synthetic/synth.h"

namespace burin {

// One frame as a phone would take it. Depth in millimetres.
struct Shot {
    std::int64_t t_us = 0;
    Image<std::uint16_t> depth_mm;
    Image<std::uint8_t> rgb, confidence;
    Camera camera;
    Se3 T_world_camera;  // OpenCV's camera, z up
};

// Poses of the room that every format can hold exactly: the camera looks along x and moves by 1/64 m.
inline std::vector<Shot> room_shots(int count, int width, int height) {
    const TempFolder folder;
    std::string trajectory;
    for (int i = 0; i < count; ++i)
        trajectory += "0." + std::to_string(i + 1) + " " + std::to_string(-1 + i / 64.0) + " " +
                      std::to_string(i / 32.0) + " 1.25 -0.5 0.5 -0.5 0.5\n";
    SynthOptions options;
    options.noise = SynthNoise::none;
    options.width = width;
    options.height = height;
    options.trajectory_file = folder.text("path.txt", trajectory);
    options.T_scene_trajectory = Se3();
    auto made = SyntheticDataset::create(options);
    EXPECT_TRUE(made.ok()) << made.status().text();
    std::vector<Shot> shots;
    for (int i = 0; made.ok() && i < count; ++i) {
        Frame frame;
        EXPECT_TRUE((*made)->load(i, &frame).ok());
        Shot shot;
        shot.t_us = 100000 * (i + 1);
        shot.depth_mm = Image<std::uint16_t>(width, height);
        shot.confidence = Image<std::uint8_t>(width, height);
        for (std::size_t p = 0; p < shot.depth_mm.pixels.size(); ++p) {
            shot.depth_mm.pixels[p] = static_cast<std::uint16_t>(frame.depth_f32.pixels[p] * 1000 + 0.5f);
            shot.confidence.pixels[p] = static_cast<std::uint8_t>((p / 7 + p / 900) % 3);
        }
        shot.rgb = frame.colour;
        shot.camera = frame.depth_camera;
        shot.T_world_camera = frame.T_world_camera;
        shots.push_back(shot);
    }
    return shots;
}

// z up back to ARKit's y up: (x, y, z) -> (x, z, -y); then OpenGL's camera if asked.
inline Se3 y_up(const Se3& T, bool opengl) {
    const auto turned = [](Vec3d v) { return Vec3d{v.x, v.z, -v.y}; };
    Se3 out;
    out.t = turned(T.t);
    for (int c = 0; c < 3; ++c) {
        const Vec3d column = turned(T.R.column(c)) * (opengl && c > 0 ? -1 : 1);
        out.R(0, c) = column.x, out.R(1, c) = column.y, out.R(2, c) = column.z;
    }
    return out;
}

template <class T>
void put(std::string* bytes, T value) {
    bytes->append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class T>
std::string bytes_of(const Image<T>& image) {
    return {reinterpret_cast<const char*>(image.pixels.data()), image.pixels.size() * sizeof(T)};
}

inline std::string png_of(const Image<std::uint8_t>& image) {
    std::string bytes;
    EXPECT_TRUE(encode_png(image.view(), &bytes).ok());
    return bytes;
}

inline std::string zlib_of(const std::string& raw) {
    uLongf size = compressBound(static_cast<uLong>(raw.size()));
    std::string out(size, 0);
    EXPECT_EQ(compress(reinterpret_cast<Bytef*>(out.data()), &size,
                       reinterpret_cast<const Bytef*>(raw.data()), static_cast<uLong>(raw.size())),
              Z_OK);
    out.resize(size);
    return out;
}

// LZFSE with raw blocks only.
inline std::string lzfse_raw(const std::string& bytes) {
    std::string out = "bvx-";
    put(&out, static_cast<std::uint32_t>(bytes.size()));
    return out + bytes + "bvx$";
}

// LZFSE with one LZVN block: literals, and runs of one byte as matches from 1 back.
inline std::string lzfse_lzvn(const std::string& bytes) {
    std::string code;
    for (std::size_t i = 0; i < bytes.size();) {
        std::size_t run = 1;
        while (i + run < bytes.size() && bytes[i + run] == bytes[i] && run < 272) ++run;
        if (i > 0 && bytes[i] == bytes[i - 1] && run >= 19) {
            code += {'\x00', '\x01'};  // no literals, three bytes from 1 back
            code += {'\xF0', static_cast<char>(run - 3 - 16)};
            i += run;
            continue;
        }
        code += {'\xE1', bytes[i++]};
    }
    code += std::string("\x06\0\0\0\0\0\0\0", 8);
    std::string out = "bvxn";
    put(&out, static_cast<std::uint32_t>(bytes.size()));
    put(&out, static_cast<std::uint32_t>(code.size()));
    return out + code + "bvx$";
}

// A zip of stored files (PKWARE APPNOTE 4.3.7, 4.3.12, 4.3.16).
class StoredZip {
  public:
    void add(const std::string& name, const std::string& content) {
        const auto crc = static_cast<std::uint32_t>(
            crc32(0, reinterpret_cast<const Bytef*>(content.data()), static_cast<uInt>(content.size())));
        std::string common;  // version, flags, method, time, date
        for (int v : {20, 0, 0, 0, 0x21}) put(&common, static_cast<std::uint16_t>(v));
        put(&common, crc);
        put(&common, static_cast<std::uint32_t>(content.size()));
        put(&common, static_cast<std::uint32_t>(content.size()));
        put(&common, static_cast<std::uint16_t>(name.size()));
        put(&common, std::uint16_t{0});
        directory_ += std::string("PK\1\2\x14\0", 6) + common + std::string(10, 0);
        put(&directory_, static_cast<std::uint32_t>(bytes_.size()));
        directory_ += name;
        bytes_ += "PK\3\4" + common + name + content;
        ++count_;
    }
    std::string finish() const {
        std::string end = std::string("PK\5\6\0\0\0\0", 8);
        put(&end, count_);
        put(&end, count_);
        put(&end, static_cast<std::uint32_t>(directory_.size()));
        put(&end, static_cast<std::uint32_t>(bytes_.size()));
        put(&end, std::uint16_t{0});
        return bytes_ + directory_ + end;
    }

  private:
    std::string bytes_, directory_;
    std::uint16_t count_ = 0;
};

inline std::string digits(double v) {
    char text[40];
    std::snprintf(text, sizeof text, "%.17g", v);
    return text;
}
inline std::string seconds(std::int64_t t_us) {
    char text[40];
    std::snprintf(text, sizeof text, "%.6f", static_cast<double>(t_us) * 1e-6);
    return text;
}

// The same frames in the TUM layout, confidence applied to depth when asked.
inline void write_tum(const TempFolder& folder, const std::vector<Shot>& shots, int least_confidence) {
    std::string both, truth;
    for (std::size_t i = 0; i < shots.size(); ++i) {
        const Shot& s = shots[i];
        const std::string name = std::to_string(i) + ".png", t = seconds(s.t_us);
        Image<std::uint16_t> depth = s.depth_mm;
        for (std::size_t p = 0; p < depth.pixels.size(); ++p)
            if (s.confidence.pixels[p] < least_confidence) depth.pixels[p] = 0;
        std::string bytes;
        ASSERT_TRUE(encode_png(depth.view(), &bytes).ok());
        folder.text("depth/" + name, bytes);
        folder.text("rgb/" + name, png_of(s.rgb));
        both += t + " rgb/" + name + " " + t + " depth/" + name + "\n";
        const Quaternion q = quaternion_of(s.T_world_camera.R);
        truth += t;
        for (double v :
             {s.T_world_camera.t.x, s.T_world_camera.t.y, s.T_world_camera.t.z, q.x, q.y, q.z, q.w})
            truth.append(" ").append(digits(v));
        truth += "\n";
    }
    const Camera& c = shots[0].camera;
    folder.text("associations.txt", both);
    folder.text("groundtruth.txt", truth);
    folder.text("camera.txt", "fx " + digits(c.fx) + "\nfy " + digits(c.fy) + "\ncx " + digits(c.cx) +
                                  "\ncy " + digits(c.cy) + "\ndepth_scale 1000\n");
}

inline std::string sens_of(const std::vector<Shot>& shots, bool raw) {
    const Camera& c = shots[0].camera;
    std::string out;
    put(&out, std::uint32_t{4});
    put(&out, std::uint64_t{4});
    out += "test";
    const float K[16] = {float(c.fx), 0, float(c.cx), 0, 0, float(c.fy), float(c.cy), 0,
                         0,           0, 1,           0, 0, 0,           0,           1};
    const float I[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    for (const float* m : {K, I, K, I}) out.append(reinterpret_cast<const char*>(m), 64);
    put(&out, std::int32_t{raw ? 0 : 1});
    put(&out, std::int32_t{raw ? 0 : 1});
    for (int side : {c.width, c.height, c.width, c.height}) put(&out, static_cast<std::uint32_t>(side));
    put(&out, 1000.0f);
    put(&out, static_cast<std::uint64_t>(shots.size()));
    for (const Shot& s : shots) {
        for (int r = 0; r < 3; ++r) {
            for (int k = 0; k < 3; ++k) put(&out, float(s.T_world_camera.R(r, k)));
            put(&out, float(r == 0   ? s.T_world_camera.t.x
                            : r == 1 ? s.T_world_camera.t.y
                                     : s.T_world_camera.t.z));
        }
        for (float v : {0.0f, 0.0f, 0.0f, 1.0f}) put(&out, v);
        put(&out, static_cast<std::uint64_t>(s.t_us));
        put(&out, static_cast<std::uint64_t>(s.t_us));
        const std::string colour = raw ? bytes_of(s.rgb) : png_of(s.rgb);
        const std::string depth = raw ? bytes_of(s.depth_mm) : zlib_of(bytes_of(s.depth_mm));
        put(&out, static_cast<std::uint64_t>(colour.size()));
        put(&out, static_cast<std::uint64_t>(depth.size()));
        out += colour + depth;
    }
    put(&out, std::uint64_t{0});  // no IMU
    return out;
}

inline std::string klg_of(const std::vector<Shot>& shots, bool raw) {
    std::string out;
    put(&out, static_cast<std::int32_t>(shots.size()));
    for (const Shot& s : shots) {
        Image<std::uint8_t> swapped = s.rgb;  // as Logger2 has it in coded colour
        for (std::size_t i = 0; i < swapped.pixels.size(); i += 3)
            std::swap(swapped.pixels[i], swapped.pixels[i + 2]);
        const std::string colour = raw ? bytes_of(s.rgb) : png_of(swapped);
        const std::string depth = raw ? bytes_of(s.depth_mm) : zlib_of(bytes_of(s.depth_mm));
        put(&out, s.t_us);
        put(&out, static_cast<std::int32_t>(depth.size()));
        put(&out, static_cast<std::int32_t>(colour.size()));
        out += depth + colour;
    }
    return out;
}

inline std::string r3d_metadata_of(const std::vector<Shot>& shots) {
    const Camera& c = shots[0].camera;
    std::string poses, stamps;
    for (const Shot& s : shots) {
        const Se3 T = y_up(s.T_world_camera, true);
        const Quaternion q = quaternion_of(T.R);
        poses += poses.empty() ? "[" : ",[";
        for (double v : {q.x, q.y, q.z, q.w, T.t.x, T.t.y}) poses.append(digits(v)).append(",");
        poses.append(digits(T.t.z)).append("]");
        stamps.append(stamps.empty() ? "" : ",").append(seconds(s.t_us));
    }
    const std::string w = std::to_string(c.width), h = std::to_string(c.height);
    return R"({"w":)" + w + R"(,"h":)" + h + R"(,"dw":)" + w + R"(,"dh":)" + h + R"(,"fps":10,"K":[)" +
           digits(c.fx) + ",0,0,0," + digits(c.fy) + ",0," + digits(c.cx) + "," + digits(c.cy) +
           R"(,1],"poses":[)" + poses + R"(],"frameTimestamps":[)" + stamps + "]}";
}

inline std::string r3d_of(const std::vector<Shot>& shots) {
    StoredZip zip;
    for (std::size_t i = 0; i < shots.size(); ++i) {
        const Shot& s = shots[i];
        Image<float> metres(s.depth_mm.width, s.depth_mm.height);
        for (std::size_t p = 0; p < metres.pixels.size(); ++p)
            metres.pixels[p] = static_cast<float>(s.depth_mm.pixels[p]) * 0.001f;
        const std::string name = "rgbd/" + std::to_string(i);
        zip.add(name + ".depth", i % 2 ? lzfse_raw(bytes_of(metres)) : lzfse_lzvn(bytes_of(metres)));
        zip.add(name + ".conf", lzfse_lzvn(bytes_of(s.confidence)));
        zip.add(name + ".jpg", png_of(s.rgb));  // told by content
    }
    zip.add("metadata", r3d_metadata_of(shots));
    return zip.finish();
}

inline void write_stray(const TempFolder& folder, const std::vector<Shot>& shots) {
    std::string odometry = "timestamp, frame, x, y, z, qx, qy, qz, qw\n";
    for (std::size_t i = 0; i < shots.size(); ++i) {
        const Shot& s = shots[i];
        char name[24];
        std::snprintf(name, sizeof name, "%06zu", i);
        std::string depth;
        ASSERT_TRUE(encode_png(s.depth_mm.view(), &depth).ok());
        folder.text(std::string("depth/") + name + ".png", depth);
        folder.text(std::string("confidence/") + name + ".png", png_of(s.confidence));
        const Se3 T = y_up(s.T_world_camera, false);
        const Quaternion q = quaternion_of(T.R);
        odometry += seconds(s.t_us) + ", " + name;
        for (double v : {T.t.x, T.t.y, T.t.z, q.x, q.y, q.z, q.w}) odometry.append(", ").append(digits(v));
        odometry += "\n";
    }
    const Camera& c = shots[0].camera;
    folder.text("odometry.csv", odometry);
    folder.text("camera_matrix.csv", digits(c.fx) + ", 0.0, " + digits(c.cx) + "\n0.0, " + digits(c.fy) +
                                         ", " + digits(c.cy) + "\n0.0, 0.0, 1.0");
}

inline void write_polycam(const TempFolder& folder, const std::vector<Shot>& shots) {
    for (const Shot& s : shots) {
        const std::string stem = std::to_string(s.t_us);
        std::string depth, json;
        ASSERT_TRUE(encode_png(s.depth_mm.view(), &depth).ok());
        Image<std::uint8_t> confidence = s.confidence;
        for (std::uint8_t& v : confidence.pixels) v = v == 0 ? 0 : v == 1 ? 127 : 255;
        folder.text("keyframes/depth/" + stem + ".png", depth);
        folder.text("keyframes/confidence/" + stem + ".png", png_of(confidence));
        folder.text("keyframes/corrected_images/" + stem + ".jpg", png_of(s.rgb));
        const Camera& c = s.camera;
        json = R"({"fx":)" + digits(c.fx) + R"(,"fy":)" + digits(c.fy) + R"(,"cx":)" + digits(c.cx) +
               R"(,"cy":)" + digits(c.cy) + R"(,"width":)" + std::to_string(c.width) + R"(,"height":)" +
               std::to_string(c.height) + R"(,"blur_score":1)";
        const Se3 T = y_up(s.T_world_camera, true);
        for (int r = 0; r < 3; ++r) {
            for (int k = 0; k < 4; ++k) {
                const double v = k < 3 ? T.R(r, k) : r == 0 ? T.t.x : r == 1 ? T.t.y : T.t.z;
                json.append(",\"t_").append(std::to_string(r) + std::to_string(k) + "\":" + digits(v));
            }
        }
        folder.text("keyframes/corrected_cameras/" + stem + ".json", json + "}");
    }
}

}  // namespace burin
