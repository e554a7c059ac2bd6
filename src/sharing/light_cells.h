// Sums of direct and indirect light by cells of the surfaces at rest.
#pragma once

#include "core/film/pixel_accumulator.h"
#include "core/math/hash.h"
#include "core/math/math.h"

#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace strobe {

/// A cube of a grid around a surface at rest, in world space at shutter fraction 0, and the side of the
/// surface that faces one of six directions. The edge of the cube is 2^level scene units.
struct CellId {
    uint64_t surface = 0; ///< instance and geometry: see Hit
    int32_t x = 0, y = 0, z = 0;
    int16_t level = 0;
    uint16_t face = 0; ///< twice the largest axis of the normal, plus 1 if the normal points against it

    /// Returns the cell of the next coarser grid that contains this one.
    CellId parent() const { return {surface, x >> 1, y >> 1, z >> 1, int16_t(level + 1), face}; }
    uint64_t hash() const {
        return fastHashOf(surface, uint64_t(uint32_t(x)) << 32 | uint32_t(y),
                          uint64_t(uint32_t(z)) << 32 | uint64_t(uint16_t(level)) << 16 | face);
    }
    auto operator<=>(const CellId&) const = default;
};

/// The parts of the light at first vertices that are shared, each with weights of its own.
enum class LightPart { Direct, Indirect };
inline constexpr int kParts = 2;

/// A set of parts.
class LightParts {
  public:
    void add(LightPart part) { m_bits |= 1u << int(part); }
    bool has(LightPart part) const { return m_bits >> int(part) & 1; }
    bool isEmpty() const { return m_bits == 0; }

  private:
    uint32_t m_bits = 0;
};

/// The samples of each pixel are divided into two halves. The difference between both measures the noise.
inline constexpr int kHalves = 2;

/// The sums of a cell. All are integers: they do not depend on the order of the samples.
struct CellSums {
    /// Positions are relative to the cell's corner, in units of 2^-kPositionBits edges; normals are unit
    /// vectors, in units of 2^-kNormalBits.
    static constexpr int kPositionBits = 16, kNormalBits = 14;

    CellId id;
    int64_t p[3] = {}, n[3] = {};
    /// Light divided by the albedo of the sample's first vertex. The valid samples are those on the cell.
    PixelAccumulator light[kParts][kHalves];

    void add(const CellSums& other);
};

/// The albedos of the samples of one half of a pixel on one cell.
struct CellUse {
    uint32_t pixel;     ///< row by row in the pixel bounds
    uint32_t cell : 31; ///< a handle of LightCells
    uint32_t half : 1;
    Rgb albedo; ///< the sum over the samples, weighted by the pixel filter
};

/// The largest channel of the light of a sample, by part, above which the rest is recorded by itself.
struct RareLimits {
    float of[kParts] = {INFINITY, INFINITY};
};

/// The light of one sample above RareLimits.
struct RareSample {
    uint32_t pixel; ///< row by row in the pixel bounds
    uint32_t cell;  ///< a handle of LightCells
    uint8_t part, half;
    bool isInQuarter; ///< see HalfPixelSums
    Rgb light;        ///< divided by the albedo
    Rgb albedo;       ///< weighted by the pixel filter
};

/// Stores cells by their ids. Threads may add concurrently.
class LightCells {
  public:
    LightCells();
    ~LightCells();
    /// Adds sums to a cell and returns the cell's handle.
    uint32_t add(const CellSums& sums);
    /// Returns the number of handles: all are less, but not every smaller number is one.
    uint32_t handleCount() const;
    /// Calls work(handle, sums) for all cells, in any order. No thread may add meanwhile.
    template <class Work>
    void forEach(const Work& work) const {
        for (uint32_t s = 0; s < kShards; ++s)
            for (uint32_t i = 0; i < cellsOf(s).size(); ++i)
                work(i * kShards + s, cellsOf(s)[i]);
    }

  private:
    static constexpr uint32_t kShards = 64;
    struct Shard;
    const std::vector<CellSums>& cellsOf(uint32_t shard) const;
    std::unique_ptr<Shard[]> m_shards;
};

} // namespace strobe
