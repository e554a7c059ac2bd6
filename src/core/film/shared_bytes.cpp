#include "core/film/shared_bytes.h"

#include "core/util/memory.h"

#include <algorithm>

namespace strobe {

SharedBytes::SharedBytes(std::string bytes) {
    const auto owner = std::make_shared<const std::string>(std::move(bytes));
    m_first = std::shared_ptr<const char>(owner, owner->data());
    m_size = owner->size();
}

std::shared_ptr<char> ByteArena::allocate(size_t size) {
    constexpr size_t kFirstBlock = 64 << 10, kLargestBlock = 4 << 20;
    size = (size + kAlignment - 1) / kAlignment * kAlignment;
    const std::lock_guard lock(m_mutex);
    if (m_size - m_used < size) {
        m_size = std::max(std::clamp(2 * m_size, kFirstBlock, kLargestBlock), size);
        m_used = 0;
        HugePageAllocator<char> allocator;
        m_block = std::shared_ptr<char>(allocator.allocate(m_size), [bytes = m_size](char* block) {
            HugePageAllocator<char>().deallocate(block, bytes);
        });
    }
    m_used += size;
    return {m_block, m_block.get() + m_used - size};
}

void ByteArena::release() {
    const std::lock_guard lock(m_mutex);
    m_block.reset();
    m_size = m_used = 0;
}

} // namespace strobe
