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
    /// `first`: the address of `size` bytes, and a share of their memory.
    SharedBytes(std::shared_ptr<const char> first, size_t size) : m_first(std::move(first)), m_size(size) {}

    std::string_view view() const { return {m_first.get(), m_size}; }
    size_t size() const { return m_size; }

  private:
    std::shared_ptr<const char> m_first;
    size_t m_size = 0;
};

/// Allocates bytes one after the other from blocks of memory: the first is small, the others are huge pages.
/// A block is freed when none of its bytes are owned any more.
class ByteArena {
  public:
    std::shared_ptr<char> allocate(size_t size);

  private:
    std::shared_ptr<char> m_block;
    size_t m_size = 0, m_used = 0; ///< of the block
};

} // namespace strobe
