// SPDX-License-Identifier: MIT
#include "capture/image_pool.h"

#include <algorithm>
#include <new>

namespace burin {
namespace {

constexpr std::size_t kAlign = 64;  // a cache line, and the widest vector
constexpr std::size_t aligned(std::size_t bytes) { return (bytes + kAlign - 1) / kAlign * kAlign; }

}  // namespace

bool ImagePool::allocate(const DeviceInfo& info, int slots) {
    count_ = std::clamp(slots, 1, kMaxSlots);
    std::size_t total = kAlign;
    for (const StreamInfo& s : info.streams)
        total += aligned(s.image_bytes) * static_cast<std::size_t>(count_);
    memory_.reset();
    memory_.reset(new (std::nothrow) std::uint8_t[total]);
    if (!memory_) return false;
    bytes_ = total;
    std::fill_n(memory_.get(), total, std::uint8_t{0});  // the pages come now, not while streaming
    auto* next = memory_.get() + (kAlign - reinterpret_cast<std::uintptr_t>(memory_.get()) % kAlign) % kAlign;
    for (int kind = 0; kind < kStreamKinds; ++kind)
        for (int i = 0; i < count_; ++i) {
            slots_[kind][i] = Slot();
            slots_[kind][i].memory = next;
            next += aligned(info.streams[kind].image_bytes);
        }
    return true;
}

int ImagePool::take(StreamKind kind) {
    for (int i = 0; i < count_; ++i) {
        Slot& s = at(kind, i);
        if (s.references > 0) continue;
        s.references = 1;
        s.lent = false;
        s.image = CapturedImage();
        return i;
    }
    return -1;
}

int ImagePool::find(StreamKind kind, const std::uint8_t* memory) const {
    for (int i = 0; i < count_; ++i) {
        const Slot& s = slots_[static_cast<int>(kind)][i];
        if (s.memory == memory && s.references > 0) return i;
    }
    return -1;
}

}  // namespace burin
