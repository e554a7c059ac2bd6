// A latitude-longitude image of the surrounding light, looked up bilinearly and sampled by its brightness.
#pragma once

#include "core/image.h"
#include "core/sampling.h"

namespace strobe {

/// Radiance by direction, z up: column u = φ/2π, row v = θ/π. Columns wrap round; beyond the first and last
/// row's centres the rows repeat.
class EnvironmentMap {
  public:
    /// `image`: not empty, all values finite and not negative.
    explicit EnvironmentMap(Image image);

    Rgb radiance(const V3f& w) const;
    struct Sample {
        V3f w;
        Rgb radiance;
        float pdf; ///< per solid angle
    };
    /// Draws w with a density proportional to the luminance, but for sinθ, which is taken at the middle of a
    /// pixel: between pixel centres luminance is bilinear, and so is the density.
    Sample sample(const V2f& u) const;
    /// The density of `sample`; positive wherever radiance is not black.
    float pdf(const V3f& w) const;
    /// The mean over all directions.
    Rgb mean() const { return m_mean; }

  private:
    /// A cell between four pixel centres; the first and last row of cells are half as high.
    struct Cell {
        int x, y;
        V2f at; ///< in [0,1]² within the cell
    };
    Cell cellAt(float u, float v) const;
    float top(int y) const { return std::max(float(y) - .5f, 0.f); }                      ///< in pixels
    float bottom(int y) const { return std::min(float(y) + .5f, float(m_image.height)); } ///< in pixels
    const Rgb& pixel(int x, int y) const;
    Rgb lookup(const Cell& cell) const;
    Bilinear luminances(const Cell& cell) const;
    float pdf(const Cell& cell, float sinTheta) const;

    Image m_image;
    Piecewise2D m_cells; ///< flux of cells: width by height + 1
    Rgb m_mean{0};
};

} // namespace strobe
