// SPDX-License-Identifier: MIT
#include "map/group_writer.h"

#include <cerrno>
#include <cstring>

namespace burin {

void GroupWriter::place(Arena& arena, bool colour) {
    colour_ = colour;
    for (Buffer& buffer : buffers_) {
        auto* memory = arena.allocate<unsigned char>(group_bytes(kGroupChunks, colour), 64);
        buffer.head = static_cast<GroupHead*>(static_cast<void*>(memory));
    }
}

Status GroupWriter::start() {
    if (running_) return {};
    const auto main = [](void* self) -> void* {
        static_cast<GroupWriter*>(self)->work();
        return nullptr;
    };
    if (const int error = ::pthread_create(&thread_, nullptr, main, this))
        return Status::error(Code::io, "store: the system gives no thread: %s", std::strerror(error));
    running_ = true;
    return {};
}

void GroupWriter::stop() {
    if (!running_) return;
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    work_.notify_all();
    ::pthread_join(thread_, nullptr);
    running_ = false;
}

void GroupWriter::open(StoreIo* io, const StoreTail& tail) {
    const std::lock_guard lock(mutex_);
    io_ = io;
    tail_ = tail;
    filled_ = queued_ = written_ = 0;
    filling_ = forget_ = again_ = lost_ = false;
    error_.store(0);
    for (Buffer& buffer : buffers_) buffer.at = buffer.chunks = 0;
}

void GroupWriter::close() {
    std::unique_lock lock(mutex_);
    if (!io_) return;
    drain(lock);
    queued_ = written_;  // what the disk refused is given up
    io_ = nullptr;
}

// Waits until all that is queued is written, or the disk refuses.
int GroupWriter::drain(std::unique_lock<std::mutex>& lock) {
    done_.wait(lock, [&] { return written_ == queued_ || (error_.load() != 0 && !again_); });
    return written_ == queued_ ? 0 : error_.load();
}

bool GroupWriter::wait_for_room(std::unique_lock<std::mutex>& lock) {
    done_.wait(lock, [&] { return filled_ - written_ < kBuffers || (error_.load() != 0 && !again_); });
    return filled_ - written_ < kBuffers;
}

void GroupWriter::begin_group() {
    Buffer& buffer = buffers_[filled_ % kBuffers];
    std::memset(static_cast<void*>(buffer.head), 0, sizeof(GroupHead));
    buffer.at = tail_.end;
    buffer.chunks = 0;
    filling_ = true;
}

bool GroupWriter::ready() {
    if (filling_ && buffers_[filled_ % kBuffers].chunks < kGroupChunks) return true;
    if (filling_) hand_over();
    std::unique_lock lock(mutex_);
    if (!wait_for_room(lock)) return false;
    begin_group();
    return true;
}

std::uint64_t GroupWriter::append(const StoreRecord& record, const ChunkGeometry& geometry,
                                  const ChunkColour* colour) {
    Buffer& buffer = buffers_[filled_ % kBuffers];
    const std::size_t at = buffer.chunks * store_chunk_bytes(colour_);
    buffer.head->records[buffer.chunks++] = record;
    std::memcpy(buffer.bytes() + at, &geometry, sizeof geometry);
    if (colour) std::memcpy(buffer.bytes() + at + sizeof geometry, colour, sizeof *colour);
    return buffer.at + kStorePage + at;
}

const void* GroupWriter::buffered(std::uint64_t at) const {
    for (const Buffer& buffer : buffers_) {
        const std::uint64_t first = buffer.at + kStorePage;
        if (buffer.at != 0 && at >= first && at < first + buffer.chunks * store_chunk_bytes(colour_))
            return buffer.bytes() + (at - first);
    }
    return nullptr;
}

// Seals the group being filled and queues it.
void GroupWriter::hand_over() {
    Buffer& buffer = buffers_[filled_ % kBuffers];
    buffer.head->chunks = buffer.chunks;
    buffer.head->forget = forget_;
    forget_ = false;
    const std::size_t used = kStorePage + buffer.chunks * store_chunk_bytes(colour_);
    std::memset(reinterpret_cast<unsigned char*>(buffer.head) + used, 0,
                group_bytes(buffer.chunks, colour_) - used);
    seal_group(buffer.head, colour_, &tail_);
    filling_ = false;
    ++filled_;
    {
        const std::lock_guard lock(mutex_);
        queued_ = filled_;
    }
    work_.notify_one();
}

void GroupWriter::forget() {
    forget_ = true;
    if (filling_) buffers_[filled_ % kBuffers].chunks = 0;
    filling_ = false;
}

int GroupWriter::commit(std::uint64_t frames, std::uint64_t map_chunks) {
    retry();
    if (filling_ && buffers_[filled_ % kBuffers].chunks > 0) hand_over();
    std::unique_lock lock(mutex_);
    if (const int error = drain(lock)) return error;
    if (!filling_) begin_group();
    lock.unlock();
    GroupHead* mark = buffers_[filled_ % kBuffers].head;
    mark->commit = 1;
    mark->frames = frames;
    mark->map_chunks = map_chunks;
    hand_over();
    lock.lock();
    return drain(lock);
}

void GroupWriter::retry() {
    {
        const std::lock_guard lock(mutex_);
        if (error_.load() == 0 || lost_) return;
        again_ = true;
    }
    work_.notify_one();
}

void GroupWriter::work() {
    std::unique_lock lock(mutex_);
    for (;;) {
        work_.wait(lock, [&] { return stop_ || (written_ != queued_ && (error_.load() == 0 || again_)); });
        if (written_ == queued_ || (error_.load() != 0 && !again_))
            return;  // told to stop, and nothing can be done
        const Buffer& buffer = buffers_[written_ % kBuffers];
        StoreIo* io = io_;
        lock.unlock();
        const std::size_t bytes = group_bytes(buffer.head->chunks, colour_);
        // Before its mark everything must be on the disk, and a commit is one only when its mark is.
        int error = buffer.head->commit ? -io->sync() : 0;
        bool lost = error != 0;
        if (!error) error = write_all(*io, buffer.at, buffer.head, bytes);
        if (!error && buffer.head->commit) {
            error = -io->sync();
            lost = error != 0;
        }
        lock.lock();
        lost_ |= lost;
        again_ = false;
        error_.store(error);
        if (!error) ++written_;
        done_.notify_all();
    }
}

}  // namespace burin
