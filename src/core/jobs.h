// SPDX-License-Identifier: MIT
// A fixed pool of worker threads. Work is split into items by index; which thread runs an item is left to
// chance, so an item may only write what belongs to its own index. Results then do not depend on the number
// of threads.
#pragma once

#include <pthread.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>

#include "core/progress.h"

namespace burin {

inline constexpr int kMaxThreads = 64;

// Threads of the application instead of our own. run() must call body(context, i) once for each i of
// 0..count-1, on any threads, in any order, at most `threads` at a time, and return when all calls have
// returned. What it leaves undone is done by the thread that asked, and calls that come too late find nothing
// to do.
struct JobPool {
    using Body = void (*)(void* context, std::uint32_t index);
    int (*run)(void* user, std::uint32_t count, Body body, void* context) = nullptr;
    void* user = nullptr;
    int threads = 1;
};

class Jobs {
  public:
    // threads counts the calling thread: 1 starts none. Clamped to 1..kMaxThreads. Where the system refuses a
    // thread, the pool makes do with those it got: results do not depend on their number. (std::thread would
    // throw.)
    explicit Jobs(int threads);
    ~Jobs();
    Jobs(const Jobs&) = delete;
    Jobs& operator=(const Jobs&) = delete;

    int threads() const { return pool_.run ? pool_.threads + 1 : threads_; }

    // Not during a run. A pool without a function: our own threads again.
    void set_pool(const JobPool& pool) { pool_ = pool; }

    // Every run until watch(nullptr) is a stage of this call: told as it goes, and when it is stopped the
    // items left and all later runs are skipped. Told by the calling thread, or with a pool by whichever
    // comes first.
    void watch(Progress* progress) { progress_ = progress; }
    // The results of runs since watch() are incomplete.
    bool stopped() const { return progress_ && progress_->stopped(); }

    // Calls body(item, worker) for every item in 0..count-1 and returns when all are done; worker is in
    // 0..threads()-1 and unique among the calls running at one time (for per-thread scratch). Allocates
    // nothing. One run at a time, not from within a body.
    template <class Body>
    void run(int count, Body&& body) {
        run_erased(
            count,
            [](void* context, int item, int worker) {
                (*static_cast<std::remove_reference_t<Body>*>(context))(item, worker);
            },
            const_cast<void*>(static_cast<const void*>(&body)));
    }

    // The same for many small pieces, `per_item` of them (>= 1) a step of the job counter: body(i) for every
    // i in 0..count-1.
    template <class Body>
    void run_pieces(std::size_t count, std::size_t per_item, Body&& body) {
        run(static_cast<int>((count + per_item - 1) / per_item), [&](int item, int) {
            const std::size_t first = static_cast<std::size_t>(item) * per_item;
            const std::size_t end = first + per_item < count ? first + per_item : count;
            for (std::size_t i = first; i < end; ++i) body(i);
        });
    }

    // One call of body() by a thread that has nothing else to do, while the calling thread goes on with runs
    // of its own: what is serial in those, or too short for all threads, then costs the others no time. Runs
    // do not wait for it, nor count on the thread that is at it. finish_behind() returns when it is done; the
    // calling thread does what no other has begun (always, with one thread or a pool). One at a time; `body`
    // must live until then, may not use these Jobs, and may write only what nothing reads or writes
    // meanwhile: then the result depends on no timing. Not watched.
    template <class Body>
    void start_behind(Body& body) {
        behind_function_ = [](void* context) { (*static_cast<Body*>(context))(); };
        behind_context_ = &body;
        offer_behind();
    }
    void finish_behind();

  private:
    using Function = void (*)(void* context, int item, int worker);
    void offer_behind();
    void take_behind();
    void enter(int worker);
    void end_run();
    void run_erased(int count, Function function, void* context);
    void run_alone();
    void run_by_workers();
    void run_by_pool();
    void take_items(int worker, bool tell);
    void work(int worker);
    static void enter_from_pool(void* jobs, std::uint32_t index);
    static void* start(void* worker);

    struct Worker {
        Jobs* jobs;
        int index;
        pthread_t thread;
    };
    int threads_;
    std::unique_ptr<Worker[]> workers_;
    Function function_ = nullptr;
    void* context_ = nullptr;
    int count_ = 0;
    std::atomic<int> next_{0};
    std::atomic<std::uint32_t> run_id_{0};  // counts what there is to do; workers sleep on it
    std::atomic<bool> stop_{false};

    Progress* progress_ = nullptr;
    JobPool pool_;
    enum Open : std::uint32_t { kClosed, kToWorkers, kToPool };
    std::atomic<std::uint32_t> open_{kClosed};  // a run is under way, and who may enter
    std::atomic<int> inside_{0};                // workers, or calls of the pool, that have not left it
    std::atomic<int> tickets_{0};               // of the calls that take part in this run

    enum Behind : std::uint32_t { kNone, kOffered, kTaken, kDone };
    std::atomic<std::uint32_t> behind_{kNone};
    void (*behind_function_)(void* context) = nullptr;
    void* behind_context_ = nullptr;
};

}  // namespace burin
