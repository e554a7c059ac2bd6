// Isotropic BRDFs measured at scattered pairs of directions: pbrt-v2's .brdf files and its interpolation.
#pragma once

#include "core/error.h"
#include "core/lanes.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace strobe {

/// Samples in the space of (sinθi sinθo, Δφ/π, cosθi cosθo), where near pairs have near values (Marschner's
/// parametrisation), and their mean around any point. Immutable after construction.
class IrregularBrdf {
  public:
    struct Sample {
        V3f key;
        Rgb value;
    };
    /// `samples`: at least one.
    explicit IrregularBrdf(std::vector<Sample> samples);

    /// The key of a pair of unit directions; Δφ in [0,π] is folded, so the key is symmetric. Same for the
    /// directions negated.
    static V3f keyOf(const V3f& wo, const V3f& wi);
    /// The same of pairs `begin` to `end`.
    static void keyLanes(const V3Lanes& wo, const V3Lanes& wi, int begin, int end, V3Lanes& keys);

    /// The mean of all samples nearer than r, weighted by exp(-100 d²), where r² is the first of .001, .002,
    /// .004 … 1.024 that finds more than two samples, else infinite. (pbrt-v2 ends at 2.048, which differs by
    /// less than e^-150.)
    Rgb eval(const V3f& key) const;
    /// The same of keys `begin` to `end`; where `wanted` (if not null) is 0, the result is black.
    void evalLanes(const V3Lanes& keys, const int32_t* wanted, int begin, int end, RgbLanes& out) const;
    /// The same by looking at every sample: the definition that eval is tested against.
    Rgb evalBruteForce(const V3f& key) const;

    const std::vector<Sample>& samples() const { return m_samples; }

  private:
    struct Block;
    /// Samples side by side.
    struct alignas(64) Group {
        static constexpr int kSize = 16;
        float x[kSize], y[kSize], z[kSize], r[kSize], g[kSize], b[kSize];
    };
    /// The samples that some point of a cube of the space may need: `count` groups from `first` on, the last
    /// one filled up with samples far away.
    struct Cell {
        uint32_t first = 0, count = 0;
        float r2 = 0; ///< no point of the cell finds more than two samples within a smaller squared radius
    };
    struct Grid;

    void buildCells();
    void addCell(Cell& cell, const std::vector<uint32_t>& list);
    std::vector<uint32_t> needed(const Block& block, const std::vector<uint32_t>& candidates,
                                 float& r2) const;

    std::vector<Sample> m_samples;
    std::vector<Cell> m_cells; ///< a grid over [0,1]³
    std::vector<Group> m_groups;
};

/// Reads pbrt-v2's text format: the number of wavelengths, the wavelengths (nm), then records of θi φi θo φo
/// (radians) and one value per wavelength; # starts a comment. Throws an Error located at `where` that names
/// the file.
std::vector<IrregularBrdf::Sample> readIrregularBrdf(const std::filesystem::path& path,
                                                     const Location& where);

} // namespace strobe
