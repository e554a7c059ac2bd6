#include "sharing/light_cells.h"

#include "core/util/index_table.h"

namespace strobe {

void CellSums::add(const CellSums& other) {
    for (int k = 0; k < 3; ++k) {
        p[k] += other.p[k];
        n[k] += other.n[k];
    }
    for (int part = 0; part < kParts; ++part)
        for (int half = 0; half < kHalves; ++half)
            light[part][half].add(other.light[part][half]);
}

struct LightCells::Shard {
    std::mutex mutex;
    IndexTable indices; ///< by CellId::hash
    std::vector<CellSums> cells;
};

LightCells::LightCells() : m_shards(std::make_unique<Shard[]>(kShards)) {}
LightCells::~LightCells() = default;

uint32_t LightCells::add(const CellSums& sums) {
    const uint64_t hash = sums.id.hash();
    const uint32_t s = uint32_t(hash >> 58); // the table uses the low bits
    Shard& shard = m_shards[s];
    const std::lock_guard lock(shard.mutex);
    const uint32_t next = uint32_t(shard.cells.size());
    const uint32_t index = shard.indices.findOrInsert(hash, next);
    if (index == next)
        shard.cells.push_back(sums);
    else
        shard.cells[index].add(sums);
    return index * kShards + s;
}

uint32_t LightCells::handleCount() const {
    size_t count = 0;
    for (uint32_t s = 0; s < kShards; ++s)
        count = std::max(count, cellsOf(s).size());
    return uint32_t(count) * kShards;
}

const std::vector<CellSums>& LightCells::cellsOf(uint32_t shard) const { return m_shards[shard].cells; }

} // namespace strobe
