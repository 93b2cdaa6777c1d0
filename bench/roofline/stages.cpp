// SPDX-License-Identifier: MIT
#include "roofline/stages.h"

#include <sys/mman.h>

#include <algorithm>

#include "api/config.h"
#include "support/frames.h"

namespace burin::bench {
namespace {

// The parts of a session, laid out in memory that is given back at the end.
struct Parts {
    FusionOptions options;
    Volume volume;
    DepthStage depth;
    Integrator integrator;
    Jobs jobs{1};
    void* memory = nullptr;
    std::size_t bytes = 0;

    ~Parts() {
        if (memory) munmap(memory, bytes);
    }
    void place(Arena& arena) {
        volume.place(arena, options.volume);
        depth.place(arena, options.depth);
        integrator.place(arena, options.integration, options.depth.max_width, options.depth.max_height);
    }
    Status create(const burin_config& config) {
        std::uint64_t map_bytes = 0;
        BURIN_TRY(plan_map(config, &options, &map_bytes));
        Arena measure;
        place(measure);
        bytes = measure.used();
        void* got =
            mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
        if (got == MAP_FAILED) return Status::error(Code::insufficient_memory, "stages: no memory");
        memory = got;
        Arena arena(memory, bytes);
        place(arena);
        volume.clear();
        return {};
    }
};

void keep_least(IntegrationTimes* least, const IntegrationTimes& t) {
    for (double IntegrationTimes::*stage :
         {&IntegrationTimes::mark, &IntegrationTimes::choose, &IntegrationTimes::test,
          &IntegrationTimes::insert, &IntegrationTimes::fuse, &IntegrationTimes::carve})
        least->*stage = std::min(least->*stage, t.*stage);
}

}  // namespace

Result<std::vector<StageTimes>> time_stages(const std::vector<Frame>& frames, const burin_config& config,
                                            int passes) {
    std::vector<StageTimes> times(frames.size());
    for (int pass = 0; pass < passes; ++pass) {
        Parts parts;
        BURIN_TRY(parts.create(config));
        for (std::size_t i = 0; i < frames.size(); ++i) {
            const FrameView view = view_of(frames[i]);
            const double start = cpu_ms();
            parts.depth.prepare(view, parts.jobs);
            const double depth_ms = cpu_ms() - start;
            const IntegrationCounts counts = parts.integrator.integrate(
                parts.volume, parts.depth, view, static_cast<std::uint32_t>(i + 1), parts.jobs);
            StageTimes& t = times[i];
            const IntegrationTimes& now = parts.integrator.times();
            if (pass == 0) t = {depth_ms, now, static_cast<double>(counts.fused)};
            t.depth = std::min(t.depth, depth_ms);
            keep_least(&t.integrate, now);
        }
    }
    return times;
}

}  // namespace burin::bench
