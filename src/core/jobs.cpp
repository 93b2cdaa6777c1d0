// SPDX-License-Identifier: MIT
#include "core/jobs.h"

#include <algorithm>

namespace burin {
namespace {

// A frame has several parallel stages a few hundred microseconds apart; sleeping in the kernel between them
// costs 50 us each way, so a waiting thread first spins for about 20 us.
constexpr int kSpins = 2000;

inline void pause() {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__) || defined(__arm__)
    asm volatile("yield");
#endif
}

}  // namespace

Jobs::Jobs(int threads) : threads_(std::clamp(threads, 1, kMaxThreads)) {
    if (threads_ == 1) return;
    workers_ = std::make_unique<Worker[]>(static_cast<std::size_t>(threads_ - 1));
    for (int i = 1; i < threads_; ++i) {
        Worker& worker = workers_[i - 1];
        worker.jobs = this;
        worker.index = i;
        if (::pthread_create(&worker.thread, nullptr, start, &worker) != 0) threads_ = i;  // ends the loop
    }
}

void* Jobs::start(void* worker) {
    static_cast<Worker*>(worker)->jobs->work(static_cast<Worker*>(worker)->index);
    return nullptr;
}

Jobs::~Jobs() {
    stop_.store(true);
    run_id_.fetch_add(1);
    run_id_.notify_all();
    for (int i = 1; i < threads_; ++i) ::pthread_join(workers_[i - 1].thread, nullptr);
}

void Jobs::run_erased(int count, Function function, void* context) {
    // Told here for the first item, so that a run is always told of, even when the other threads take all
    // items.
    if (progress_ &&
        (progress_->stopped() || !progress_->report(0, static_cast<std::uint64_t>(std::max(count, 1)))))
        return;
    function_ = function;
    context_ = context;
    count_ = count;
    next_.store(0, std::memory_order_relaxed);
    if (count > 1 && pool_.run)
        run_by_pool();
    else if (count > 1 && threads_ > 1)
        run_by_workers();
    else
        run_alone();
    if (progress_) progress_->next_stage();
}

void Jobs::run_alone() {
    for (int item = 0; item < count_; ++item) {
        if (progress_ && item > 0 &&
            !progress_->report(static_cast<std::uint64_t>(item), static_cast<std::uint64_t>(count_)))
            return;
        function_(context_, item, 0);
    }
}

void Jobs::take_items(int worker, bool tell) {
    for (int item; (item = next_.fetch_add(1, std::memory_order_relaxed)) < count_;) {
        if (tell && item > 0 &&
            !progress_->report(static_cast<std::uint64_t>(item), static_cast<std::uint64_t>(count_))) {
            next_.store(count_, std::memory_order_relaxed);  // nobody finds another
            return;
        }
        function_(context_, item, worker);
    }
}

void Jobs::enter_from_pool(void* self, std::uint32_t) {
    Jobs& jobs = *static_cast<Jobs*>(self);
    // Sequentially consistent, as in run_by_pool: either this call sees that the run is over, or the run
    // waits for it.
    jobs.inside_.fetch_add(1);
    if (jobs.open_.load()) {
        const int worker = jobs.tickets_.fetch_add(1);
        if (worker < jobs.pool_.threads) jobs.take_items(worker, jobs.progress_ != nullptr);
    }
    jobs.inside_.fetch_sub(1);
    jobs.inside_.notify_all();
}

void Jobs::run_by_pool() {
    tickets_.store(0);
    open_.store(true);
    const int calls = std::min(count_, pool_.threads);
    pool_.run(pool_.user, static_cast<std::uint32_t>(calls), enter_from_pool, this);
    take_items(pool_.threads, progress_ != nullptr);
    open_.store(false);
    for (int left; (left = inside_.load()) != 0;) inside_.wait(left);
}

void Jobs::run_by_workers() {
    busy_.store(threads_ - 1, std::memory_order_relaxed);
    run_id_.fetch_add(1, std::memory_order_release);
    run_id_.notify_all();
    take_items(0, progress_ != nullptr);
    int spins = 0;
    for (int left; (left = busy_.load(std::memory_order_acquire)) != 0;) {
        if (++spins < kSpins)
            pause();
        else
            busy_.wait(left, std::memory_order_acquire);
    }
}

void Jobs::work(int worker) {
    std::uint32_t seen = 0;
    for (;;) {
        int spins = 0;
        while (run_id_.load(std::memory_order_acquire) == seen) {
            if (++spins < kSpins)
                pause();
            else
                run_id_.wait(seen, std::memory_order_acquire);
        }
        ++seen;  // never more than one run ahead: a run ends only when every worker has reported
        if (stop_.load()) return;
        take_items(worker, false);
        if (busy_.fetch_sub(1, std::memory_order_acq_rel) == 1) busy_.notify_one();
    }
}

}  // namespace burin
