// SPDX-License-Identifier: MIT
// Writes groups of the store on a thread of its own, through a ring of buffers in the map's memory. What has
// not reached the file, or never will because the disk is full, can be read from the buffers.
#pragma once

#include <pthread.h>

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>

#include "core/arena.h"
#include "map/store_file.h"

namespace burin {

class GroupWriter {
  public:
    GroupWriter() = default;
    ~GroupWriter() { stop(); }
    GroupWriter(const GroupWriter&) = delete;
    GroupWriter& operator=(const GroupWriter&) = delete;

    void place(Arena& arena, bool colour);
    Status start();  // the thread; its stack is not in the budget
    void stop();     // waits for what is queued unless the disk refuses it

    void open(StoreIo* io, const StoreTail& tail);
    void close();  // forgets what is not written

    // Room for one more chunk in the group being filled? Waits while the disk is behind; false when it
    // refuses.
    bool ready();
    // Copies the chunk into the group being filled (ready() was true) and tells where it will lie.
    std::uint64_t append(const StoreRecord& record, const ChunkGeometry& geometry, const ChunkColour* colour);
    // The chunk at this offset when a buffer still has it, else null.
    const void* buffered(std::uint64_t at) const;

    // The next group forgets everything before it, also what was appended but not handed over.
    void forget();
    // Hands over what there is, waits, syncs, writes the mark, syncs. An errno.
    int commit(std::uint64_t frames, std::uint64_t map_chunks);

    // What the disk refused last (an errno), 0 while all is well. retry(): try again, without waiting.
    int error() const { return error_.load(); }
    void retry();

    std::uint64_t end() const { return tail_.end; }
    void* scratch() { return buffers_[0].head; }  // one group; only while closed

  private:
    // Group buffers: one being filled, one being written, one between them for when chunks come in bursts.
    static constexpr int kBuffers = 3;
    struct Buffer {
        GroupHead* head = nullptr;
        std::uint64_t at = 0;  // in the file, once it is being filled
        std::uint32_t chunks = 0;
        unsigned char* bytes() const { return reinterpret_cast<unsigned char*>(head + 1); }
    };
    void hand_over();
    bool wait_for_room(std::unique_lock<std::mutex>& lock);
    void begin_group();
    int drain(std::unique_lock<std::mutex>& lock);
    void work();

    Buffer buffers_[kBuffers];
    bool colour_ = false, filling_ = false, forget_ = false;
    StoreIo* io_ = nullptr;
    StoreTail tail_;

    // Groups are filled and written in turn: group n lies in buffer n % kBuffers.
    std::uint64_t filled_ = 0;  // groups handed over
    std::mutex mutex_;
    std::condition_variable work_, done_;
    std::uint64_t queued_ = 0, written_ = 0;  // under the mutex
    bool again_ = false, stop_ = false, running_ = false;
    bool lost_ =
        false;  // a sync failed: what was written before may be gone, so that no later one means anything
    std::atomic<int> error_{0};
    pthread_t thread_{};
};

}  // namespace burin
