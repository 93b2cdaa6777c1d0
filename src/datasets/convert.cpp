// SPDX-License-Identifier: MIT
#include "datasets/convert.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <vector>

#include "core/atomic_file.h"
#include "datasets/file.h"
#include "datasets/image_file.h"
#include "datasets/prefetch.h"

namespace burin {
namespace {

namespace fs = std::filesystem;

// Of floating-point depth: what TUM and ICL-NUIM use in their PNG files, 13.1 m in 16 bits.
constexpr double kMetreScale = 5000;

Status prepare(const std::string& folder) {
    std::error_code error;
    if (fs::exists(folder, error) && !(fs::is_directory(folder, error) && fs::is_empty(folder, error)))
        return Status::error(Code::invalid_argument, "%s: exists and is no empty folder, expected a new one",
                             folder.c_str());
    for (const char* part : {"/depth", "/rgb", "/confidence"})
        if (fs::create_directories(folder + part, error); error)
            return Status::error(Code::io, "%s%s: %s", folder.c_str(), part, error.message().c_str());
    return {};
}

Status write_text(const std::string& path, const std::string& text) {
    return write_file_atomically(path.c_str(), text.data(), text.size());
}

void append(std::string* text, const char* key, double value) {
    char line[80];
    std::snprintf(line, sizeof line, "%s %.17g\n", key, value);
    *text += line;
}

// tx ty tz qx qy qz qw, all digits of a double.
std::string pose_text(const Se3& T) {
    const Quaternion q = quaternion_of(T.R);
    char text[220];
    std::snprintf(text, sizeof text, "%.17g %.17g %.17g %.17g %.17g %.17g %.17g", T.t.x, T.t.y, T.t.z, q.x,
                  q.y, q.z, q.w);
    return text;
}

void append_camera(std::string* text, const std::string& prefix, const Camera& c) {
    const std::pair<const char*, double> values[] = {
        {"fx", c.fx}, {"fy", c.fy}, {"cx", c.cx}, {"cy", c.cy}, {"width", c.width}, {"height", c.height},
        {"k1", c.k1}, {"k2", c.k2}, {"p1", c.p1}, {"p2", c.p2}, {"k3", c.k3}};
    for (const auto& [key, value] : values) append(text, (prefix + key).c_str(), value);
}

bool same(const Se3& a, const Se3& b) {
    return std::equal(a.R.m, a.R.m + 9, b.R.m) && a.t.x == b.t.x && a.t.y == b.t.y && a.t.z == b.t.z;
}

// The largest difference of two intrinsics in pixels.
double difference(const Camera& a, const Camera& b) {
    return std::max(
        {std::fabs(a.fx - b.fx), std::fabs(a.fy - b.fy), std::fabs(a.cx - b.cx), std::fabs(a.cy - b.cy)});
}

class TumWriter {
  public:
    explicit TumWriter(const std::string& folder) : folder_(folder) {}
    Status add(const Frame& frame, int index, ConvertSummary* summary);
    Status finish(ConvertSummary* summary) const;

  private:
    Status check(const Frame& frame, int index);
    Status write_depth(const Frame& frame, const std::string& name);
    void add_imu(const Frame& frame);

