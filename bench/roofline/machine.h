// SPDX-License-Identifier: MIT
// The two ceilings of a machine, one thread: what its memory and what its arithmetic can do.
#pragma once

namespace burin::bench {

// Bytes read plus bytes written per second when an array far larger than the caches is changed in place, as
// integration changes the chunks of the map. The best of several passes over 256 MiB.
double inplace_bytes_per_second();

// Float multiplications plus additions per second in the widest vectors, apart from each other: the runtime
// contracts nothing (design, promise 3).
double float_operations_per_second();

// Reads through more memory than the caches hold, so that what comes next finds nothing in them.
void evict_caches();

}  // namespace burin::bench
