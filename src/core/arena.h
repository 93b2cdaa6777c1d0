// SPDX-License-Identifier: MIT
// A bump allocator over memory the caller owns. With null memory it only measures, so that one layout
// function both tells the size and places the parts: the two cannot disagree.
#pragma once

#include <cstddef>
#include <cstdint>

namespace burin {

class Arena {
  public:
    Arena() = default;  // measures
    Arena(void* memory, std::size_t bytes) : base_(static_cast<char*>(memory)), capacity_(bytes) {}

    bool measuring() const { return base_ == nullptr; }
    std::size_t used() const { return used_; }

    // `count` uninitialised T; null when measuring or when the arena is too small (then used() > capacity).
    // align: a power of two, at most the alignment of the arena's own memory for the result to be so aligned.
    template <class T>
    T* allocate(std::size_t count, std::size_t align = alignof(T)) {
        used_ = (used_ + align - 1) & ~(align - 1);
        const std::size_t at = used_;
        used_ += count * sizeof(T);
        if (measuring() || used_ > capacity_) return nullptr;
        return static_cast<T*>(static_cast<void*>(base_ + at));  // aligned by construction
    }

  private:
    char* base_ = nullptr;
    std::size_t capacity_ = 0;
    std::size_t used_ = 0;
};

}  // namespace burin
