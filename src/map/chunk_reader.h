// SPDX-License-Identifier: MIT
// Reads chunks of the store on a thread of its own, ahead of whoever will ask for them, into a ring of pages
// in the map's memory.
#pragma once

#include <pthread.h>

#include <condition_variable>
#include <cstdint>
#include <mutex>

#include "core/arena.h"
#include "map/store_io.h"

namespace burin {

class ChunkReader {
  public:
    ChunkReader() = default;
    ~ChunkReader() { stop(); }
    ChunkReader(const ChunkReader&) = delete;
    ChunkReader& operator=(const ChunkReader&) = delete;

    void place(Arena& arena, std::size_t chunk_bytes);
    Status start();  // the thread, unless it runs; its stack is not in the budget
    void stop();

    void open(StoreIo* io);
    void close();  // waits for the read under way; the others are given up

    // The chunk at this offset will be wanted. False: all pages are taken; ask again after the next take().
    bool ask(std::uint64_t at);
    // The bytes of a chunk that was asked for, once they are there; what was asked for before it is given up.
    // Null: it was not asked for, or could not be read. Valid until the next take() or give_up().
    const void* take(std::uint64_t at);
    // Nothing of what was asked for is wanted any more.
    void give_up();

  private:
    static constexpr std::uint64_t kPages = 32;  // 128 KiB with colour: a few hundred microseconds of a disk
    struct Page {
        std::uint64_t at;
        unsigned char* bytes;
        bool read;
    };
    void work();

    std::size_t chunk_bytes_ = 0;
    StoreIo* io_ = nullptr;
    std::mutex
        mutex_;  // of all that follows, and of the pages' state; their bytes belong to whoever's turn it is
    std::condition_variable asked_for_, done_;
    Page pages_[kPages] = {};
    // Requests by number; request n has page n % kPages. Those before taken_ are given up or done with, those
    // before read_ are behind the thread.
    std::uint64_t asked_ = 0, read_ = 0, taken_ = 0;
    bool stop_ = false, running_ = false;
    pthread_t thread_{};
};

}  // namespace burin
