// SPDX-License-Identifier: MIT
#include "capture/pairing.h"

#include <algorithm>

namespace burin {
namespace {

// Stamps are untrusted: the distance of any two, without overflow, as far as it matters here.
std::int64_t distance_ns(std::int64_t a, std::int64_t b) {
    const std::uint64_t d = a > b ? static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b)
                                  : static_cast<std::uint64_t>(b) - static_cast<std::uint64_t>(a);
    return static_cast<std::int64_t>(std::min<std::uint64_t>(d, INT64_MAX));
}

// Where a device tells no rate: that of the slowest sensor at hand.
constexpr double kSlowest_fps = 15;

}  // namespace

Pairing::Waiting Pairing::Queue::pop_front() {
    const Waiting first = entries[0];
    std::copy(entries + 1, entries + count, entries);
    --count;
    return first;
}

void Pairing::reset(const DeviceInfo& info) {
    for (int k = 0; k < kStreamKinds; ++k) {
        queues_[k] = Queue();
        queues_[k].used = info.streams[k].width > 0;
        const double fps = info.streams[k].fps;
        queues_[k].period_ns = static_cast<std::int64_t>(1e9 / (fps > 0.1 ? fps : kSlowest_fps));
    }
    for (const StreamKind kind : {StreamKind::colour, StreamKind::infrared, StreamKind::depth})
        if (info.has(kind)) leading_ = kind;
}

void Pairing::add(StreamKind kind, int slot, std::int64_t time_ns, int* spill) {
    Queue& q = queues_[static_cast<int>(kind)];
    *spill = q.count == kWaiting ? q.pop_front().slot : -1;
    q.entries[q.count++] = {slot, time_ns, 0};
}

// The nearest companion is known, or there is no time left to wait for it.
bool Pairing::decided(const Queue& companion, const Waiting& leader, std::int64_t now_ns) const {
    if (!companion.used) return true;
    // The next companion is a period later than the last: when the last is within half of it, none will be
    // nearer.
    if (companion.count > 0) {
        const std::int64_t last_ns = companion.entries[companion.count - 1].time_ns;
        if (last_ns >= leader.time_ns || distance_ns(last_ns, leader.time_ns) <= companion.period_ns / 2)
            return true;
    }
    return now_ns - leader.since_ns >= companion.period_ns;
}

bool Pairing::next(ImagePool& pool, std::int64_t now_ns, Bundle* bundle, Dropped* dropped,
                   int* dropped_count) {
    *dropped_count = 0;
    Queue& leaders = queues_[static_cast<int>(leading_)];
    if (leaders.count == 0) return false;
    for (int i = 0; i < leaders.count; ++i)
        if (leaders.entries[i].since_ns == 0) leaders.entries[i].since_ns = now_ns;
    const Waiting leader = leaders.entries[0];
    for (int k = 0; k < kStreamKinds; ++k)
        if (k != static_cast<int>(leading_) && !decided(queues_[k], leader, now_ns)) return false;
    leaders.pop_front();
    *bundle = Bundle();
    bundle->slots[static_cast<int>(leading_)] = leader.slot;
    for (int k = 0; k < kStreamKinds; ++k) {
        Queue& q = queues_[k];
        if (k == static_cast<int>(leading_) || q.count == 0) continue;
        int best = 0;
        for (int i = 1; i < q.count; ++i)
            if (distance_ns(q.entries[i].time_ns, leader.time_ns) <
                distance_ns(q.entries[best].time_ns, leader.time_ns))
                best = i;
        // Later leaders are later in time, so what lies before the nearest is of no more use.
        for (int i = 0; i < best; ++i)
            dropped[(*dropped_count)++] = {static_cast<StreamKind>(k), q.pop_front().slot};
        // Half of the longer period is what two free-running streams are apart at most; a tenth more for
        // jitter.
        const std::int64_t reach = std::max(q.period_ns, leaders.period_ns) * 6 / 10;
        if (distance_ns(q.entries[0].time_ns, leader.time_ns) > reach) continue;
        bundle->slots[k] = q.entries[0].slot;
        pool.hold(static_cast<StreamKind>(k), q.entries[0].slot);
    }
    return true;
}

bool Pairing::give_up(Dropped* dropped) {
    for (int i = 0; i < kStreamKinds; ++i) {
        const int k = (static_cast<int>(leading_) + i) % kStreamKinds;
        if (queues_[k].count == 0) continue;
        *dropped = {static_cast<StreamKind>(k), queues_[k].pop_front().slot};
        return true;
    }
    return false;
}

}  // namespace burin
