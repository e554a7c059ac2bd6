// Sums of direct and indirect light by cells of the surfaces at rest.
#pragma once

#include "core/math/hash.h"
#include "sharing/records/fixed_point_sum.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

namespace strobe {

/// A cube of a grid around a surface at rest, in world space at shutter fraction 0, and the side of the
/// surface that faces one of six directions. The edge of the cube is 2^level scene units.
struct CellId {
    static constexpr int kFaces = 6; ///< values of `face`
    /// The largest absolute value of `level` of recorded cells: squared sizes of their ancestors are floats.
    static constexpr int kMaxLevel = 48;
    static constexpr int32_t kMaxIndex = 1 << 30; ///< that of x, y and z

    uint64_t surface = 0; ///< see SurfaceIds
    int32_t x = 0, y = 0, z = 0;
    int16_t level = 0;
    uint16_t face = 0; ///< twice the largest axis of the geometric normal, plus 1 if this points against it

    /// Returns the cell of the next coarser grid that contains this one.
    CellId parent() const { return {surface, x >> 1, y >> 1, z >> 1, int16_t(level + 1), face}; }
    /// The same for the grid of a level.
    CellId ancestor(int ofLevel) const {
        const int shift = std::min(ofLevel - level, 31);
        return {surface, x >> shift, y >> shift, z >> shift, int16_t(ofLevel), face};
    }
    uint64_t hash() const {
        return fastHashOf(surface, uint64_t(uint32_t(x)) << 32 | uint32_t(y),
                          uint64_t(uint32_t(z)) << 32 | uint64_t(uint16_t(level)) << 16 | face);
    }
    bool operator==(const CellId&) const = default;
};

/// The coordinates of two cells in the grid of the larger one.
struct AlignedCells {
    int level;
    int32_t a[3], b[3];

    AlignedCells(const CellId& first, const CellId& second) : level(std::max(first.level, second.level)) {
        align(first, a);
        align(second, b);
    }
    /// Returns the bits of an axis in which both differ.
    uint32_t differences(int axis) const { return uint32_t(a[axis]) ^ uint32_t(b[axis]); }

  private:
    void align(const CellId& id, int32_t* out) const {
        const CellId ancestor = id.ancestor(level);
        out[0] = ancestor.x;
        out[1] = ancestor.y;
        out[2] = ancestor.z;
    }
};

/// Returns the level of the smallest cube that contains two cells of a surface; INT_MAX: there is none.
inline int commonLevel(const CellId& a, const CellId& b) {
    const AlignedCells cells(a, b);
    const uint32_t differences = cells.differences(0) | cells.differences(1) | cells.differences(2);
    const int width = std::bit_width(differences);
    return width > 31 ? std::numeric_limits<int>::max() : cells.level + width;
}

/// Returns whether `a` precedes `b` in the order of the cells: by surface, then as a walk through an octree
/// visits them (Morton order). A cell precedes those inside it, and cells of a cube are ordered by face.
inline bool precedes(const CellId& a, const CellId& b) {
    if (a.surface != b.surface)
        return a.surface < b.surface;
    const AlignedCells cells(a, b);
    int axis = 0; // with the highest bit in which both differ
    for (const int other : {1, 2})
        if (const uint32_t d = cells.differences(axis), e = cells.differences(other); d < e && d < (d ^ e))
            axis = other;
    if (cells.differences(axis) != 0)
        return cells.a[axis] < cells.b[axis];
    return a.level != b.level ? a.level > b.level : a.face < b.face;
}

/// The parts of the light at first vertices that are shared, each with weights of its own.
enum class LightPart { Direct, Indirect };
inline constexpr int kParts = 2;
inline constexpr LightPart kAllParts[kParts] = {LightPart::Direct, LightPart::Indirect};

/// A set of parts.
class LightParts {
  public:
    LightParts() = default;
    explicit LightParts(uint32_t bits) : m_bits(bits) {}
    static LightParts all() { return LightParts((1u << kParts) - 1); }
    void add(LightPart part) { m_bits |= 1u << int(part); }
    bool has(LightPart part) const { return m_bits >> int(part) & 1; }
    bool isEmpty() const { return m_bits == 0; }
    uint32_t bits() const { return m_bits; }
    bool operator==(const LightParts&) const = default;

  private:
    uint32_t m_bits = 0;
};

/// The samples of each pixel are divided into two halves. The difference between both measures the noise.
inline constexpr int kHalves = 2;

/// The sums of a cell. All are integers: they do not depend on the order of the samples.
struct CellSums {
    /// Positions are relative to the cell's corner, in units of 2^-kPositionBits edges; shading normals are
    /// unit vectors, in units of 2^-kNormalBits.
    static constexpr int kPositionBits = 16, kNormalBits = 14;

    CellId id;
    int64_t p[3] = {}, n[3] = {};
    uint32_t count[kHalves] = {};  ///< samples on the cell
    RgbSum light[kParts][kHalves]; ///< divided by the albedo of the sample's first vertex

    void add(const CellSums& other) {
        for (int k = 0; k < 3; ++k) {
            addWrapping(p[k], other.p[k]);
            addWrapping(n[k], other.n[k]);
        }
        for (int half = 0; half < kHalves; ++half) {
            count[half] += other.count[half];
            for (int part = 0; part < kParts; ++part)
                light[part][half].add(other.light[part][half]);
        }
    }
};

/// The largest channel of the light of a sample, by part, above which the rest is recorded by itself.
struct RareLimits {
    float of[kParts] = {INFINITY, INFINITY};
};

/// The light of one sample above RareLimits.
struct RareSample {
    uint32_t cell = 0;
    uint8_t part = 0;
    bool isInQuarter = false; ///< in the first quarter of its half
    Rgb light{0};             ///< divided by the albedo
    Rgb albedo{0};            ///< weighted by the pixel filter
};

/// The albedos of the samples of one half of a pixel on one cell.
struct CellUse {
    static constexpr int kAlbedoBits = 30;
    static constexpr float kMaxAlbedo = 1 << 9;

    uint32_t cell = 0;
    /// The sums of the albedos, weighted by the pixel filter, in units of 2^-kAlbedoBits. Those of a sample
    /// are limited to ±2^9, so that sums of 2^23 samples do not overflow.
    int64_t albedo[3] = {};

    void add(const Rgb& weightedAlbedo) {
        constexpr float kPerUnit = 1 << kAlbedoBits;
        for (int c = 0; c < 3; ++c) // NaN is the limit
            albedo[c] += int64_t(std::max(-kMaxAlbedo, std::min(kMaxAlbedo, weightedAlbedo[c])) * kPerUnit);
    }
    void add(const CellUse& other) {
        for (int c = 0; c < 3; ++c)
            addWrapping(albedo[c], other.albedo[c]);
    }
    Rgb albedoSum() const {
        constexpr float kUnit = 1.f / (1 << kAlbedoBits);
        return Rgb(float(albedo[0]), float(albedo[1]), float(albedo[2])) * kUnit;
    }
};

} // namespace strobe
