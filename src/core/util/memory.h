// Operating system interfaces for large memory allocations.
#pragma once

#include "core/math/api.h"

#include <cstddef>
#include <cstdint>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace STROBE_API strobe {

/// Requests transparent huge pages for an allocation that was not written to yet, which reduces the page
/// faults of its first writes by a factor of 100. This is a hint; it has no effect on systems other than
/// Linux, or on allocations smaller than a huge page (2 MiB).
void adviseHugePages(void* allocation, size_t bytes);

/// Returns memory that consists of whole huge pages, as far as adviseHugePages has an effect. Throws
/// std::bad_alloc.
void* allocateHugePages(size_t bytes);
/// Returns the memory that allocateHugePages returned for this size to the operating system.
void freeHugePages(void* allocation, size_t bytes);

/// Allocates huge pages for an eighth of a huge page and more, so that first writes cause few page faults. In
/// virtual machines, a page fault takes up to ten microseconds.
template <class T>
struct HugePageAllocator {
    using value_type = T;
    static_assert(alignof(T) <= __STDCPP_DEFAULT_NEW_ALIGNMENT__);

    HugePageAllocator() = default;
    template <class U>
    HugePageAllocator(const HugePageAllocator<U>&) {}

    T* allocate(size_t count) {
        const size_t bytes = count * sizeof(T);
        return static_cast<T*>(isHuge(bytes) ? allocateHugePages(bytes) : ::operator new(bytes));
    }
    void deallocate(T* allocation, size_t count) {
        if (isHuge(count * sizeof(T)))
            freeHugePages(allocation, count * sizeof(T));
        else
            ::operator delete(allocation);
    }
    bool operator==(const HugePageAllocator&) const { return true; }

  private:
    static constexpr size_t kLeastHuge = 256 << 10;
    static bool isHuge(size_t bytes) { return bytes >= kLeastHuge; }
};

/// An array that may be large, and is written soon after it is allocated.
template <class T>
using HugeVector = std::vector<T, HugePageAllocator<T>>;

/// A HugePageAllocator that does not initialize items which are created without a value.
template <class T>
struct BufferAllocator : HugePageAllocator<T> {
    static_assert(std::is_trivially_destructible_v<T>);
    template <class U>
    struct rebind {
        using other = BufferAllocator<U>;
    };
    BufferAllocator() = default;
    template <class U>
    BufferAllocator(const BufferAllocator<U>&) {}
    template <class U, class... Values>
    void construct(U* item, Values&&... values) {
        if constexpr (sizeof...(Values) > 0)
            ::new (static_cast<void*>(item)) U(std::forward<Values>(values)...);
    }
};

/// A HugeVector whose items are undefined until they are set.
template <class T>
using HugeBuffer = std::vector<T, BufferAllocator<T>>;

/// Returns freed memory to the operating system. Without it, the heaps of many threads retain freed memory,
/// which becomes fragmented and is reused less and less. Takes milliseconds. No effect without glibc.
void releaseFreeMemory();

/// Returns the bytes of the machine's memory.
uint64_t physicalMemory();
/// Returns the bytes of memory that the process has now; 0 if they are unknown.
uint64_t usedMemory();

} // namespace strobe
