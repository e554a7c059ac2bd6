// Isotropic BRDFs measured at scattered pairs of directions: pbrt-v2's .brdf files and its interpolation.
#pragma once

#include "core/math/soa.h"
#include "core/util/error.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace strobe {

/// Samples in the space of (sinθi sinθo, Δφ/π, cosθi cosθo), where near pairs have near values (Marschner's
/// parametrization), and their mean around any point. Immutable after construction.
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
    static void keySoA(const V3SoA& wo, const V3SoA& wi, int begin, int end, V3SoA& keys);

    /// The mean of all samples nearer than r, weighted by exp(-100 d²), where r² is the first of .001, .002,
    /// .004 … 1.024 that finds more than two samples, else infinite. (pbrt-v2 ends at 2.048, which differs by
    /// less than e^-150.)
    Rgb eval(const V3f& key) const;
    /// The same of keys `begin` to `end`; where `wanted` (if not null) is 0, the result is black.
    void evalSoA(const V3SoA& keys, const int32_t* wanted, int begin, int end, RgbSoA& out) const;
    /// The same by looking at every sample: the definition that eval is tested against.
    Rgb evalBruteForce(const V3f& key) const;

    const std::vector<Sample>& samples() const { return m_samples; }

    struct Block;
    /// Samples side by side.
    struct alignas(64) Group {
        static constexpr int kSize = 16;
        typedef float Row __attribute__((vector_size(4 * kSize)));
        typedef int32_t Ints __attribute__((vector_size(4 * kSize)));
        Row x, y, z, r, g, b;
    };

  private:
    using List = std::vector<uint32_t>; ///< of samples
    /// What a point of a cube of the space finds: `count` groups from `first` on hold the samples that it may
    /// need; none: all are to be looked at.
    struct Cell {
        float least = 0; ///< no point finds three samples within less, squared
        uint32_t first = 0, count = 0;
    };
    struct Grid;
    /// The squared radii that points of a block search.
    struct Search {
        float least, most;
    };

    void buildCells();
    /// Makes the groups of a cube and the cells in it.
    void buildCube(const Block& cube, const List& candidates);
    void addGroups(const List& list);
    Search searchOf(const Block& block, const List& candidates) const;
    /// Those of `candidates` that a point of the block may need.
    List needed(const Block& block, const List& candidates) const;

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
