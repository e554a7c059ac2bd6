// Operating system interfaces for large memory allocations.
#pragma once

#include "core/math/api.h"

#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

namespace STROBE_API strobe {

/// Requests transparent huge pages for an allocation that was not written to yet, which reduces the page
/// faults of its first writes by a factor of 100. This is a hint; it has no effect on systems other than
/// Linux, or on allocations smaller than a huge page (2 MiB).
void adviseHugePages(void* allocation, size_t bytes);

/// Allocates memory whose first writes cause few page faults: allocations of kHugePage / 2 bytes and more
/// consist of whole huge pages. In virtual machines, a page fault takes up to ten microseconds.
template <class T>
struct HugePageAllocator {
    using value_type = T;
    static constexpr size_t kHugePage = 2 << 20;

    HugePageAllocator() = default;
    template <class U>
    HugePageAllocator(const HugePageAllocator<U>&) {}

    T* allocate(size_t count) {
        const size_t bytes = count * sizeof(T);
        if (!isHuge(bytes))
            return static_cast<T*>(::operator new(bytes, std::align_val_t(alignof(T))));
        const size_t pages = (bytes + kHugePage - 1) / kHugePage * kHugePage;
        void* const allocation = ::operator new(pages, std::align_val_t(kHugePage));
        adviseHugePages(allocation, pages);
        return static_cast<T*>(allocation);
    }
    void deallocate(T* allocation, size_t count) {
        ::operator delete(allocation, std::align_val_t(isHuge(count * sizeof(T)) ? kHugePage : alignof(T)));
    }
    bool operator==(const HugePageAllocator&) const { return true; }

  private:
    static bool isHuge(size_t bytes) { return bytes >= kHugePage / 2; }
};

/// A large array that is written soon after it is allocated.
template <class T>
using HugeVector = std::vector<T, HugePageAllocator<T>>;

/// Returns freed memory to the operating system. Without it, the heaps of many threads retain freed memory,
/// which becomes fragmented and is reused less and less. Takes milliseconds. No effect without glibc.
void releaseFreeMemory();

/// Returns the bytes of the machine's memory.
uint64_t physicalMemory();
/// Returns the bytes of memory that the process has now; 0 if they are unknown.
uint64_t usedMemory();

} // namespace strobe
