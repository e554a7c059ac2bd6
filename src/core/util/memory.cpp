#include "core/util/memory.h"

#include <cstdint>

#if defined(__linux__)
#ifdef __GLIBC__
#include <fstream>
#include <malloc.h>
#include <unistd.h>
#endif
#include <sys/mman.h>
#endif

namespace strobe {

void adviseHugePages(void* allocation, size_t bytes) {
#if defined(__linux__)
    constexpr uintptr_t kPage = 2 << 20;
    const uintptr_t first = (reinterpret_cast<uintptr_t>(allocation) + kPage - 1) & ~(kPage - 1);
    const uintptr_t end = (reinterpret_cast<uintptr_t>(allocation) + bytes) & ~(kPage - 1);
    if (end > first)
        madvise(reinterpret_cast<void*>(first), end - first, MADV_HUGEPAGE);
#else
    static_cast<void>(allocation);
    static_cast<void>(bytes);
#endif
}

void releaseFreeMemory() {
#ifdef __GLIBC__
    malloc_trim(0);
#endif
}

uint64_t physicalMemory() { return uint64_t(sysconf(_SC_PHYS_PAGES)) * uint64_t(sysconf(_SC_PAGE_SIZE)); }

uint64_t usedMemory() {
    std::ifstream file("/proc/self/statm");
    uint64_t total = 0, resident = 0;
    return file >> total >> resident ? resident * uint64_t(sysconf(_SC_PAGE_SIZE)) : 0;
}

} // namespace strobe
