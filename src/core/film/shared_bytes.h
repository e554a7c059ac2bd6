// Bytes that several owners share, and memory for many of them.
#pragma once

#include "core/math/api.h"

#include <memory>
#include <string>
#include <string_view>

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

/// Allocates bytes from blocks of memory, which grow to several huge pages. A block is freed with the last
/// owner of bytes in it.
class ByteArena {
  public:
    /// Returns uninitialized bytes.
    std::shared_ptr<char> allocate(size_t size);

  private:
    std::shared_ptr<char> m_block;
    size_t m_size = 0, m_used = 0; ///< of the block
};

} // namespace strobe
