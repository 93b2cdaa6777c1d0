// SPDX-License-Identifier: MIT
// The C boundary of the runtime: map files.
#include <algorithm>
#include <cstring>

#include "api/call.h"
#include "api/config.h"
#include "burin/burin.h"

using namespace burin;

namespace {

burin_config saved_config(const MapFileHead& head) {
    burin_config config = burin_config_default();
    if (head.config_bytes == sizeof config) std::memcpy(&config, head.config, sizeof config);
    return config;
}

Status check_fit(const MapState& state, const MapFileHead& head, const char* path) {
    const VolumeShape& shape = state.session.volume().shape();
    if (head.voxel_m != shape.voxel_m || head.truncation_m != shape.truncation_m ||
        (head.has_colour != 0) != shape.colour)
        return Status::error(
            Code::invalid_argument,
            "%s: map of voxel %g m, truncation %g m, %s colour; this map has %g, %g, %s colour", path,
            static_cast<double>(head.voxel_m), static_cast<double>(head.truncation_m),
            head.has_colour ? "with" : "without", static_cast<double>(shape.voxel_m),
            static_cast<double>(shape.truncation_m), shape.colour ? "with" : "without");
    if (head.chunks > shape.capacity)
        return Status::error(Code::insufficient_memory,
                             "%s: %u chunks need a budget of %llu bytes, this map has %llu", path,
                             head.chunks,
                             static_cast<unsigned long long>(
                                 map_bytes(options_of(state.config), std::max(head.chunks, kLeastCapacity))),
                             static_cast<unsigned long long>(state.config.budget_bytes));
    return {};
}

}  // namespace

extern "C" {

burin_status burin_save(burin_map map, const char* path) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!path) return null_argument("path");
        MapFileHead head = {};
        head.frames = state.session.frames();
        head.config_bytes = sizeof state.config;
        static_assert(sizeof state.config <= sizeof head.config);
        std::memcpy(head.config, &state.config, sizeof state.config);
        return state.session.save(path, head);
    });
}

burin_status burin_file_probe(const char* path, burin_file_info* info) {
    if (!path || !info) return report(thread_error(), null_argument(path ? "info" : "path"));
    MapFileHead head;
    const Status status = read_map_head(path, &head);
    if (!status.ok()) return report(thread_error(), status);
    *info = {};
    info->version = head.version;
    info->has_colour = head.has_colour;
    info->voxel_m = head.voxel_m;
    info->truncation_m = head.truncation_m;
    info->chunks = head.chunks;
    info->frames = head.frames;
    info->hash = head.map_hash;
    info->config = saved_config(head);
    const Status usable = check_config(info->config);
    if (!usable.ok())
        return report(thread_error(),
                      Status::error(Code::format, "%s: saved with an impossible %s", path, usable.text()));
    info->least_budget_bytes = map_bytes(options_of(info->config), std::max(head.chunks, kLeastCapacity));
    return BURIN_OK;
}

burin_status burin_load(burin_map map, const char* path) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!path) return null_argument("path");
        MapFileHead head;
        BURIN_TRY(read_map_head(path, &head));
        BURIN_TRY(check_fit(state, head, path));
        return state.session.load(path, head);
    });
}

}  // extern "C"
