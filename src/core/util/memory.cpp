#include "core/util/memory.h"

#include <cstdint>
#include <fstream>

#include <sys/mman.h>
#include <unistd.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace strobe {

namespace {

constexpr size_t kHugePage = 2 << 20;

uintptr_t roundUp(uintptr_t x) { return (x + kHugePage - 1) & ~(kHugePage - 1); }

} // namespace

void adviseHugePages(void* allocation, size_t bytes) {
#if defined(__linux__)
    const uintptr_t start = reinterpret_cast<uintptr_t>(allocation);
    const uintptr_t first = roundUp(start), end = (start + bytes) & ~(kHugePage - 1);
    if (end > first)
        madvise(reinterpret_cast<void*>(first), end - first, MADV_HUGEPAGE);
#else
    static_cast<void>(allocation);
    static_cast<void>(bytes);
#endif
}

void* allocateHugePages(size_t bytes) {
    const size_t size = roundUp(bytes), mapped = size + kHugePage; // so that it contains aligned pages
    void* const map = mmap(nullptr, mapped, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (map == MAP_FAILED)
        throw std::bad_alloc();
    char* const start = static_cast<char*>(map);
    const size_t before = roundUp(reinterpret_cast<uintptr_t>(start)) - reinterpret_cast<uintptr_t>(start);
    if (before > 0)
        munmap(start, before);
    munmap(start + before + size, mapped - before - size);
    adviseHugePages(start + before, size);
    return start + before;
}

void freeHugePages(void* allocation, size_t bytes) { munmap(allocation, roundUp(bytes)); }

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
