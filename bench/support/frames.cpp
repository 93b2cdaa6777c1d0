// SPDX-License-Identifier: MIT
#include "support/frames.h"

#include <sys/mman.h>
#include <sys/resource.h>
#include <time.h>

#include <algorithm>
#include <chrono>

#include "datasets/open.h"

namespace burin::bench {

double now_ms() {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

double cpu_ms() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

std::uint64_t peak_rss_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return 1024 * static_cast<std::uint64_t>(usage.ru_maxrss);  // Linux counts in KiB
}

bool parse_range(const std::string& text, FrameRange* range) {
    const auto colon = text.find(':');
    if (colon == std::string::npos || text.find_first_not_of("0123456789:") != std::string::npos ||
        text.size() > 16)
        return false;
    if (colon > 0) range->first = std::stoi(text.substr(0, colon));
    if (colon + 1 < text.size()) range->last = std::stoi(text.substr(colon + 1));
    return range->first < range->last;
}

Result<std::vector<Frame>> load_frames(const FrameRange& range, std::vector<double>* decode_ms) {
    const auto dataset = open_dataset(range.dataset, range.format);
    if (!dataset) return dataset.status();
    std::vector<Frame> frames;
    for (int i = range.first; i < std::min(range.last, (*dataset)->frame_count()); ++i) {
        Frame frame;
        const double start = now_ms();
        BURIN_TRY((*dataset)->load(i, &frame));
        const double ms = now_ms() - start;
        if (!frame.has_pose) continue;
        if (!range.colour) frame.colour = {};
        frames.push_back(std::move(frame));
        if (decode_ms) decode_ms->push_back(ms);
    }
    if (frames.empty())
        return Status::error(Code::invalid_argument, "%s: no frame from %d on has a pose",
                             range.dataset.c_str(), range.first);
    return frames;
}

FrameView view_of(const Frame& f) {
    FrameView view;
    view.t_ns = f.t_ns;
    if (!f.depth_u16.empty()) view.depth_u16 = f.depth_u16.view();
    if (!f.depth_f32.empty()) view.depth_f32 = f.depth_f32.view();
    view.depth_unit_m = f.depth_unit_m;
    view.depth_camera = f.depth_camera;
    if (!f.colour.empty()) view.colour = f.colour.view();
    view.colour_camera = f.colour_camera;
    view.T_colour_depth = f.T_colour_depth;
    view.T_world_camera = f.T_world_camera;
    view.imu = f.imu.data();
    view.imu_count = static_cast<int>(f.imu.size());
    view.T_camera_imu = f.T_camera_imu;
    return view;
}

BenchMap::~BenchMap() {
    burin_destroy(&map_);
    if (memory_) munmap(memory_, bytes_);
}

Status BenchMap::create(const burin_config& config) {
    const burin_map none = {0, 0};
    if (const burin_status s = burin_bytes(&config, &bytes_); s != BURIN_OK)
        return Status::error(static_cast<Code>(s), "%s", burin_last_error(none));
    void* memory =
        mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (memory == MAP_FAILED) return Status::error(Code::insufficient_memory, "--budget: no such memory");
    memory_ = memory;
    madvise(memory_, bytes_, MADV_HUGEPAGE);  // as the command line does
    if (const burin_status s = burin_create(&config, memory_, bytes_, &map_); s != BURIN_OK)
        return Status::error(static_cast<Code>(s), "%s", burin_last_error(none));
    return {};
}

}  // namespace burin::bench
