// SPDX-License-Identifier: MIT
#include "api/handles.h"

#include <mutex>

namespace burin {
namespace {

constexpr std::uint32_t kMaxMaps = 64;

struct Place {
    std::atomic<MapState*> state{nullptr};
    std::atomic<std::uint32_t> generation{0};  // odd while in use
};
Place places[kMaxMaps];
std::mutex registering;

}  // namespace

burin_map register_map(MapState* state) {
    const std::lock_guard lock(registering);
    for (std::uint32_t i = 0; i < kMaxMaps; ++i) {
        if (places[i].state.load() != nullptr) continue;
        places[i].state.store(state);
        return {i + 1, ++places[i].generation};
    }
    return {0, 0};
}

MapState* state_of(burin_map map) {
    if (map.index == 0 || map.index > kMaxMaps) return nullptr;
    const Place& place = places[map.index - 1];
    return place.generation.load() == map.generation ? place.state.load() : nullptr;
}

void unregister_map(burin_map map) {
    const std::lock_guard lock(registering);
    Place& place = places[map.index - 1];
    ++place.generation;
    place.state.store(nullptr);
}

char* thread_error() {
    static thread_local char text[512] = "";
    return text;
}

}  // namespace burin
