// SPDX-License-Identifier: MIT
// A fixed pool of worker threads. Work is split into items by index; which thread runs an item is left to
// chance, so an item may only write what belongs to its own index. Results then do not depend on the number
// of threads.
#pragma once

#include <pthread.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <type_traits>

namespace burin {

inline constexpr int kMaxThreads = 64;

class Jobs {
  public:
    // threads counts the calling thread: 1 starts none. Clamped to 1..kMaxThreads. Where the system refuses a
    // thread, the pool makes do with those it got: results do not depend on their number. (std::thread would
    // throw.)
    explicit Jobs(int threads);
    ~Jobs();
    Jobs(const Jobs&) = delete;
    Jobs& operator=(const Jobs&) = delete;

    int threads() const { return threads_; }

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

  private:
    using Function = void (*)(void* context, int item, int worker);
    void run_erased(int count, Function function, void* context);
    void work(int worker);
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
    std::atomic<int> busy_{0};              // workers that have not finished the current run
    std::atomic<std::uint32_t> run_id_{0};  // counts runs; workers sleep on it
    std::atomic<bool> stop_{false};
};

}  // namespace burin
