// SPDX-License-Identifier: MIT
// Handles with generations for the small objects of capture.h: a stale handle is recognised.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>

namespace burin {

template <class Object, std::uint32_t kPlaces>
class HandleTable {
  public:
    static constexpr std::uint32_t places = kPlaces;

    // Handle is a struct of index and generation. False: all places are taken.
    template <class Handle>
    bool add(Object* object, Handle* handle) {
        const std::lock_guard lock(mutex_);
        for (std::uint32_t i = 0; i < kPlaces; ++i) {
            if (places_[i].object.load()) continue;
            places_[i].object.store(object);
            *handle = {i + 1, ++places_[i].generation};
            return true;
        }
        return false;
    }
    template <class Handle>
    void remove(Handle handle) {
        const std::lock_guard lock(mutex_);
        Place& place = places_[handle.index - 1];
        ++place.generation;
        place.object.store(nullptr);
    }
    // Null when the handle is null, stale or was never given out.
    template <class Handle>
    Object* find(Handle handle) const {
        if (handle.index == 0 || handle.index > kPlaces) return nullptr;
        const Place& place = places_[handle.index - 1];
        return place.generation.load() == handle.generation ? place.object.load() : nullptr;
    }

  private:
    struct Place {
        std::atomic<Object*> object{nullptr};
        std::atomic<std::uint32_t> generation{0};  // odd while in use
    };
    Place places_[kPlaces];
    std::mutex mutex_;
};

}  // namespace burin
