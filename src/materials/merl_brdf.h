// Isotropic BRDFs on a regular grid of half and difference angles: the MERL database.
#pragma once

#include "core/math/math.h"
#include "core/util/error.h"

#include <array>
#include <filesystem>
#include <vector>

namespace strobe {

/// A table of the MERL database (Matusik et al., "A Data-Driven Reflectance Model", 2003), interpreted as in
/// pbrt-v2: piecewise constant, without interpolation. Immutable.
class MerlBrdf {
  public:
    /// Reads a .binary file: three int32 (resolutions of θh, θd and φd), then planes of doubles for red,
    /// green and blue in units of 1/1500, 1.15/1500 and 1.66/1500. Negative values mark invalid measurements
    /// and are read as zero. Throws an Error located at `where` if the file cannot be read or its size
    /// differs from the size that its header implies.
    MerlBrdf(const std::filesystem::path& path, const Location& where);

    /// Returns the value of the cell that contains the pair of unit directions (1/sr); zero for wo = -wi.
    Rgb eval(const V3f& wo, const V3f& wi) const;

  private:
    std::array<int, 3> m_size{}; ///< cells in θh (equidistant in its square root), θd, φd
    std::vector<float> m_values; ///< RGB triples; φd varies fastest
};

} // namespace strobe
