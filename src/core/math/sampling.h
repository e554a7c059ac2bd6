// Warps of the unit square, each with its inverse and its density, and tabulated densities.
//
// Unless said otherwise u lies in [0,1)²; directions are unit vectors around +z; densities of directions are
// per solid angle. Discs are entered by Shirley and Chiu's concentric map ("A Low Distortion Map Between Disk
// and Square", 1997), which keeps well-spread points well spread.
#pragma once

#include "core/math/fast_math.h"

#include <vector>

namespace strobe {

/// The unit disc, uniform by area (density 1/π).
STROBE_FORCE_INLINE V2f concentricDisk(const V2f& u) {
    const float a = 2 * u.x - 1, b = 2 * u.y - 1;
    const bool wide = std::abs(a) > std::abs(b);
    const float r = wide ? a : b, q = wide ? b : a;
    const float phi = (kPi / 4) * (r != 0 ? q / r : 0);
    const float major = r * cosQuarter(phi), minor = r * sinQuarter(phi);
    return wide ? V2f(major, minor) : V2f(minor, major);
}
V2f concentricDiskInverse(const V2f& p);

/// The hemisphere with density cosθ/π.
STROBE_FORCE_INLINE V3f cosineHemisphere(const V2f& u) {
    const V2f d = concentricDisk(u);
    return {d.x, d.y, safeSqrt(1 - d.x * d.x - d.y * d.y)};
}
inline V2f cosineHemisphereInverse(const V3f& w) { return concentricDiskInverse({w.x, w.y}); }
/// Zero below the horizon.
inline float cosineHemispherePdf(float cosTheta) { return std::max(cosTheta, 0.f) * kInvPi; }

/// The cone around +z, uniform by solid angle. It is given by 1 - cosθmax (in (0,2]), which stays accurate
/// for cones so narrow that cosθmax rounds to 1; see oneMinusCos.
STROBE_FORCE_INLINE V3f uniformCone(const V2f& u, float oneMinusCosMax) {
    const V2f d = concentricDisk(u);
    const float x = (d.x * d.x + d.y * d.y) * oneMinusCosMax; // 1 - cosθ
    const float scale = safeSqrt(oneMinusCosMax * (2 - x));   // sinθ over the point's radius in the disc
    return {d.x * scale, d.y * scale, 1 - x};
}
V2f uniformConeInverse(const V3f& w, float oneMinusCosMax);
/// The density inside the cone.
inline float uniformConePdf(float oneMinusCosMax) { return 1 / (2 * kPi * oneMinusCosMax); }
/// 1 - cosθ from sin²θ, for θ <= 90°, without cancellation.
inline float oneMinusCos(float sin2Theta) { return sin2Theta / (1 + safeSqrt(1 - sin2Theta)); }

/// The whole sphere, uniform: density 1/(4π).
inline V3f uniformSphere(const V2f& u) { return uniformCone(u, 2); }
inline V2f uniformSphereInverse(const V3f& w) { return uniformConeInverse(w, 2); }
inline constexpr float kUniformSpherePdf = kInvPi / 4;
/// The upper hemisphere, uniform: density 1/(2π).
inline V3f uniformHemisphere(const V2f& u) { return uniformCone(u, 1); }
inline V2f uniformHemisphereInverse(const V3f& w) { return uniformConeInverse(w, 1); }
inline constexpr float kUniformHemispherePdf = kInvPi / 2;

/// Barycentrics (of the first two vertices; the third has 1 - x - y), uniform by area over the triangle:
/// Heitz, "A Low-Distortion Map Between Triangle and Square" (2019).
inline V2f uniformTriangle(const V2f& u) {
    if (u.y > u.x)
        return {u.x / 2, u.y - u.x / 2};
    return {u.x - u.y / 2, u.y / 2};
}
V2f uniformTriangleInverse(const V2f& barycentrics);

/// x in [-1,1] with density 1 - |x|, u in [0,1).
float tent(float u);
float tentInverse(float x);
inline float tentPdf(float x) { return std::max(0.f, 1 - std::abs(x)); }

/// x in [0,1] with density proportional to lerp(a, b, x); a, b >= 0, not both zero; u in [0,1).
STROBE_FORCE_INLINE float sampleLinear(float u, float a, float b) {
    const float denominator = a + std::sqrt(lerp(a * a, b * b, u)), x = u * (a + b) / denominator;
    return std::min(denominator > 0 ? x : u, kOneMinusEpsilon);
}
float linearInverse(float x, float a, float b);
inline float linearPdf(float x, float a, float b) { return 2 * lerp(a, b, x) / (a + b); }

/// Values at the corners of the unit square, interpolated bilinearly.
struct Bilinear {
    float f00, f10, f01, f11; ///< f10: at (1,0)
    STROBE_FORCE_INLINE float eval(const V2f& p) const {
        return lerp(lerp(f00, f10, p.x), lerp(f01, f11, p.x), p.y);
    }
    STROBE_FORCE_INLINE float mean() const { return (f00 + f10 + f01 + f11) / 4; }
    /// A point of the unit square with density eval / mean. Needs values >= 0; u itself if all are 0.
    STROBE_FORCE_INLINE V2f sample(const V2f& u) const {
        const float y = sampleLinear(u.y, f00 + f10, f01 + f11);
        return {sampleLinear(u.x, lerp(f00, f01, y), lerp(f10, f11, y)), y};
    }
    V2f inverse(const V2f& p) const;
    float pdf(const V2f& p) const { return eval(p) / mean(); }
};

/// The weight of a sample drawn from f (one of nf) beside ng from g: Veach and Guibas' power heuristic with
/// exponent 2. An infinite fPdf (delta) weighs 1.
inline float powerHeuristic(float nf, float fPdf, float ng, float gPdf) {
    if (!(fPdf > 0))
        return 0;
    const float ratio = (ng * gPdf) / (nf * fPdf); // a ratio cannot overflow where squares would
    return 1 / (1 + ratio * ratio);
}

/// The index i with cdf[i] <= u < cdf[i+1], for an ascending cdf of n+1 values from 0 to its last: never an
/// empty interval, unless all are.
uint32_t findInterval(const float* cdf, uint32_t n, float u);

/// For findInterval from a place nearby: guide[g] is the interval of u = g/n. Ascending, so well-spread
/// numbers stay well spread.
void makeGuide(const float* cdf, uint32_t n, uint32_t* guide);
/// findInterval, in constant time on average over u.
inline uint32_t findGuided(const float* cdf, const uint32_t* guide, uint32_t n, float u) {
    uint32_t i = guide[std::min(uint32_t(u * float(n)), n - 1)];
    while (i > 0 && cdf[i] > u) // u * n was rounded up
        --i;
    while (i + 1 < n && cdf[i + 1] <= u)
        ++i;
    return i;
}

/// A density on [0,1) that is constant on each of n equal cells, or the n outcomes themselves. Samples take
/// constant time.
class Piecewise1D {
  public:
    Piecewise1D() = default;
    /// `values` >= 0 and finite. If all are zero, integral() is 0 and the density uniform.
    explicit Piecewise1D(const std::vector<float>& values);

