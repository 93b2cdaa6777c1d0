// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "datasets/arkit.h"
#include "datasets/file.h"
#include "datasets/stray.h"

namespace burin {
namespace {

// Splits at commas, blanks around them cut off. Fills at most `capacity` words, returns how many there are.
int split_commas(std::string_view line, std::string_view* words, int capacity) {
    constexpr std::string_view kBlank = " \t\r";
    int count = 0;
    while (true) {
        const std::size_t comma = std::min(line.find(','), line.size());
        std::string_view word = line.substr(0, comma);
        word.remove_prefix(std::min(word.find_first_not_of(kBlank), word.size()));
        word = word.substr(0, word.find_last_not_of(kBlank) + 1);
        if (count < capacity) words[count] = word;
        ++count;
        if (comma == line.size()) return count;
        line.remove_prefix(comma + 1);
    }
}

// The next line of values: passes over the heading, which begins with a letter. False at the end.
Result<bool> next_row(LineReader* lines, const std::string& name, int wanted, const char* heading,
                      std::string_view* words) {
    std::string_view line;
    while (lines->next_content(&line)) {
        if (lines->number() == 1 && line[0] == 't') continue;  // "timestamp, ..."
        const int count = split_commas(line, words, wanted);
        if (count >= wanted) return true;
        return Status::error(Code::format, "%s:%d: %d values, expected '%s'", name.c_str(), lines->number(),
                             count, heading);
    }
    return false;
}

Status take_numbers(const std::string_view* words, int count, const std::string& name, int line, double most,
                    double* values) {
    for (int i = 0; i < count; ++i)
        if (!parse_number(words[i], &values[i]) || !(std::fabs(values[i]) <= most))
            return Status::error(Code::format, "%s:%d: '%s', expected a number within +-%g", name.c_str(),
                                 line, printable(words[i]).c_str(), most);
    return {};
}

Status take_stamp(std::string_view word, const std::string& name, int line, std::int64_t* t_ns) {
    if (parse_seconds(word, t_ns)) return {};
    return Status::error(Code::format, "%s:%d: time stamp is '%s', expected seconds within +-9.2e9",
                         name.c_str(), line, printable(word).c_str());
}

}  // namespace

Result<std::vector<StrayPose>> parse_stray_odometry(std::string_view text, const std::string& name) {
    constexpr const char* kHeading = "timestamp, frame, x, y, z, qx, qy, qz, qw";
    constexpr double kFarthest = 1e6;  // metres
    std::vector<StrayPose> poses;
    LineReader lines(text);
    std::string_view words[9];
    while (true) {
        const Result<bool> got = next_row(&lines, name, 9, kHeading, words);
        if (!got) return got.status();
        if (!*got) break;
        StrayPose pose;
        double v[7], frame = 0;
        BURIN_TRY(take_stamp(words[0], name, lines.number(), &pose.t_ns));
        if (!parse_number(words[1], &frame) || !(frame >= 0 && frame < 1e9) || frame != std::floor(frame))
            return Status::error(Code::format,
                                 "%s:%d: frame number is '%s', expected a whole number below 1e9",
                                 name.c_str(), lines.number(), printable(words[1]).c_str());
        pose.frame = static_cast<std::int64_t>(frame);
        BURIN_TRY(take_numbers(words + 2, 7, name, lines.number(), kFarthest, v));
        if (!poses.empty() && (pose.t_ns <= poses.back().t_ns || pose.frame <= poses.back().frame))
            return Status::error(Code::format, "%s:%d: stamp or frame number does not rise, expected both to",
                                 name.c_str(), lines.number());
        const Result<Se3> T = se3_from_quaternion({v[0], v[1], v[2]}, {v[3], v[4], v[5], v[6]});
        if (!T)
            return Status::error(Code::format, "%s:%d: %s", name.c_str(), lines.number(), T.status().text());
        // The app has turned the camera's axes to OpenCV's already (OdometryEncoder.swift: q_WA * q_AC).
        pose.T_world_camera = z_up_from_y_up(*T);
        poses.push_back(pose);
    }
    if (poses.empty())
        return Status::error(Code::format, "%s: holds 0 poses, expected lines '%s'", name.c_str(), kHeading);
    return poses;
}

Result<StrayImu> parse_stray_imu(std::string_view text, const std::string& name) {
    StrayImu imu;
    LineReader lines(text);
    std::string_view words[7];
    std::size_t repeated = 0;
    std::vector<double> norms;
    while (true) {
        const Result<bool> got =
            next_row(&lines, name, 7, "timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z", words);
        if (!got) return got.status();
        if (!*got) break;
        ImuSample sample;
        double a[3], w[3];
        BURIN_TRY(take_stamp(words[0], name, lines.number(), &sample.t_ns));
        BURIN_TRY(take_numbers(words + 1, 3, name, lines.number(), 2000, a));  // 200 g
        BURIN_TRY(take_numbers(words + 4, 3, name, lines.number(), 100, w));   // rad/s
        if (!imu.samples.empty() && sample.t_ns <= imu.samples.back().t_ns) {
            ++repeated;  // the app pairs the newest of two sensors, whose stamps may meet
            continue;
        }
        sample.accel_m_s2 = {a[0], a[1], a[2]};
        sample.gyro_rad_s = {w[0], w[1], w[2]};
        norms.push_back(norm(sample.accel_m_s2));
        imu.samples.push_back(sample);
    }
    if (imu.samples.empty()) return imu;
    if (repeated > 0)
        imu.note = std::to_string(repeated) + " IMU readings left out: their stamps do not rise\n";
    // A hand at work is under g / 2 for most of the time, so the middle norm tells the unit.
    std::nth_element(norms.begin(), norms.begin() + static_cast<std::ptrdiff_t>(norms.size() / 2),
                     norms.end());
    const double middle = norms[norms.size() / 2];
    double unit = 0;
    if (middle > 0.5 && middle < 1.5) unit = kGravity_m_s2;
    if (middle > 0.5 * kGravity_m_s2 && middle < 1.5 * kGravity_m_s2) unit = 1;
    if (unit == 0) {
        imu.note += "imu.csv is left out: its middle acceleration of " + std::to_string(middle) +
                    " is neither 1 g nor 9.8 m/s^2\n";
        imu.samples.clear();
        return imu;
    }
    // CoreMotion's acceleration at rest is that of gravity, the opposite of specific force
    // (CMAccelerometerData: face up reads z = -1).
    for (ImuSample& sample : imu.samples) sample.accel_m_s2 = sample.accel_m_s2 * -unit;
    return imu;
}

Result<StrayMatrix> parse_stray_matrix(std::string_view text, const std::string& name) {
    double m[9];
    LineReader lines(text);
    for (int row = 0; row < 3; ++row) {
        std::string_view words[3];
        const Result<bool> got = next_row(&lines, name, 3, "fx, 0, cx / 0, fy, cy / 0, 0, 1", words);
        if (!got) return got.status();
        if (!*got)
            return Status::error(Code::format, "%s: %d lines, expected a 3x3 matrix", name.c_str(), row);
        BURIN_TRY(take_numbers(words, 3, name, lines.number(), 1e6, m + 3 * row));
    }
    if (m[1] != 0 || m[3] != 0 || m[6] != 0 || m[7] != 0 || m[8] != 1 || !(m[0] > 0) || !(m[4] > 0))
        return Status::error(
            Code::format, "%s: is no pinhole camera, expected fx, 0, cx / 0, fy, cy / 0, 0, 1", name.c_str());
    return StrayMatrix{m[0], m[4], m[2], m[5]};
}

}  // namespace burin
