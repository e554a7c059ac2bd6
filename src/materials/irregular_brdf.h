// Isotropic BRDFs measured at scattered pairs of directions: pbrt-v2's .brdf files and its interpolation.
#pragma once

#include "core/error.h"
#include "core/math.h"

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

    /// The mean of all samples nearer than r, weighted by exp(-100 d²), where r² is the first of .001, .002,
    /// .004 … 1.024 that finds more than two samples, else infinite. (pbrt-v2 ends at 2.048, which differs by
    /// less than e^-150.)
    Rgb eval(const V3f& key) const;
    /// The same by looking at every sample: the definition that eval is tested against.
    Rgb evalBruteForce(const V3f& key) const;

    const std::vector<Sample>& samples() const { return m_samples; }

  private:
    struct Range {
        uint32_t first = 0, count = 0;
    };
    Rgb mean(const V3f& key, const uint32_t* candidates, uint32_t n) const;
    void buildCells();

    std::vector<Sample> m_samples;
    std::vector<Range> m_cells;         ///< kCells³ over [0,1]³: for each, a range of m_candidates
    std::vector<uint32_t> m_candidates; ///< samples that some point of the cell may need, ascending
    std::vector<uint32_t> m_all;        ///< 0, 1, 2 …: the candidates of everywhere else
};

/// Reads pbrt-v2's text format: the number of wavelengths, the wavelengths (nm), then records of θi φi θo φo
/// (radians) and one value per wavelength; # starts a comment. Throws an Error located at `where` that names
/// the file.
std::vector<IrregularBrdf::Sample> readIrregularBrdf(const std::filesystem::path& path,
                                                     const Location& where);

} // namespace strobe
