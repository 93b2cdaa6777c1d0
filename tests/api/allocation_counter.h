// SPDX-License-Identifier: MIT
// Counts allocations of the whole process: malloc and its kin, operator new (which calls malloc) and mmap.
// For one source file of a test program. Without glibc or under a sanitizer BURIN_COUNT_ALLOCATIONS is not
// defined.
#pragma once

#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define BURIN_COUNT_ALLOCATIONS 1
namespace {
std::atomic<long> allocations{0};
}
// Visible to the shared libraries too: operator new calls malloc from within one.
#pragma GCC visibility push(default)
extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
void* malloc(size_t bytes) {
    ++allocations;
    return __libc_malloc(bytes);
}
void* calloc(size_t count, size_t bytes) {
    ++allocations;
    return __libc_calloc(count, bytes);
}
void* realloc(void* p, size_t bytes) {
    ++allocations;
    return __libc_realloc(p, bytes);
}
void* memalign(size_t alignment, size_t bytes) {
    ++allocations;
    return __libc_memalign(alignment, bytes);
}
void* aligned_alloc(size_t alignment, size_t bytes) {
    ++allocations;
    return __libc_memalign(alignment, bytes);
}
int posix_memalign(void** p, size_t alignment, size_t bytes) {
    ++allocations;
    *p = __libc_memalign(alignment, bytes);
    return *p ? 0 : ENOMEM;
}
void* mmap(void* at, size_t bytes, int protection, int flags, int fd, off_t offset) {
    ++allocations;
#ifdef SYS_mmap
    return reinterpret_cast<void*>(syscall(SYS_mmap, at, bytes, protection, flags, fd, offset));
#else  // 32-bit ARM has the other, which counts the offset in pages of 4096 bytes
    return reinterpret_cast<void*>(syscall(SYS_mmap2, at, bytes, protection, flags, fd, offset / 4096));
#endif
}
}
#pragma GCC visibility pop
#endif

// It takes the place of operator new, which then calls no malloc (./dev valgrind leaves the one here alone).
inline bool under_valgrind() {
    const char* preload = std::getenv("LD_PRELOAD");
    return preload && std::strstr(preload, "vgpreload");
}
