// SPDX-License-Identifier: MIT
// The C boundary of the runtime: the store.
#include <cstring>

#include "api/call.h"
#include "api/config.h"
#include "burin/burin.h"

using namespace burin;

extern "C" {

burin_status burin_store_open(burin_map map, const char* path, uint32_t mode) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!path) return null_argument("path");
        if (mode > BURIN_STORE_RESUME)
            return Status::error(Code::invalid_argument, "store mode is %u, expected 0 or 1", mode);
        if (state.config.store_chunks == 0)
            return Status::error(
                Code::state, "%s: the configuration's store_chunks is 0, expected room for a store", path);
        if (state.session.store().is_open())
            return Status::error(Code::state, "%s: the map has a store already", path);
        if (mode == BURIN_STORE_RESUME) return state.session.resume_store(path);
        StoreHead head = {};
        static_assert(sizeof state.config <= sizeof head.config);
        head.config_bytes = sizeof state.config;
        std::memcpy(head.config, &state.config, sizeof state.config);
        return state.session.open_store(path, head);
    });
}

burin_status burin_store_commit(burin_map map) {
    return Call(map).run([&](MapState& state) -> Status { return state.session.commit_store(); });
}

burin_status burin_chunks(burin_map map, burin_chunk_key* keys, uint64_t capacity, uint64_t* count) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!count) return null_argument("count");
        if (!keys && capacity > 0) return null_argument("keys");
        *count = state.session.all_chunks(
            [&](std::uint64_t i, Vec3i c) {
                keys[i] = {c.x, c.y, c.z};
            },
            capacity);
        if (*count <= capacity) return {};
        return Status::error(Code::insufficient_memory, "room for %llu keys, %llu are needed",
                             static_cast<unsigned long long>(capacity),
                             static_cast<unsigned long long>(*count));
    });
}

}  // extern "C"
