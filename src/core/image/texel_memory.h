// The memory of texels: in the heap, or in pages of a temporary file of which few are kept in memory.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace strobe {

class TexelMemory;

/// Counts of the pages of textures that are not kept in memory.
struct PageCounts {
    uint64_t bytesInFiles = 0;   ///< of all textures in temporary files
    uint64_t bytesRead = 0;      ///< pages that lookups brought into memory
    uint64_t bytesReadAgain = 0; ///< of these, pages that had been in memory before
};

/// Keeps the pages of temporary files within a memory limit. A page that was dropped is read again by the
/// system when it is used, so lookups need no locks, and values do not depend on the limit. Thread-safe.
class TexelPager {
  public:
    /// `limit`: bytes of pages to keep in memory.
    explicit TexelPager(uint64_t limit) : m_limit(limit) {}
    TexelPager(const TexelPager&) = delete;
    TexelPager& operator=(const TexelPager&) = delete;

    void setLimit(uint64_t limit) { m_limit.store(limit, std::memory_order_relaxed); }
    PageCounts counts() const;

  private:
    friend class TexelMemory;
    void add(TexelMemory& memory);
    void remove(TexelMemory& memory);
    /// Counts a page that enters the memory, and drops others beyond the limit.
    void count(bool isReadAgain);
    /// Drops pages that were not used since the previous round (the clock algorithm).
    void drop();

    std::atomic<uint64_t> m_limit;
    std::atomic<uint64_t> m_resident{0}, m_read{0}, m_readAgain{0};
    mutable std::mutex m_mutex; ///< for the members below
    uint64_t m_bytesInFiles = 0;
    std::vector<TexelMemory*> m_memories;
    size_t m_handMemory = 0, m_handPage = 0; ///< the clock's hand
};

/// A block of memory for the texels of an image.
class TexelMemory {
  public:
    static constexpr size_t kPageBytes = 1 << 16; ///< the system reads so much at once

    /// Allocates `bytes` in the heap.
    explicit TexelMemory(size_t bytes);
    /// Allocates `bytes` in a deleted file of the folder for temporary files (TMPDIR, or /var/tmp). `pager`
    /// must outlive the memory. Throws Error of kind Output that names `item` if there is no space.
    TexelMemory(size_t bytes, TexelPager& pager, const std::string& item);
    ~TexelMemory();
    TexelMemory(const TexelMemory&) = delete;
    TexelMemory& operator=(const TexelMemory&) = delete;

    std::byte* data() { return m_data; }
    const std::byte* data() const { return m_data; }
    size_t size() const { return m_bytes; }
    bool isInFile() const { return m_pager != nullptr; }

    /// Marks the page of a byte as used. To be called before the byte is read. Precondition: isInFile().
    void touch(size_t byte) const {
        std::atomic<uint8_t>& state = m_states[byte / kPageBytes];
        if ((state.load(std::memory_order_relaxed) & kRecency) != kRecent)
            enter(state);
    }
    /// Drops all pages from memory, after the texels were written.
    void dropAll();

  private:
    friend class TexelPager;
    /// States of a page: its recency, and a bit that is set when it was in memory before.
    enum : uint8_t { kAbsent = 0, kAged = 1, kRecent = 2, kRecency = 3, kWasResident = 4 };
    size_t pages() const { return (m_bytes + kPageBytes - 1) / kPageBytes; }
    void enter(std::atomic<uint8_t>& state) const;
    /// Removes a page from memory. Its values stay in the file.
    void dropPages(size_t first, size_t count);

    std::byte* m_data = nullptr;
    size_t m_bytes = 0;
    std::unique_ptr<std::byte[]> m_heap;                      ///< or null
    void* m_mapping = nullptr;                                ///< of a file, with the space to align m_data
    TexelPager* m_pager = nullptr;                            ///< null: in the heap
    mutable std::unique_ptr<std::atomic<uint8_t>[]> m_states; ///< by page
};

} // namespace strobe
