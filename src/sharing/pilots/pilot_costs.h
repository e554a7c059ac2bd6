// The noise of blocks of pixels and the time of their samples, as a plan of the samples sees them.
#pragma once

#include "core/math/simd4.h"
#include "sharing/pilots/pair_pilot.h"

#include <vector>

namespace strobe {

/// The squared errors of pixels per sample:
enum ErrorLane {
    kPlanned,        ///< of PlannedLight
    kRawPlanned,     ///< the same, not clipped
    kClippedPlanned, ///< the same, of samples clipped to 1
    kOther           ///< of other light; more samples do not lower it
};

/// The light whose noise a plan lowers.
struct PlannedLight {
    BlockNoise::Light BlockNoise::*light;
    float otherLeft; ///< the part of the variance of other light that is left
};

/// The errors of pixels, by ErrorLane, and their time, per sample.
struct Costs {
    Float4 errors = {};
    float time = 0; ///< in units of a ray; 0: not measured
};

/// The costs of a block and its neighbors, with its density.
struct BlockCost : Costs {
    /// The binary logarithm of the density of samples, a power of the error over one of the time (Neyman
    /// allocation); -infinity without an error.
    float logDensity = -INFINITY;
};

/// The costs of all blocks: by each half of the pilot, and by the whole. They are computed row by row and not
/// stored: in small images, first writes to memory would take longer than computing them again.
class PilotCosts {
  public:
    static constexpr int kWhole = kHalves, kSets = kHalves + 1;
    using OfBlock = BlockCost[kSets]; ///< by each half, then by the whole

    /// The pilot outlives this object.
    PilotCosts(const PairPilot& pilot, const PlannedLight& planned)
        : m_pilot(pilot), m_planned(planned), m_columns(size_t(pilot.blocks().columns())),
          m_rows(size_t(pilot.blocks().rows())) {}
    /// Calls visit(block, costs) for all blocks in order. The costs are the means over the block and its
    /// neighbors that were measured, weighted by a tent.
    template <class Visit>
    void forEachBlock(const Visit& visit) const {
        Row costs(m_columns), rows[3] = {Row(m_columns), Row(m_columns), Row(m_columns)};
        smoothRow(0, costs, rows[0]);
        for (size_t y = 0; y < m_rows; ++y) {
            const bool hasNext = y + 1 < m_rows;
            if (hasNext)
                smoothRow(y + 1, costs, rows[(y + 1) % 3]);
            for (size_t x = 0; x < m_columns; ++x) {
                Sets sums;
                sums.add(rows[y % 3][x], 2);
                if (y > 0)
                    sums.add(rows[(y - 1) % 3][x], 1);
                if (hasNext)
                    sums.add(rows[(y + 1) % 3][x], 1);
                const OfBlock means = {meanOf(sums, 0), meanOf(sums, 1), meanOf(sums, kWhole)};
                visit(y * m_columns + x, means);
            }
        }
    }

  private:
    /// The costs of a block, or sums over blocks.
    struct Sets {
        Float4 errors[kSets] = {};
        Float4 times = {};   ///< by set
        Float4 weights = {}; ///< by set; 0: not measured
        void set(int k, const Costs& cost);
        void add(const Sets& other, float weight);
    };
    using Row = std::vector<Sets>;

    Sets costsOf(size_t block) const;
    void smoothRow(size_t y, Row& costs, Row& out) const;
    static BlockCost meanOf(const Sets& sums, int k);

    const PairPilot& m_pilot;
    const PlannedLight m_planned;
    const size_t m_columns, m_rows;
};

} // namespace strobe
