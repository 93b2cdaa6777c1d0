// SPDX-License-Identifier: MIT
#include "map/chunk_reader.h"

#include <algorithm>
#include <cstring>

namespace burin {

void ChunkReader::place(Arena& arena, std::size_t chunk_bytes) {
    chunk_bytes_ = chunk_bytes;
    for (Page& page : pages_) page.bytes = arena.allocate<unsigned char>(chunk_bytes, 64);
}

Status ChunkReader::start() {
    if (running_) return {};
    const auto main = [](void* self) -> void* {
        static_cast<ChunkReader*>(self)->work();
        return nullptr;
    };
    if (const int error = ::pthread_create(&thread_, nullptr, main, this))
        return Status::error(Code::io, "store: the system gives no thread: %s", std::strerror(error));
    running_ = true;
    return {};
}

void ChunkReader::stop() {
    if (!running_) return;
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    asked_for_.notify_one();
    ::pthread_join(thread_, nullptr);
    running_ = false;
}

void ChunkReader::open(StoreIo* io) {
    const std::lock_guard lock(mutex_);
    io_ = io;
}

void ChunkReader::close() {
    std::unique_lock lock(mutex_);
    taken_ = asked_;
    done_.wait(lock, [&] { return !running_ || read_ == asked_; });
    io_ = nullptr;
}

bool ChunkReader::ask(std::uint64_t at) {
    {
        const std::lock_guard lock(mutex_);
        // One page more is in use: the one that take() gave last.
        if (asked_ + 1 - std::min(taken_, read_) >= kPages) return false;
        Page& page = pages_[asked_++ % kPages];
        page.at = at;
        page.read = false;
    }
    asked_for_.notify_one();
    return true;
}

const void* ChunkReader::take(std::uint64_t at) {
    std::unique_lock lock(mutex_);
    std::uint64_t request = taken_;
    while (request < asked_ && pages_[request % kPages].at != at) ++request;
    if (request == asked_) return nullptr;
    done_.wait(lock, [&] { return read_ > request; });
    taken_ = request + 1;
    const Page& page = pages_[request % kPages];
    return page.read ? page.bytes : nullptr;
}

void ChunkReader::give_up() {
    const std::lock_guard lock(mutex_);
    taken_ = asked_;
}

void ChunkReader::work() {
    std::unique_lock lock(mutex_);
    for (;;) {
        asked_for_.wait(lock, [&] { return stop_ || read_ != asked_; });
        if (stop_) return;
        Page& page = pages_[read_ % kPages];
        if (read_ >= taken_) {
            StoreIo* io = io_;
            lock.unlock();
            const bool read = read_all(*io, page.at, page.bytes, chunk_bytes_) == 0;
            lock.lock();
            page.read = read;
        }
        ++read_;
        done_.notify_all();
    }
}

}  // namespace burin
