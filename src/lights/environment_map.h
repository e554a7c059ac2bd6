// A latitude-longitude image of the surrounding light, looked up bilinearly and sampled by its brightness.
#pragma once

#include "core/image/image.h"
#include "core/math/sampling.h"

namespace strobe {

/// Radiance by direction, z up: column u = φ/2π, row v = θ/π. Columns wrap round; beyond the first and last
/// row's centers the rows repeat.
class EnvironmentMap {
  public:
    /// `image`: not empty, all values finite and not negative.
    explicit EnvironmentMap(const Image& image);

    Rgb radiance(const V3f& w) const;
    struct Sample {
        V3f w;
        Rgb radiance;
        float pdf; ///< per solid angle
    };
    /// Draws w with a density proportional to the luminance, but for sinθ, which is taken at the middle of a
    /// pixel: between pixel centers luminance is bilinear, and so is the density.
    Sample sample(const V2f& u) const;
    /// The density of `sample`; positive wherever radiance is not black.
    float pdf(const V3f& w) const;
    /// radiance and pdf of directions 0 … n-1; `pdf` may be null: not wanted.
    void lookupSoA(const V3SoA& w, int n, RgbSoA& radiance, float* pdf) const;
    /// sample for u 0 … n-1.
    void sampleSoA(const V2SoA& u, int n, V3SoA& w, RgbSoA& radiance, float* pdf) const;
    /// The mean over all directions.
    Rgb mean() const { return m_mean; }

  private:
    struct View;
    View view() const;

    int m_width, m_height;
    /// Red, green and blue in turn, with the last column before the first, the first row before itself and
    /// the last after itself: every cell between four pixel centers has its corners.
    std::vector<float> m_texels;
    std::vector<float> m_density; ///< by row of cells: pdf · sinθ over luminance
    Piecewise2D m_cells;          ///< flux of cells: width by height + 1
    Rgb m_mean{0};
};

} // namespace strobe
