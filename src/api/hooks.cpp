// SPDX-License-Identifier: MIT
// The C boundary of the runtime: the callbacks of an application.
#include <mutex>

#include "api/call.h"
#include "burin/burin.h"

using namespace burin;

namespace burin {
namespace {

std::mutex log_mutex;
burin_log log_callback = nullptr;
void* log_user = nullptr;

}  // namespace

void log_line(burin_log_level level, const char* line) {
    static thread_local bool logging = false;
    if (logging) return;
    burin_log callback;
    void* user;
    {
        const std::lock_guard lock(log_mutex);
        callback = log_callback;
        user = log_user;
    }
    if (!callback) return;
    logging = true;
    callback(user, level, line);
    logging = false;
}

}  // namespace burin

extern "C" {

void burin_set_log(burin_log log, void* user) {
    const std::lock_guard lock(log_mutex);
    log_callback = log;
    log_user = user;
}

burin_hooks burin_hooks_default(void) {
    burin_hooks hooks = {};
    hooks.struct_size = sizeof hooks;
    hooks.pool_threads = 1;
    return hooks;
}

burin_status burin_set_hooks(burin_map map, const burin_hooks* hooks) {
    return Call(map).run([&](MapState& state) -> Status {
        const burin_hooks wanted = hooks ? *hooks : burin_hooks_default();
        if (wanted.struct_size != sizeof wanted)
            return Status::error(Code::invalid_argument,
                                 "hooks: size %u, expected %zu (start from burin_hooks_default())",
                                 wanted.struct_size, sizeof wanted);
        if (wanted.pool_threads < 1 || wanted.pool_threads > kMaxThreads)
            return Status::error(Code::invalid_argument, "hooks: pool_threads is %u, expected 1 to %d",
                                 wanted.pool_threads, kMaxThreads);
        for (const std::uint64_t reserved : wanted.reserved)
            if (reserved != 0)
                return Status::error(Code::invalid_argument, "hooks: a reserved field is %llu, expected 0",
                                     static_cast<unsigned long long>(reserved));
        state.hooks = wanted;
        state.jobs.set_pool({wanted.run, wanted.user, static_cast<int>(wanted.pool_threads)});
        return {};
    });
}

}  // extern "C"
