// Bytes that several owners share, and memory for many of them.
#pragma once

#include "core/math/api.h"

#include <cstddef>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace STROBE_API strobe {

/// Bytes that do not change. Copies share them.
class SharedBytes {
  public:
    SharedBytes() = default;
    SharedBytes(std::string bytes); // implicit
    /// `first`: points to `size` bytes and shares the ownership of their memory.
    SharedBytes(std::shared_ptr<const char> first, size_t size) : m_first(std::move(first)), m_size(size) {}

    std::string_view view() const { return {m_first.get(), m_size}; }
    size_t size() const { return m_size; }

  private:
    std::shared_ptr<const char> m_first;
    size_t m_size = 0;
};

/// Items in memory that several owners share.
template <class T>
struct SharedItems {
    std::span<T> items;
    std::shared_ptr<const char> memory;
};

/// Allocates bytes from blocks of memory, which grow to several huge pages. A block is freed with the last
/// owner of bytes in it. All functions are thread-safe.
class ByteArena {
  public:
    /// Returns uninitialized bytes, aligned as by `new`.
    std::shared_ptr<char> allocate(size_t size);
    /// Returns copies of items. Their destructors are not called.
    template <class T>
    SharedItems<T> copy(const std::vector<T>& items) {
        static_assert(std::is_trivially_destructible_v<T> && alignof(T) <= kAlignment);
        std::shared_ptr<char> memory = allocate(items.size() * sizeof(T));
        T* const first = reinterpret_cast<T*>(memory.get());
        std::uninitialized_copy(items.begin(), items.end(), first);
        return {{first, items.size()}, std::move(memory)};
    }
    /// Releases the current block, which is then freed with the last owner of bytes in it. Further bytes are
    /// in another block.
    void release();

  private:
    static constexpr size_t kAlignment = __STDCPP_DEFAULT_NEW_ALIGNMENT__;
    std::mutex m_mutex;
    std::shared_ptr<char> m_block;
    size_t m_size = 0, m_used = 0; ///< of the block
};

} // namespace strobe
