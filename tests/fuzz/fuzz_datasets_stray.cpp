// SPDX-License-Identifier: MIT
// The text files of Stray Scanner and the headers of its video, by the first byte.
#include "datasets/mp4_size.h"
#include "datasets/stray.h"
#include "fuzz/fuzz_checks.h"

using namespace burin;

namespace {

void check_odometry(std::string_view text) {
    const auto read = parse_stray_odometry(text, fuzz::kName);
    if (!read) return fuzz::check_error(read.status());
    for (std::size_t i = 0; i < read->size(); ++i) {
        fuzz::check_rigid((*read)[i].T_world_camera);
        fuzz::check(i == 0 || (*read)[i - 1].t_ns < (*read)[i].t_ns);
    }
}

void check_imu(std::string_view text) {
    const auto read = parse_stray_imu(text, fuzz::kName);
    if (!read) return fuzz::check_error(read.status());
    for (std::size_t i = 1; i < read->samples.size(); ++i)
        fuzz::check(read->samples[i - 1].t_ns < read->samples[i].t_ns);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::string_view text = fuzz::text_of(data + 1, size - 1);
    if (data[0] == 'o') check_odometry(text);
    if (data[0] == 'i') check_imu(text);
    if (data[0] == 'm')
        if (const auto matrix = parse_stray_matrix(text, fuzz::kName); !matrix)
            fuzz::check_error(matrix.status());
    if (data[0] == 'v') {
        const auto found = mp4_picture_size(RandomFile::over(text, fuzz::kName));
        if (found.ok())
            fuzz::check(found->width > 0 && found->height > 0);
        else
            fuzz::check_error(found.status());
    }
    return 0;
}
