// A latitude-longitude environment map with bilinear lookups and importance sampling.
#pragma once

#include "core/image/image.h"
#include "core/math/sampling.h"

namespace strobe {

/// Radiance by direction, z up: column u = φ/2π, row v = θ/π. Lookups wrap in u and clamp in v. Directions
/// are unit vectors; densities are per solid angle. Immutable.
class EnvironmentMap {
  public:
    /// `image`: not empty; all values finite and not negative.
    explicit EnvironmentMap(const Image& image);

    /// Returns the bilinearly interpolated radiance.
    Rgb radiance(const V3f& w) const;
    struct Sample {
        V3f w;
        Rgb radiance;
        float pdf; ///< per solid angle
    };
    /// Draws w with a density proportional to the interpolated luminance, times a factor per row of cells
    /// over sinθ (the Jacobian is averaged over the row); u in [0,1)².
    Sample sample(const V2f& u) const;
    /// Returns the density of `sample`; positive wherever the radiance is not black.
    float pdf(const V3f& w) const;
    /// Writes the radiance and density of the directions 0 … n-1. `pdf` may be null.
    void lookupSoA(const V3SoA& w, int n, RgbSoA& radiance, float* pdf) const;
    /// Draws n samples with u 0 … n-1.
    void sampleSoA(const V2SoA& u, int n, V3SoA& w, RgbSoA& radiance, float* pdf) const;
    /// Returns the mean radiance over all directions.
    Rgb mean() const { return m_mean; }

  private:
    struct View;
    View view() const;

    int m_width, m_height;
    /// Interleaved RGB of width + 1 by height + 2 pixels: the last column is repeated before the first, the
    /// first row above itself and the last row below itself, so that every cell between four pixel centers
    /// has its corners.
    std::vector<float> m_texels;
    std::vector<float> m_density; ///< pdf · sinθ / luminance, by row of cells
    Piecewise2D m_cells;          ///< flux of the width by height + 1 cells
    Rgb m_mean{0};
};

} // namespace strobe
