// A hash table of one batch's keys, emptied in no time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace strobe {

/// Numbers filed under 64-bit keys. It stays as small as its contents allow, to stay in the first-level
/// cache.
class IndexTable {
  public:
    void clear() {
        m_used = 0;
        if (++m_epoch == 0)
            m_slots.assign(m_slots.size(), {}), m_epoch = 1;
    }
    /// Asks the memory for what `insert` will look at first.
    void prefetch(uint64_t key) const { __builtin_prefetch(&m_slots[key & (m_slots.size() - 1)]); }
    /// The number filed under `key`, or `next`, which is then filed.
    uint32_t insert(uint64_t key, uint32_t next) { return filed(key, next); }
    /// The same, where it is filed: to be changed before something else is inserted.
    uint32_t& filed(uint64_t key, uint32_t next) {
        Slot* slot = &find(key);
        if (slot->epoch == m_epoch)
            return slot->index;
        if (2 * ++m_used > m_slots.size())
            grow(), slot = &find(key);
        *slot = {key, next, m_epoch};
        return slot->index;
    }

  private:
    struct Slot {
        uint64_t key = 0;
        uint32_t index = 0, epoch = 0;
    };

    /// The key's slot, or the free one where it belongs.
    Slot& find(uint64_t key) {
        const size_t mask = m_slots.size() - 1;
        size_t i = key & mask;
        while (m_slots[i].epoch == m_epoch && m_slots[i].key != key)
            i = (i + 1) & mask;
        return m_slots[i];
    }
    void grow() {
        std::vector<Slot> old(2 * m_slots.size());
        old.swap(m_slots);
        for (const Slot& slot : old)
            if (slot.epoch == m_epoch)
                find(slot.key) = slot;
    }

    std::vector<Slot> m_slots = std::vector<Slot>(64); ///< a power of two of them, half of them free
    uint32_t m_epoch = 1;
    size_t m_used = 0;
};

} // namespace strobe