    std::string folder_;
    std::string depth_list_, colour_list_, both_, truth_, imu_, camera_;
    Frame first_;  // without images
    Camera colour_camera_;
    bool has_colour_camera_ = false, metres_ = false;
    int width_ = 0, height_ = 0, other_cameras_ = 0, frames_ = 0;
    double furthest_ = 0;
    std::uint64_t too_far_ = 0;
    std::int64_t last_imu_ns_ = INT64_MIN;
    Image<std::uint16_t> rounded_;
};

Status TumWriter::check(const Frame& frame, int index) {
    const bool metres = frame.depth_u16.empty();
    const int width = metres ? frame.depth_f32.width : frame.depth_u16.width;
    const int height = metres ? frame.depth_f32.height : frame.depth_u16.height;
    if (frames_ == 0) {
        first_.depth_camera = frame.depth_camera;
        first_.depth_unit_m = frame.depth_unit_m;
        first_.T_camera_imu = frame.T_camera_imu;
        metres_ = metres;
        width_ = width;
        height_ = height;
    }
    if (width != width_ || height != height_ || metres != metres_ ||
        (!metres && frame.depth_unit_m != first_.depth_unit_m))
        return Status::error(
            Code::format, "frame %d: depth of %dx%d in units of %g m, expected %dx%d and %g as in the first",
            index, width, height, frame.depth_unit_m, width_, height_, first_.depth_unit_m);
    double off = difference(frame.depth_camera, first_.depth_camera);
    if (!frame.colour.empty()) {
        if (!has_colour_camera_) {
            has_colour_camera_ = true;
            colour_camera_ = frame.colour_camera;
            first_.T_colour_depth = frame.T_colour_depth;
        }
        if (frame.colour.width != colour_camera_.width || frame.colour.height != colour_camera_.height ||
            !same(frame.T_colour_depth, first_.T_colour_depth))
            return Status::error(
                Code::format,
                "frame %d: colour of %dx%d or its extrinsic differ, expected %dx%d and one for all", index,
                frame.colour.width, frame.colour.height, colour_camera_.width, colour_camera_.height);
        off = std::max(off, difference(frame.colour_camera, colour_camera_));
    }
    other_cameras_ += off > 0;
    furthest_ = std::max(furthest_, off);
    return {};
}

Status TumWriter::write_depth(const Frame& frame, const std::string& name) {
    const std::string path = folder_ + "/depth/" + name;
    if (!metres_) return write_png(path, frame.depth_u16.view());
    const Image<float>& metres = frame.depth_f32;
    rounded_.width = metres.width;
    rounded_.height = metres.height;
    rounded_.pixels.resize(metres.pixels.size());
    for (std::size_t i = 0; i < metres.pixels.size(); ++i) {
        const double steps =
            std::round(static_cast<double>(metres.pixels[i]) * frame.depth_unit_m * kMetreScale);
        const bool fits = steps > 0 && steps < 65535;
        too_far_ += steps >= 65535 && std::isfinite(steps);
        rounded_.pixels[i] = fits ? static_cast<std::uint16_t>(steps) : std::uint16_t{0};
    }
    return write_png(path, const_cast<const Image<std::uint16_t>&>(rounded_).view());
}

void TumWriter::add_imu(const Frame& frame) {
    for (const ImuSample& s : frame.imu) {
        if (s.t_ns <= last_imu_ns_) continue;  // frames overlap by one
        last_imu_ns_ = s.t_ns;
        char line[300];
        std::snprintf(line, sizeof line, "%s %.17g %.17g %.17g %.17g %.17g %.17g\n",
                      format_seconds(s.t_ns).c_str(), s.gyro_rad_s.x, s.gyro_rad_s.y, s.gyro_rad_s.z,
                      s.accel_m_s2.x, s.accel_m_s2.y, s.accel_m_s2.z);
        imu_ += line;
    }
}

Status TumWriter::add(const Frame& frame, int index, ConvertSummary* summary) {
    BURIN_TRY(check(frame, index));
    char name[24];
    std::snprintf(name, sizeof name, "%06d.png", frames_++);
    const std::string t = format_seconds(frame.t_ns);
    BURIN_TRY(write_depth(frame, name));
    depth_list_ += t + " depth/" + name + "\n";
    if (!frame.colour.empty()) {
        BURIN_TRY(write_png(folder_ + "/rgb/" + name, frame.colour.view()));
        const std::string colour = format_seconds(frame.colour_t_ns) + " rgb/" + name;
        colour_list_ += colour + "\n";
        both_ += colour + " " + t + " depth/" + name + "\n";
        ++summary->with_colour;
    }
    if (!frame.confidence.empty()) {
        BURIN_TRY(write_png(folder_ + "/confidence/" + name, frame.confidence.view()));
        ++summary->with_confidence;
    }
    if (frame.has_pose) {
        truth_ += t + " " + pose_text(frame.T_world_camera) + "\n";
        ++summary->with_pose;
    }
    add_imu(frame);
    ++summary->frames;
    return {};
}

Status TumWriter::finish(ConvertSummary* summary) const {
    const auto note = [summary](const std::string& line) { summary->notes += line + "\n"; };
    std::string camera = "# metres = depth_png / depth_scale\n";
    append_camera(&camera, "", first_.depth_camera);
    append(&camera, "depth_scale", metres_ ? kMetreScale : 1 / first_.depth_unit_m);
    if (has_colour_camera_) {
        append_camera(&camera, "colour_", colour_camera_);
        camera += "T_colour_depth " + pose_text(first_.T_colour_depth) + "\n";
    }
    if (!imu_.empty()) {
        camera += "T_camera_imu " + pose_text(first_.T_camera_imu) + "\n";
        BURIN_TRY(write_text(folder_ + "/imu.txt", "# t gx gy gz ax ay az: s, rad/s, m/s^2\n" + imu_));
    }
    BURIN_TRY(write_text(folder_ + "/camera.txt", camera));
    if (!truth_.empty())
        BURIN_TRY(write_text(folder_ + "/groundtruth.txt", "# timestamp tx ty tz qx qy qz qw\n" + truth_));
    if (metres_) note("floating-point depth was rounded to fifths of a millimetre");
    if (too_far_ > 0) note(std::to_string(too_far_) + " depth pixels beyond 13.1 m became none");
    if (other_cameras_ > 0) {
        char text[160];
        std::snprintf(text, sizeof text,
                      "%d frames have other intrinsics than the first, by up to %.3g pixels; the layout "
                      "keeps the first's",
                      other_cameras_, furthest_);
        note(text);
    }
    if (summary->with_colour == summary->frames) return write_text(folder_ + "/associations.txt", both_);
    if (summary->with_colour > 0) {
        note(std::to_string(summary->frames - summary->with_colour) +
             " frames have no colour; readers of the layout leave those out");
        BURIN_TRY(write_text(folder_ + "/rgb.txt", colour_list_));
    }
    return write_text(folder_ + "/depth.txt", depth_list_);
}

}  // namespace

Status convert_to_tum(const Dataset& dataset, const std::string& folder, const ConvertOptions& options,
                      const std::function<bool(int, int)>& progress, ConvertSummary* summary) {
    const int end = std::min(options.end, dataset.frame_count());
    if (options.begin < 0 || options.begin >= end)
        return Status::error(Code::invalid_argument, "%d frames, asked for are those from %d on",
                             dataset.frame_count(), options.begin);
    BURIN_TRY(prepare(folder));
    FramePrefetcher prefetcher(dataset, options.begin, end, 4, 1);
    TumWriter writer(folder);
    Frame frame;
    while (true) {
        const Result<bool> got = prefetcher.next(&frame);
        if (!got.ok()) return got.status();
        if (!*got) break;
        if (!options.colour) frame.colour.pixels.clear();
        BURIN_TRY(writer.add(frame, prefetcher.index(), summary));
        if (!progress(summary->frames, end - options.begin)) break;
    }
    BURIN_TRY(writer.finish(summary));
    // Folders that stayed empty.
    std::error_code ignored;
    for (const char* part : {"/rgb", "/confidence"}) fs::remove(folder + part, ignored);
    return {};
}

}  // namespace burin
