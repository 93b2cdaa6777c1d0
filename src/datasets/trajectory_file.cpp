// SPDX-License-Identifier: MIT
#include "datasets/trajectory_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "core/atomic_file.h"
#include "datasets/file.h"

namespace burin {
namespace {

// Splits a line into exactly `count` numbers. Not yet checked for being finite.
Status parse_row(std::string_view line, const char* where, int count, double* values) {
    std::string_view words[16];
    const int found = split_words(line, words, count);
    if (found != count)
        return Status::error(Code::format, "%s: %d values, expected %d numbers", where, found, count);
    for (int i = 0; i < count; ++i)
        if (!parse_number(words[i], &values[i]))
            return Status::error(Code::format, "%s: '%s' is no number, expected %d numbers", where,
                                 printable(words[i]).c_str(), count);
    return {};
}

std::string at_line(const std::string& name, int line) { return name + ":" + std::to_string(line); }

Status pose_error(const std::string& where, const Status& status) {
    return Status::error(Code::format, "%s: %s, expected a rigid camera-to-world pose", where.c_str(),
                         status.text());
}

// Earth-centred coordinates (6.4e6 m) fit; beyond that a file is damaged, and a voxel index would not hold
// it.
constexpr double kMaxReachM = 1e7;

Status check_reach(const Se3& T, const std::string& where) {
    for (const double v : {T.t.x, T.t.y, T.t.z})
        if (!(std::fabs(v) <= kMaxReachM))
            return Status::error(Code::format, "%s: position %g m, expected at most %g m from the origin",
                                 where.c_str(), v, kMaxReachM);
    return {};
}

Result<MaybePose> pose_of(const double* matrix, const std::string& where) {
    // Tools that export ScanNet write -inf either everywhere or everywhere but in the last row.
    if (std::all_of(matrix, matrix + 12, [](double v) { return std::isinf(v) && v < 0; })) return MaybePose{};
    Result<Se3> pose = se3_from_matrix(matrix, 4);
    if (!pose) return pose_error(where, pose.status());
    BURIN_TRY(check_reach(*pose, where));
    return MaybePose{true, *pose};
}

}  // namespace

Result<Trajectory> parse_tum_trajectory(std::string_view text, const std::string& name) {
    Trajectory trajectory;
    LineReader lines(text);
    std::string_view line;
    for (bool first = true; lines.next_content(&line); first = false) {
        const std::string where = at_line(name, lines.number());
        double v[8];
        std::string_view words[8];
        split_words(line, words, 8);
        // A header that somebody forgot to comment out: some copies of TUM's files begin with "timestamp tx
        // ty ...".
        if (first && words[0] == "timestamp") continue;
        BURIN_TRY(parse_row(line, where.c_str(), 8, v));
        for (int i = 1; i < 8; ++i)
            if (!std::isfinite(v[i]))
                return Status::error(Code::format, "%s: '%s' is not finite, expected 8 finite numbers",
                                     where.c_str(), printable(words[i]).c_str());
        StampedPose pose;
        const std::string_view stamp = words[0];
        if (!parse_seconds(stamp, &pose.t_ns))
            return Status::error(Code::format, "%s: time stamp is '%s', expected seconds within +-9.2e9",
                                 where.c_str(), printable(stamp).c_str());
        if (!trajectory.empty() && pose.t_ns <= trajectory.back().t_ns)
            return Status::error(Code::format, "%s: time stamp %s is not after %s, expected rising stamps",
                                 where.c_str(), format_seconds(pose.t_ns).c_str(),
                                 format_seconds(trajectory.back().t_ns).c_str());
        Result<Se3> T = se3_from_quaternion({v[1], v[2], v[3]}, {v[4], v[5], v[6], v[7]});
        if (!T) return pose_error(where, T.status());
        BURIN_TRY(check_reach(*T, where));
        pose.T_world_camera = *T;
        trajectory.push_back(pose);
    }
    if (trajectory.empty())
        return Status::error(Code::format, "%s: holds 0 poses, expected lines 't tx ty tz qx qy qz qw'",
                             name.c_str());
    return trajectory;
}

std::string format_tum_trajectory(const Trajectory& trajectory) {
    std::string text = "# timestamp tx ty tz qx qy qz qw\n";
    for (const StampedPose& pose : trajectory) {
        const Quaternion q = quaternion_of(pose.T_world_camera.R);
        const Vec3d t = pose.T_world_camera.t;
        char line[400];  // seven %.9f of at most 1e30 and a stamp
        std::snprintf(line, sizeof line, "%s %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n",
                      format_seconds(pose.t_ns).c_str(), t.x, t.y, t.z, q.x, q.y, q.z, q.w);
        text += line;
    }
    return text;
}

Result<std::vector<MaybePose>> parse_matrix_lines(std::string_view text, const std::string& name) {
    std::vector<MaybePose> poses;
    LineReader lines(text);
    std::string_view line;
    while (lines.next_content(&line)) {
        const std::string where = at_line(name, lines.number());
        double matrix[16];
        BURIN_TRY(parse_row(line, where.c_str(), 16, matrix));
        Result<MaybePose> pose = pose_of(matrix, where);
        if (!pose) return pose.status();
        poses.push_back(*pose);
    }
    if (poses.empty())
        return Status::error(Code::format, "%s: holds 0 poses, expected 16 numbers a line", name.c_str());
    return poses;
}

Result<MaybePose> parse_pose_file(std::string_view text, const std::string& name) {
    double matrix[16];
    int have = 0;
    LineReader lines(text);
    std::string_view line;
    while (lines.next_content(&line)) {
        std::string_view words[16];
        const int found = split_words(line, words, 16);
        if (have + found > 16)
            return Status::error(Code::format, "%s:%d: more than 16 values, expected a 4x4 matrix",
                                 name.c_str(), lines.number());
        for (int i = 0; i < found; ++i)
            if (!parse_number(words[i], &matrix[have++]))
                return Status::error(Code::format, "%s:%d: '%s' is no number, expected a 4x4 matrix",
                                     name.c_str(), lines.number(), printable(words[i]).c_str());
    }
    if (have != 16)
        return Status::error(Code::format, "%s: %d numbers, expected the 16 of a 4x4 matrix", name.c_str(),
                             have);
    return pose_of(matrix, name);
}

Result<std::vector<LogPose>> parse_log_trajectory(std::string_view text, const std::string& name) {
    std::vector<LogPose> poses;
    LineReader lines(text);
    std::string_view line;
    while (lines.next_content(&line)) {
        const std::string where = at_line(name, lines.number());
        LogPose pose;
        double v[16];
        BURIN_TRY(parse_row(line, where.c_str(), 3, v));
        for (int i = 0; i < 3; ++i) {
            if (!(std::fabs(v[i]) <= 1e9) || v[i] != std::floor(v[i]))
                return Status::error(Code::format, "%s: '%s' is not three integers, expected a block's head",
                                     where.c_str(), printable(line).c_str());
            pose.ids[static_cast<std::size_t>(i)] = static_cast<int>(v[i]);
        }
        if (pose.ids[0] < 0 || (!poses.empty() && pose.ids[0] <= poses.back().ids[0]))
            return Status::error(Code::format, "%s: frame index %d, expected one above %d", where.c_str(),
                                 pose.ids[0], poses.empty() ? -1 : poses.back().ids[0]);
        for (int row = 0; row < 4; ++row) {
            if (!lines.next_content(&line))
                return Status::error(Code::format,
                                     "%s: the text ends after %d rows of this block, expected 4",
                                     where.c_str(), row);
            BURIN_TRY(parse_row(line, at_line(name, lines.number()).c_str(), 4, v + 4 * row));
        }
        Result<Se3> T = se3_from_matrix(v, 4);
        if (!T) return pose_error(where, T.status());
        BURIN_TRY(check_reach(*T, where));
        pose.T_world_camera = *T;
        poses.push_back(pose);
    }
    if (poses.empty())
        return Status::error(Code::format, "%s: holds 0 poses, expected blocks of 'i j k' and a 4x4 matrix",
                             name.c_str());
    return poses;
}

namespace {

template <class T>
Result<T> read_with(Result<T> (*parse)(std::string_view, const std::string&), const std::string& path) {
    std::string text;
    BURIN_TRY(read_file(path, kMaxTextBytes, &text));
    return parse(text, path);
}

}  // namespace

Result<Trajectory> read_tum_trajectory(const std::string& path) {
    return read_with(parse_tum_trajectory, path);
}
Result<std::vector<MaybePose>> read_matrix_lines(const std::string& path) {
    return read_with(parse_matrix_lines, path);
}
Result<MaybePose> read_pose_file(const std::string& path) { return read_with(parse_pose_file, path); }
Result<std::vector<LogPose>> read_log_trajectory(const std::string& path) {
    return read_with(parse_log_trajectory, path);
}
Status write_tum_trajectory(const std::string& path, const Trajectory& trajectory) {
    const std::string text = format_tum_trajectory(trajectory);
    return write_file_atomically(path.c_str(), text.data(), text.size());
}

Se3 interpolate(const Se3& a, const Se3& b, double s) {
    const Quaternion p = quaternion_of(a.R);
    Quaternion q = quaternion_of(b.R);
    double cosine = p.x * q.x + p.y * q.y + p.z * q.z + p.w * q.w;
    if (cosine < 0) {  // q and -q are one rotation; the nearer one gives the shorter arc
        q = {-q.x, -q.y, -q.z, -q.w};
        cosine = -cosine;
    }
    double wp = 1 - s, wq = s;
    // Below an arc of 0.03 mrad sin(angle) has no digits left and the chord is as good.
    const double angle = std::acos(std::min(cosine, 1.0));
    if (angle > 3e-5) {
        wp = std::sin((1 - s) * angle) / std::sin(angle);
        wq = std::sin(s * angle) / std::sin(angle);
    }
    Quaternion r{wp * p.x + wq * q.x, wp * p.y + wq * q.y, wp * p.z + wq * q.z, wp * p.w + wq * q.w};
    const double n = std::sqrt(r.x * r.x + r.y * r.y + r.z * r.z + r.w * r.w);
    r = {r.x / n, r.y / n, r.z / n, r.w / n};
    const Result<Se3> T = se3_from_quaternion(a.t * (1 - s) + b.t * s, r);
    return T ? *T : a;  // two rigid transforms always give a third for 0 <= s <= 1
}

MaybePose pose_at(const Trajectory& trajectory, std::int64_t t_ns) {
    const auto after =
        std::lower_bound(trajectory.begin(), trajectory.end(), t_ns,
                         [](const StampedPose& pose, std::int64_t t) { return pose.t_ns < t; });
    if (after != trajectory.end() && after->t_ns == t_ns) return {true, after->T_world_camera};
    const bool has_after = after != trajectory.end(), has_before = after != trajectory.begin();
    if (has_after && has_before) {
        const StampedPose &a = *(after - 1), &b = *after;
        const std::uint64_t gap = static_cast<std::uint64_t>(b.t_ns) - static_cast<std::uint64_t>(a.t_ns);
        if (gap <= static_cast<std::uint64_t>(kMaxPoseGapNs))
            return {true,
                    interpolate(a.T_world_camera, b.T_world_camera, double(t_ns - a.t_ns) / double(gap))};
    }
    const auto close = [t_ns](const StampedPose& pose) {
        return t_ns - kSameInstantNs <= pose.t_ns && pose.t_ns <= t_ns + kSameInstantNs;
    };
    if (has_before && close(*(after - 1))) return {true, (after - 1)->T_world_camera};
    if (has_after && close(*after)) return {true, after->T_world_camera};
    return {};
}

}  // namespace burin
