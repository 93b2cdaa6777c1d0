// SPDX-License-Identifier: MIT
// What is plugged in, of include/burin/capture.h.
#include <cstdio>

#include "api/capture_backends.h"
#include "api/source_handles.h"
#include "burin/capture.h"

using namespace burin;

extern "C" {

uint32_t burin_backend_count(void) { return static_cast<uint32_t>(capture_backend_count()); }

burin_status burin_backend(uint32_t index, char* name, uint64_t name_bytes, char* about, uint64_t about_bytes,
                           char* problem, uint64_t problem_bytes) {
    if (index >= burin_backend_count())
        return tell(source_thread_error(),
                    Status::error(Code::invalid_argument, "back end %u, expected 0..%u", index,
                                  burin_backend_count() - 1));
    const SourceBackend& b = capture_backend(static_cast<int>(index));
    if (name && name_bytes > 0) std::snprintf(name, name_bytes, "%s", b.name);
    if (about && about_bytes > 0) std::snprintf(about, about_bytes, "%s", b.about);
    if (problem && problem_bytes > 0)
        std::snprintf(problem, problem_bytes, "%s", b.list([](void*, const DeviceEntry&) {}, nullptr).text());
    return BURIN_OK;
}

burin_status burin_devices(burin_device* devices, uint64_t capacity, uint64_t* count) {
    if (!count) return tell(source_thread_error(), null_argument("count"));
    if (!devices && capacity > 0) return tell(source_thread_error(), null_argument("devices"));
    struct Listing {
        burin_device* devices;
        uint64_t capacity, count;
        const char* backend;
    } listing = {devices, capacity, 0, nullptr};
    for (int i = 0; i < capture_backend_count(); ++i) {
        listing.backend = capture_backend(i).name;
        // What a back end cannot list is told by burin_backend.
        (void)capture_backend(i).list(
            [](void* user, const DeviceEntry& e) {
                auto* l = static_cast<Listing*>(user);
                if (l->count++ >= l->capacity) return;
                burin_device& d = l->devices[l->count - 1];
                std::snprintf(d.address, sizeof d.address, "%s:%s", l->backend, e.address);
                std::snprintf(d.name, sizeof d.name, "%s", e.name);
                std::snprintf(d.serial, sizeof d.serial, "%s", e.serial);
                std::snprintf(d.location, sizeof d.location, "%s", e.location);
                std::snprintf(d.driver, sizeof d.driver, "%s", e.driver);
                std::snprintf(d.formats, sizeof d.formats, "%s", e.formats);
                std::snprintf(d.hint, sizeof d.hint, "%s", e.hint);
                d.access = static_cast<uint32_t>(e.access);
            },
            &listing);
    }
    *count = listing.count;
    if (listing.count <= capacity) return BURIN_OK;
    return tell(source_thread_error(),
                Status::error(Code::insufficient_memory, "there are %llu devices, capacity is %llu",
                              static_cast<unsigned long long>(listing.count),
                              static_cast<unsigned long long>(capacity)));
}

}  // extern "C"
