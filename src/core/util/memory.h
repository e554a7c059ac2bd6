// Operating system interfaces for large memory allocations.
#pragma once

#include "core/math/api.h"

#include <cstddef>
#include <cstdint>

namespace STROBE_API strobe {

/// Requests transparent huge pages for an allocation that was not written to yet, which reduces the page
/// faults of its first writes by a factor of 100. This is a hint; it has no effect on systems other than
/// Linux, or on allocations smaller than a huge page (2 MiB).
void adviseHugePages(void* allocation, size_t bytes);

/// Returns freed memory to the operating system. Without it, the heaps of many threads retain freed memory,
/// which becomes fragmented and is reused less and less. Takes milliseconds. No effect without glibc.
void releaseFreeMemory();

/// Returns the bytes of the machine's memory.
uint64_t physicalMemory();
/// Returns the bytes of memory that the process has now; 0 if they are unknown.
uint64_t usedMemory();

} // namespace strobe
