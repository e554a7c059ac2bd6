// Separable filters: the parameters of their widths, and sampling of tabulated profiles.
#pragma once

#include "core/interfaces/filter.h"
#include "core/math/sampling.h"
#include "core/params/params.h"

#include <functional>

namespace strobe {

/// Parameter definitions of the half-widths of a filter. `fallback`: the default in pixels.
struct WidthParams {
    explicit WidthParams(float fallback)
        : x{"xwidth", fallback, "half-width in x, in pixels", "xradius", {0, 64, true}},
          y{"ywidth", fallback, "half-width in y, in pixels", "yradius", {0, 64, true}} {}
    ParamDef<float> x, y;

    /// Returns the half-widths. Throws a located Error unless both are positive and at most 64 pixels.
    V2f read(const ParamSet& params) const;
    /// Reads the half-widths with another default.
    V2f read(const ParamSet& params, float fallback) const;
};

/// An even function f on [-radius, radius] that is sampled with density |f| / ∫|f|. The inverse of the
/// distribution function is tabulated at equal steps and interpolated linearly, except at its ends, where the
/// table would be too coarse and the inverse is evaluated directly.
class Profile {
  public:
    using Function = std::function<float(float)>;
    Profile(float radius, Function f);

    struct Sample {
        float x, weight; ///< weight: f/pdf for the normalized f
    };
    /// Draws a sample; u in [0,1). The mean weight is 1.
    Sample sample(float u) const;
    /// Draws n samples.
    void sampleSoA(const float* u, int n, float* x, float* weight) const;
    /// Returns the normalized profile, which integrates to 1; zero outside of the radius.
    float eval(float x) const;
    float radius() const { return m_radius; }

  private:
    float unnormalized(float x) const { return std::abs(x) < m_radius ? m_f(x) : 0; }
    float m_radius;
    Function m_f;
    /// Returns the probability of samples below x.
    float distribution(float x) const;
    /// Returns the inverse of the distribution function without the table.
    float exactInverse(float u) const { return (2 * m_absolute.sample(u) - 1) * m_radius; }
    PiecewiseLinear1D m_absolute; ///< |f| over [-radius, radius]
    std::vector<float> m_inverse; ///< x at equal steps of the distribution function of |f|, ends included
    std::vector<float> m_signedWeights; ///< weight per interval of x; empty if none is negative
    float m_weight = 1;                 ///< ∫|f| / ∫f
    float m_integral = 1;               ///< ∫f
};

/// Creates the filter that is the product of two profiles.
std::shared_ptr<const Filter> makeSeparable(Profile x, Profile y);

} // namespace strobe
