// SPDX-License-Identifier: MIT
// A sequence with given poses through a session of its own, whose layer of planes the benches look into.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "api/config.h"
#include "core/jobs.h"
#include "eval/plane_metrics.h"
#include "session/fusion_session.h"

namespace burin::bench {

struct MappingOptions {
    burin_config config;
    MergeBy merge_by = MergeBy::ransac;
    int first = 0, last = 1 << 30;
};

class Mapping {
  public:
    explicit Mapping(const MappingOptions& options);
    // Fuses all frames that have a pose, by one thread; each(number of frames so far) after every one.
    Status run(const std::string& folder, const std::function<void(int)>& each = {});

    FusionSession& session() { return *session_; }
    const FusionSession& session() const { return *session_; }
    Jobs& jobs() { return jobs_; }
    const std::vector<FrameReport>& frames() const { return frames_; }
    int told() const;
    // The told planes as a file of planes has them.
    std::vector<LabelledPlane> planes();

  private:
    struct Freed {
        void operator()(void* memory) const;
    };
    MappingOptions options_;
    std::unique_ptr<void, Freed> memory_;
    std::unique_ptr<FusionSession> session_;
    Jobs jobs_{1};
    std::vector<FrameReport> frames_;
};

// The q-th quantile; 0 of nothing.
double quantile(std::vector<double> values, double q);
double mean_of(const std::vector<double>& values);

}  // namespace burin::bench
