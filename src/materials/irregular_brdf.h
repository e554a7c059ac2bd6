// Isotropic BRDFs measured at scattered pairs of directions: pbrt-v2's .brdf files and its interpolation.
#pragma once

#include "core/math/soa.h"
#include "core/util/error.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace strobe {

/// A BRDF interpolated from scattered samples. A sample is located by its key (sinθi sinθo, Δφ/π, cosθi
/// cosθo) in [0,1]³, a space in which pairs of directions with similar values are close (Marschner's
/// parametrization). Immutable after construction.
class IrregularBrdf {
  public:
    struct Sample {
        V3f key;
        Rgb value;
    };
    /// `samples`: at least one.
    explicit IrregularBrdf(std::vector<Sample> samples);

    /// Returns the key of a pair of unit directions. Δφ is folded to [0,π], so the key is symmetric in wo and
    /// wi, and negating both directions does not change it.
    static V3f keyOf(const V3f& wo, const V3f& wi);
    /// Writes the keys of the pairs `begin` to `end`.
    static void keySoA(const V3SoA& wo, const V3SoA& wi, int begin, int end, V3SoA& keys);

    /// Returns the mean of all samples within distance r of the key, weighted by exp(-100 d²). r² is the
    /// first of .001, .002, .004 … 1.024 that finds more than two samples, else infinite. (pbrt-v2 ends
    /// at 2.048, which differs by less than e^-150.)
    Rgb eval(const V3f& key) const;
    /// Evaluates the keys `begin` to `end`. The result is black where `mask` is 0; a null mask selects all.
    void evalSoA(const V3SoA& keys, const int32_t* mask, int begin, int end, RgbSoA& out) const;
    /// Evaluates by visiting every sample: the reference for tests of eval, and its fallback.
    Rgb evalBruteForce(const V3f& key) const;

    const std::vector<Sample>& samples() const { return m_samples; }

    struct Box;
    /// Keys and values of 16 samples as vectors.
    struct alignas(64) Group {
        static constexpr int kSize = 16;
        typedef float Floats __attribute__((vector_size(4 * kSize)));
        typedef int32_t Ints __attribute__((vector_size(4 * kSize)));
        Floats x, y, z, r, g, b;
    };

  private:
    using Indices = std::vector<uint32_t>; ///< of samples
    /// A cell of a grid over key space. The `count` groups from `first` on hold all samples that lookups in
    /// the cell need; if `count` is 0, lookups visit all samples.
    struct Cell {
        float minRadius2 = 0; ///< lower bound of the squared search radius over the cell
        uint32_t first = 0, count = 0;
    };
    struct Grid;
    /// Bounds of the squared search radius over the points of a box.
    struct RadiusBounds {
        float min, max;
    };

    void buildCells();
    /// Builds the cells of a cube and their groups. `candidates`: a superset of the samples that they need.
    void buildCube(const Box& cube, const Indices& candidates);
    /// Appends the groups that hold the samples `indices`, in this order.
    void addGroups(const Indices& indices);
    RadiusBounds boundRadius(const Box& box, const Indices& candidates) const;
    /// Returns the candidates that a lookup at any point of the box may need.
    Indices selectSamples(const Box& box, const Indices& candidates) const;

    std::vector<Sample> m_samples;
    std::vector<Cell> m_cells; ///< a grid over [0,1]³
    std::vector<Group> m_groups;
};

/// Reads pbrt-v2's text format: the number of wavelengths, the wavelengths (nm, ascending), then records of
/// θi φi θo φo (radians) and one value per wavelength; # starts a comment. Spectra are converted to RGB.
/// Throws an Error located at `where` that names the file.
std::vector<IrregularBrdf::Sample> readIrregularBrdf(const std::filesystem::path& path,
                                                     const Location& where);

} // namespace strobe
