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

MapFileHead head_of(const MapState& state) {
    MapFileHead head = {};
    head.frames = state.session.frames();
    head.config_bytes = sizeof state.config;
    static_assert(sizeof state.config <= sizeof head.config);
    std::memcpy(head.config, &state.config, sizeof state.config);
    head.cameras = state.session.cameras();
    return head;
}

// The outcome of a call that may have been stopped, which then has the words of Progress.
Status finished(Progress& progress, const Status& status) {
    return status.ok() || progress.stopped() ? progress.finish() : status;
}

constexpr const char* kStream = "map";  // the name of a callback's map in messages

struct CallbackWriter final : MapWriter {
    CallbackWriter(burin_write w, void* u) : callback(w), user(u) {}
    Status write(const void* data, std::size_t bytes) override {
        const int answer = callback(user, data, bytes);
        if (answer == 0) return {};
        return Status::error(Code::io, "the write callback failed with %d", answer);
    }
    burin_write callback;
    void* user;
};

struct CallbackReader final : MapReader {
    CallbackReader(burin_read r, void* u) : callback(r), user(u) {}
    Status read(void* to, std::size_t bytes) override {
        const int answer = callback(user, to, bytes);
        if (answer == 0) return {};
        return Status::error(Code::io, "the read callback failed with %d", answer);
    }
    burin_read callback;
    void* user;
};

Status read_head(MapReader& reader, MapFileHead* head) {
    unsigned char page[kMapFilePage];
    BURIN_TRY(reader.read(page, sizeof page));
    return parse_map_head(page, sizeof page, kAnyLength, kStream, head);
}

Status describe(const MapFileHead& head, const char* name, burin_file_info* info) {
    burin_file_info out = {};
    out.version = head.version;
    out.has_colour = head.has_colour;
    out.voxel_m = head.voxel_m;
    out.truncation_m = head.truncation_m;
    out.chunks = head.chunks;
    out.frames = head.frames;
    out.hash = head.map_hash;
    out.config = saved_config(head);
    const Status usable = check_config(out.config);
    if (!usable.ok())
        return Status::error(Code::format, "%s: saved with an impossible %s", name, usable.text());
    out.least_budget_bytes = map_bytes(options_of(out.config), std::max(head.chunks, kLeastCapacity));
    *info = out;
    return {};
}

}  // namespace

extern "C" {

burin_status burin_save(burin_map map, const char* path) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!path) return null_argument("path");
        Watch watch(state, 2);
        return finished(watch.progress, state.session.save(path, head_of(state), &watch.progress));
    });
}

burin_status burin_save_to(burin_map map, burin_write write, void* user) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!write) return null_argument("write");
        Watch watch(state, 2);
        CallbackWriter writer(write, user);
        return finished(watch.progress, state.session.save(writer, head_of(state), kStream, &watch.progress));
    });
}

burin_status burin_file_probe(const char* path, burin_file_info* info) {
    if (!path || !info) return report(thread_error(), null_argument(path ? "info" : "path"));
    MapFileHead head;
    Status status = read_map_head(path, &head);
    if (status.ok()) status = describe(head, path, info);
    return report(thread_error(), status);
}

burin_status burin_probe_from(burin_read read, void* user, burin_file_info* info) {
    if (!read || !info) return report(thread_error(), null_argument(read ? "info" : "read"));
    CallbackReader reader(read, user);
    MapFileHead head;
    Status status = read_head(reader, &head);
    if (status.ok()) status = describe(head, kStream, info);
    return report(thread_error(), status);
}

burin_status burin_load(burin_map map, const char* path) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!path) return null_argument("path");
        MapFileHead head;
        BURIN_TRY(read_map_head(path, &head));
        BURIN_TRY(check_fit(state, head, path));
        Watch watch(state, 1);
        return finished(watch.progress, state.session.load(path, head, &watch.progress));
    });
}

burin_status burin_load_from(burin_map map, burin_read read, void* user) {
    return Call(map).run([&](MapState& state) -> Status {
        if (!read) return null_argument("read");
        CallbackReader reader(read, user);
        MapFileHead head;
        BURIN_TRY(read_head(reader, &head));
        BURIN_TRY(check_fit(state, head, kStream));
        Watch watch(state, 1);
        return finished(watch.progress, state.session.load(reader, head, kStream, &watch.progress));
    });
}

}  // extern "C"
