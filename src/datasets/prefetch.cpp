// SPDX-License-Identifier: MIT
#include "datasets/prefetch.h"

#include <algorithm>
#include <system_error>
#include <utility>

namespace burin {
namespace {

constexpr int kMaxAhead = 64;

}  // namespace

FramePrefetcher::FramePrefetcher(const Dataset& dataset, int begin, int end, int ahead, int threads)
    : dataset_(dataset),
      end_(std::clamp(end, 0, dataset.frame_count())),
      slots_(static_cast<std::size_t>(std::clamp(ahead, 1, kMaxAhead))),
      next_index_(std::clamp(begin, 0, end_)),
      next_decode_(next_index_) {
    const int count = std::clamp(threads, 1, static_cast<int>(slots_.size()));
    try {
        for (int i = 0; i < count; ++i) threads_.emplace_back([this] { work(); });
    } catch (const std::system_error&) {
        // The system gives no (more) threads: with none at all next() decodes by itself.
    }
}

FramePrefetcher::~FramePrefetcher() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    room_.notify_all();
    for (std::thread& thread : threads_) thread.join();
}

void FramePrefetcher::work() {
    std::unique_lock lock(mutex_);
    for (;;) {
        room_.wait(lock, [this] {
            return stop_ || next_decode_ == end_ ||
                   next_decode_ - next_index_ < static_cast<int>(slots_.size());
        });
        if (stop_ || next_decode_ == end_) return;
        const int index = next_decode_++;
        // The slot is this thread's alone until it is marked full: the index that held it before was
        // delivered.
        Slot& slot = slot_of(index);
        lock.unlock();
        const Status status = dataset_.load(index, &slot.frame);
        lock.lock();
        slot.status = status;
        slot.full = true;
        if (index == next_index_) arrived_.notify_one();
    }
}

Result<bool> FramePrefetcher::next(Frame* frame) {
    if (threads_.empty()) {
        if (next_index_ == end_) return false;
        Slot& slot = slots_.front();
        BURIN_TRY(dataset_.load(next_index_++, &slot.frame));
        std::swap(*frame, slot.frame);
        return true;
    }
    std::unique_lock lock(mutex_);
    if (next_index_ == end_) return false;
    Slot& slot = slot_of(next_index_);
    arrived_.wait(lock, [&slot] { return slot.full; });
    const Status status = slot.status;
    if (status) std::swap(*frame, slot.frame);
    slot.full = false;
    ++next_index_;
    lock.unlock();
    room_.notify_one();
    if (!status) return status;
    return true;
}

}  // namespace burin
