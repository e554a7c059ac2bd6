// A hash table of one batch's keys, emptied in no time.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

namespace strobe {

/// The distinct cells or points of one batch, found by key.
class SlotTable {
  public:
    /// Empties the table and makes room for four items a sample at most.
    void clear(size_t samples) {
        const size_t size = std::bit_ceil(std::max<size_t>(8 * samples, 64));
        if (m_slots.size() < size)
            m_slots.assign(size, {}), m_epoch = 0;
        if (++m_epoch == 0)
            m_slots.assign(m_slots.size(), {}), m_epoch = 1;
    }
    /// The number filed under `key`, or `next`, which is then filed.
    uint32_t insert(uint64_t key, uint32_t next) {
        const size_t mask = m_slots.size() - 1;
        for (size_t i = key & mask;; i = (i + 1) & mask) {
            Slot& slot = m_slots[i];
            if (slot.epoch != m_epoch) {
                slot = {key, next, m_epoch};
                return next;
            }
            if (slot.key == key)
                return slot.index;
        }
    }

  private:
    struct Slot {
        uint64_t key = 0;
        uint32_t index = 0, epoch = 0;
    };
    std::vector<Slot> m_slots;
    uint32_t m_epoch = 0;
};

} // namespace strobe
