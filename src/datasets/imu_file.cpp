// SPDX-License-Identifier: MIT
#include "datasets/imu_file.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "datasets/file.h"

namespace burin {
namespace {

// Gyroscopes end at 4000 degrees/s (70 rad/s), accelerometers that survive in a hand at 200 g (2000 m/s^2).
constexpr double kMostGyro = 100, kMostAccel = 2000;

}  // namespace

Result<std::vector<ImuSample>> parse_imu_text(std::string_view text, const std::string& name) {
    std::vector<ImuSample> samples;
    LineReader lines(text);
    std::string_view line;
    while (lines.next_content(&line)) {
        const std::string at = name + ":" + std::to_string(lines.number());
        const char* where = at.c_str();
        std::string_view words[7];
        const int count = split_words(line, words, 7);
        if (count != 7)
            return Status::error(Code::format, "%s: %d values, expected 7: 't gx gy gz ax ay az'", where,
                                 count);
        ImuSample sample;
        if (!parse_seconds(words[0], &sample.t_ns))
            return Status::error(Code::format, "%s: time stamp is '%s', expected seconds within +-9.2e9",
                                 where, printable(words[0]).c_str());
        if (!samples.empty() && sample.t_ns <= samples.back().t_ns)
            return Status::error(Code::format, "%s: time stamp %s is not after %s, expected rising stamps",
                                 where, format_seconds(sample.t_ns).c_str(),
                                 format_seconds(samples.back().t_ns).c_str());
        for (int i = 0; i < 6; ++i) {
            double value = 0;
            const double most = i < 3 ? kMostGyro : kMostAccel;
            if (!parse_number(words[i + 1], &value) || !(std::fabs(value) <= most))
                return Status::error(Code::format, "%s: '%s', expected %s", where,
                                     printable(words[i + 1]).c_str(),
                                     i < 3 ? "an angular velocity of at most 100 rad/s"
                                           : "a specific force of at most 2000 m/s^2");
            (i < 3 ? sample.gyro_rad_s : sample.accel_m_s2)[i % 3] = value;
        }
        samples.push_back(sample);
    }
    if (samples.empty())
        return Status::error(Code::format, "%s: holds 0 samples, expected lines 't gx gy gz ax ay az'",
                             name.c_str());
    return samples;
}

Result<std::vector<ImuSample>> read_imu(const std::string& path) {
    std::string text;
    BURIN_TRY(read_file(path, kMaxTextBytes, &text));
    return parse_imu_text(text, path);
}

std::string format_imu(const std::vector<ImuSample>& samples) {
    std::string text;
    for (const ImuSample& s : samples) {
        char line[300];  // a stamp and six %.9f of at most 2000
        std::snprintf(line, sizeof line, "%s %.9f %.9f %.9f %.9f %.9f %.9f\n", format_seconds(s.t_ns).c_str(),
                      s.gyro_rad_s.x, s.gyro_rad_s.y, s.gyro_rad_s.z, s.accel_m_s2.x, s.accel_m_s2.y,
                      s.accel_m_s2.z);
        text += line;
    }
    return text;
}

std::vector<ImuSample> imu_of_frame(const std::vector<ImuSample>& samples, const std::int64_t* previous_ns,
                                    std::int64_t t_ns) {
    const auto after = [&](std::int64_t t) {
        return std::upper_bound(samples.begin(), samples.end(), t,
                                [](std::int64_t a, const ImuSample& b) { return a < b.t_ns; });
    };
    auto first = after(previous_ns ? *previous_ns : t_ns);
    if (!previous_ns && first != samples.begin()) --first;
    auto end = std::lower_bound(samples.begin(), samples.end(), t_ns,
                                [](const ImuSample& a, std::int64_t b) { return a.t_ns < b; });
    if (end != samples.end()) ++end;
    if (end <= first) return {};
    return {first, end};
}

}  // namespace burin
