// A hash table of indices that is cleared in constant time.
#pragma once

#include "core/util/memory.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace strobe {

/// Maps 64-bit keys, which are hashes, to indices. It grows with its contents only, so that small ones stay
/// in the first-level cache.
class IndexTable {
  public:
    /// `expected`: a number of keys for which the table has space already.
    explicit IndexTable(size_t expected = 32) : m_slots(std::bit_ceil(2 * std::max<size_t>(expected, 1))) {}
    void clear() {
        m_used = 0;
        if (++m_epoch == 0) {
            m_slots.assign(m_slots.size(), {});
            m_epoch = 1;
        }
    }
    /// Prefetches the memory that `findOrInsert` reads first.
    void prefetch(uint64_t key) const { __builtin_prefetch(&m_slots[key & (m_slots.size() - 1)]); }
    static constexpr uint32_t kAbsent = ~0u;
    /// Returns the index under `key`, or kAbsent.
    uint32_t find(uint64_t key) const {
        const size_t mask = m_slots.size() - 1;
        for (size_t i = key & mask; m_slots[i].epoch == m_epoch; i = (i + 1) & mask)
            if (m_slots[i].key == key)
                return m_slots[i].index;
        return kAbsent;
    }
    /// Returns the index under `key`, inserted as `next` if there is none. The reference is valid until the
    /// next call.
    uint32_t& findOrInsert(uint64_t key, uint32_t next) {
        Slot* slot = &findSlot(key);
        if (slot->epoch == m_epoch)
            return slot->index;
        if (2 * ++m_used > m_slots.size()) {
            grow();
            slot = &findSlot(key);
        }
        *slot = {key, next, m_epoch};
        return slot->index;
    }

  private:
    struct Slot {
        uint64_t key = 0;
        uint32_t index = 0;
        uint32_t epoch = 0; ///< the slot is free unless this is m_epoch
    };

    /// Returns the slot of the key, or the free slot for it.
    Slot& findSlot(uint64_t key) {
        const size_t mask = m_slots.size() - 1;
        size_t i = key & mask;
        while (m_slots[i].epoch == m_epoch && m_slots[i].key != key)
            i = (i + 1) & mask;
        return m_slots[i];
    }
    void grow() {
        HugeVector<Slot> old(2 * m_slots.size());
        old.swap(m_slots);
        for (const Slot& slot : old)
            if (slot.epoch == m_epoch)
                findSlot(slot.key) = slot;
    }

    HugeVector<Slot> m_slots; ///< a power of two; at least half of them are free
    uint32_t m_epoch = 1;
    size_t m_used = 0;
};

} // namespace strobe
