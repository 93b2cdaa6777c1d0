// SPDX-License-Identifier: MIT
#include "core/jobs.h"

#include <algorithm>

namespace burin {
namespace {

// A frame has several parallel stages a few hundred microseconds apart; sleeping in the kernel between them
// costs 50 us each way, so a waiting thread first spins for about 20 us.
constexpr int kSpins = 2000;
constexpr int kNoWorker = -1;

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

// Takes part in the run under way, unless it is over: a worker, or with kNoWorker a call of the pool.
// Sequentially consistent, as in end_run: either this thread sees that the run is over, or the run waits for
// it.
void Jobs::enter(int worker) {
    inside_.fetch_add(1);
    const std::uint32_t open = open_.load();
    if (worker != kNoWorker && open == kToWorkers) {
        take_items(worker, false);
    } else if (worker == kNoWorker && open == kToPool) {
        const int ticket = tickets_.fetch_add(1);
        if (ticket < pool_.threads) take_items(ticket, progress_ != nullptr);
    }
    if (inside_.fetch_sub(1) == 1) inside_.notify_all();
}

// Nobody enters any more; returns when all have left.
void Jobs::end_run() {
    open_.store(kClosed);
    int spins = 0;
    for (int left; (left = inside_.load()) != 0;) {
        if (++spins < kSpins)
            pause();
        else
            inside_.wait(left);
    }
}

void Jobs::enter_from_pool(void* self, std::uint32_t) { static_cast<Jobs*>(self)->enter(kNoWorker); }

void Jobs::run_by_pool() {
    tickets_.store(0);
    open_.store(kToPool);
    const int calls = std::min(count_, pool_.threads);
    pool_.run(pool_.user, static_cast<std::uint32_t>(calls), enter_from_pool, this);
    take_items(pool_.threads, progress_ != nullptr);
    end_run();
}

void Jobs::run_by_workers() {
    open_.store(kToWorkers);
    run_id_.fetch_add(1, std::memory_order_release);
    run_id_.notify_all();
    take_items(0, progress_ != nullptr);
    end_run();
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
        // A worker that was at something else may have missed runs: those ended without it.
        seen = run_id_.load(std::memory_order_acquire);
        if (stop_.load()) return;
        enter(worker);
        take_behind();
    }
}

void Jobs::offer_behind() {
    behind_.store(kOffered);
    if (threads_ == 1 || pool_.run) return;
    run_id_.fetch_add(1, std::memory_order_release);
    run_id_.notify_all();
}

void Jobs::take_behind() {
    std::uint32_t offered = kOffered;
    if (!behind_.compare_exchange_strong(offered, kTaken)) return;
    behind_function_(behind_context_);
    behind_.store(kDone);
    behind_.notify_all();
}

void Jobs::finish_behind() {
    take_behind();
    int spins = 0;
    while (behind_.load() == kTaken) {
        if (++spins < kSpins)
            pause();
        else
            behind_.wait(kTaken);
    }
    behind_.store(kNone);
}

}  // namespace burin
