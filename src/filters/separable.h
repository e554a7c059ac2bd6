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

/// A nonnegative function on [-radius, radius] that is sampled in proportion to its values. The inverse of
/// the distribution function is tabulated at equal steps and interpolated linearly, except at its ends, where
/// the table would be too coarse, and between lobes.
class ProfilePart {
  public:
    /// The function is 0.
    ProfilePart() = default;
    /// `nodes`: its values at equal steps, ends included.
    ProfilePart(float radius, const std::vector<float>& nodes);

    /// Returns x with density f / ∫f; u in [0,1).
    float sample(float u) const;
    /// Draws n samples; the same results, to the bit, if the function has no gaps between lobes.
    void sampleSoA(const float* u, int n, float* x) const;
    /// Returns ∫f / (2 radius).
    float mean() const { return m_table.integral(); }

  private:
    /// Returns whether a step of the table is between two lobes, where interpolation would find neither.
    bool isGap(float u) const;
    /// Returns the inverse of the distribution function without the table.
    float exactInverse(float u) const { return (2 * m_table.sample(u) - 1) * m_radius; }
    float m_radius = 0;
    PiecewiseLinear1D m_table;    ///< f over [-radius, radius]
    std::vector<float> m_inverse; ///< x at equal steps of the distribution function, ends included
};

/// An even function f on [-radius, radius].
class Profile {
  public:
    using Function = std::function<float(float)>;
    Profile(float radius, Function f);

    const ProfilePart& positive() const { return m_positive; }
    /// Returns max(-f, 0).
    const ProfilePart& negative() const { return m_negative; }
    bool hasNegativeLobes() const { return m_negativeFraction > 0; }
    /// Returns ∫max(-f, 0) / ∫|f|.
    float negativeFraction() const { return m_negativeFraction; }
    /// Returns the normalized profile, which integrates to 1; zero outside of the radius.
    float eval(float x) const;
    float radius() const { return m_radius; }

  private:
    float unnormalized(float x) const { return std::abs(x) < m_radius ? m_f(x) : 0; }
    float m_radius;
    Function m_f;
    ProfilePart m_positive, m_negative;
    float m_negativeFraction = 0;
    float m_integral = 1; ///< ∫f
};

/// Creates the filter that is the product of two profiles.
std::shared_ptr<const Filter> makeSeparable(Profile x, Profile y);

} // namespace strobe
