// Isotropic BRDFs on a regular grid of half and difference angles: the MERL database (Matusik et al., "A
// Data-Driven Reflectance Model", 2003), read as pbrt-v2 reads it.
#pragma once

#include "core/math/math.h"
#include "core/util/error.h"

#include <array>
#include <filesystem>
#include <vector>

namespace strobe {

class MerlBrdf {
  public:
    /// Reads a .binary file: three int32 (θh, θd, φd resolutions), then doubles, red, green and blue planes
    /// in units of 1/1500, 1.15/1500 and 1.66/1500. Negative (invalid) measurements count as zero. Throws an
    /// Error located at `where` when the size of the file is not what its header says.
    MerlBrdf(const std::filesystem::path& path, const Location& where);

    /// The value of the cell that holds the pair of unit directions; zero for wo = -wi.
    Rgb eval(const V3f& wo, const V3f& wi) const;

  private:
    std::array<int, 3> m_size{}; ///< θh (by square root), θd, φd
    std::vector<float> m_values; ///< RGB triples, φd varies fastest
};

} // namespace strobe
