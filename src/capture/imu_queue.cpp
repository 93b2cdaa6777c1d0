// SPDX-License-Identifier: MIT
#include "capture/imu_queue.h"

namespace burin {

void ImuQueue::add(const ImuSample& sample) {
    if (count_ > 0 && sample.t_ns <= at(count_ - 1).t_ns) return;
    if (count_ == kSamples) {
        first_ = (first_ + 1) % kSamples;
        --count_;
    }
    samples_[(first_ + count_) % kSamples] = sample;
    ++count_;
}

void ImuQueue::map(const ClockMap& clock) {
    for (int i = 0; i < count_; ++i) {
        ImuSample& sample = samples_[(first_ + i) % kSamples];
        sample.t_ns = clock.host_ns(sample.t_ns);
    }
}

int ImuQueue::take(std::int64_t t_ns, ImuSample* out) {
    const auto forget = [&](int samples) {
        first_ = (first_ + samples) % kSamples;
        count_ -= samples;
    };
    int past = 0;  // at or before this frame
    while (past < count_ && at(past).t_ns <= t_ns) ++past;
    if (!any_frame_ && past > 1) {
        forget(past - 1);
        past = 1;
    }
    any_frame_ = true;
    int taken = 0;
    while (taken < count_) {
        out[taken] = at(taken);
        if (out[taken++].t_ns >= t_ns) break;
    }
    forget(past);
    return taken;
}

}  // namespace burin
