// What the separable filters share: the parameters of their widths, and sampling a tabulated profile.
#pragma once

#include "core/interfaces/filter.h"
#include "core/math/sampling.h"
#include "core/params/params.h"

#include <functional>

namespace strobe {

/// The half-widths of a filter whose default is `fallback` pixels, as parameter definitions.
struct WidthParams {
    explicit WidthParams(float fallback)
        : x{"xwidth", fallback, "half-width across, in pixels", "xradius", {0, 64, true}},
          y{"ywidth", fallback, "half-width down, in pixels", "yradius", {0, 64, true}} {}
    ParamDef<float> x, y;

    /// Throws a located Error unless both are positive and at most 64 pixels.
    V2f read(const ParamSet& params) const;
    /// As read, with another default.
    V2f read(const ParamSet& params, float fallback) const;
};

/// An even function f on [-radius, radius], sampled by its absolute value. The inverse of the distribution
/// function is tabulated at equal steps, and linear between them but at its ends, where it would be too
/// coarse.
class Profile {
  public:
    using Function = std::function<float(float)>;
    Profile(float radius, Function f);

    struct Sample {
        float x, weight; ///< weight: f/pdf for the normalized f
    };
    Sample sample(float u) const;
    /// The same of n numbers.
    void sampleSoA(const float* u, int n, float* x, float* weight) const;
    /// The normalized profile: integrates to 1. Zero outside the radius.
    float eval(float x) const;
    float radius() const { return m_radius; }

  private:
    float raw(float x) const { return std::abs(x) < m_radius ? m_f(x) : 0; }
    float m_radius;
    Function m_f;
    /// The part of the samples that are below x.
    float distribution(float x) const;
    float exact(float u) const { return (2 * m_absolute.sample(u) - 1) * m_radius; }
    PiecewiseLinear1D m_absolute; ///< |f| over [-radius, radius]
    std::vector<float> m_inverse; ///< x at equal steps of the distribution function of |f|, ends included
    std::vector<float> m_signed;  ///< the weight in each of equal intervals of x, where some are negative
    float m_weight = 1;           ///< ∫|f| / ∫f
    float m_integral = 1;         ///< of f
};

/// A filter that is the product of two profiles.
std::shared_ptr<const Filter> makeSeparable(Profile x, Profile y);

} // namespace strobe