    uint32_t count() const { return static_cast<uint32_t>(m_values.size()); }
    /// The mean of the values, which is the integral over [0,1).
    float integral() const { return m_integral; }
    /// Outcome i with probability `probability(i)`; u in [0,1) is replaced by a fresh number when asked for.
    uint32_t sampleIndex(float u, float* remapped = nullptr) const;
    float probability(uint32_t i) const { return m_values[i] / count(); }
    float sample(float u) const;
    /// Density at x in [0,1), per length.
    float pdf(float x) const;
    float inverse(float x) const;

  private:
    std::vector<float> m_values; ///< scaled to a mean of 1
    std::vector<float> m_cdf;    ///< count()+1 values from 0 to 1
    std::vector<uint32_t> m_guide;
    float m_integral = 0;
};

/// A density on [0,1)² that is constant on each of nx * ny equal cells (row-major, y down the rows).
class Piecewise2D {
  public:
    Piecewise2D() = default;
    /// `values` >= 0 and finite. If all are zero, integral() is 0 and the density uniform.
    Piecewise2D(const std::vector<float>& values, uint32_t nx, uint32_t ny);

    uint32_t nx() const { return m_nx; }
    uint32_t ny() const { return m_rows.count(); }
    /// The mean of the values.
    float integral() const { return m_rows.integral(); }
    V2f sample(const V2f& u) const;
    /// The same: the cell, and where in it, in [0,1)².
    struct CellSample {
        uint32_t x, y;
        V2f offset;
    };
    CellSample sampleCell(const V2f& u) const;
    /// The same for u 0 … n-1: none waits for the memory of another.
    void sampleCellSoA(const V2SoA& u, int n, CellSample* out) const;
    /// Density at p in [0,1)², per area.
    float pdf(const V2f& p) const;
    V2f inverse(const V2f& p) const;

  private:
    CellSample placeIn(uint32_t y, float fy, float u) const;
    const float* cdfRow(uint32_t y) const { return &m_cdf[size_t(y) * (m_nx + 1)]; }
    uint32_t m_nx = 0;
    Piecewise1D m_rows;
    std::vector<float> m_cdf;      ///< per row nx+1 values from 0 to 1
    std::vector<uint32_t> m_guide; ///< per row nx
    std::vector<float> m_values;   ///< scaled to a mean of 1
};

/// A density on [0,1] interpolated linearly between n+1 equidistant nodes, with a guide table: sampling
/// takes constant time.
class PiecewiseLinear1D {
  public:
    PiecewiseLinear1D() = default;
    /// `nodes`: at least two, >= 0, not all zero.
    explicit PiecewiseLinear1D(const std::vector<float>& nodes);
    /// The integral of the nodes as given.
    float integral() const { return m_integral; }
    float sample(float u) const;
    float pdf(float x) const;
    float inverse(float x) const;

  private:
    std::vector<float> m_nodes; ///< scaled to an integral of 1
    std::vector<float> m_cdf;   ///< at the nodes
    std::vector<uint32_t> m_guide;
    float m_integral = 0;
};

} // namespace strobe
