// SPDX-License-Identifier: MIT
#include "api/source_handles.h"

#include <mutex>

namespace burin {
namespace {

struct Place {
    std::atomic<SourceObject*> object{nullptr};
    std::atomic<std::uint32_t> generation{0};  // odd while in use
};
Place places[kMaxSources];
std::mutex registering;

}  // namespace

bool register_source(SourceObject* object, burin_source* handle) {
    const std::lock_guard lock(registering);
    for (std::uint32_t i = 0; i < kMaxSources; ++i) {
        if (places[i].object.load()) continue;
        places[i].object.store(object);
        *handle = {i + 1, ++places[i].generation};
        return true;
    }
    return false;
}

void unregister_source(burin_source handle) {
    const std::lock_guard lock(registering);
    Place& place = places[handle.index - 1];
    ++place.generation;
    place.object.store(nullptr);
}

SourceObject* object_of(burin_source handle) {
    if (handle.index == 0 || handle.index > kMaxSources) return nullptr;
    const Place& place = places[handle.index - 1];
    return place.generation.load() == handle.generation ? place.object.load() : nullptr;
}

char* source_thread_error() {
    static thread_local char text[512] = "";
    return text;
}

}  // namespace burin
