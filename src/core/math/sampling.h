// Warps of the unit square, each with its inverse and its density, and tabulated densities.
//
// Unless stated otherwise, u lies in [0,1)², directions are unit vectors around +z, and densities of
// directions are per solid angle. Disks, hemispheres, cones and spheres are sampled through the concentric
// map of Shirley and Chiu ("A Low Distortion Map Between Disk and Square", 1997), which preserves the
// stratification of u.
#pragma once

#include "core/math/api.h"
#include "core/math/fast_math.h"

#include <vector>

namespace STROBE_API strobe {

/// Returns a point of the unit disk, uniform by area (density 1/π).
STROBE_FORCE_INLINE V2f concentricDisk(const V2f& u) {
    const float a = 2 * u.x - 1, b = 2 * u.y - 1;
    const bool isWide = std::abs(a) > std::abs(b);
    const float r = isWide ? a : b, q = isWide ? b : a;
    const float phi = (kPi / 4) * (r != 0 ? q / r : 0);
    const float major = r * cosQuarter(phi), minor = r * sinQuarter(phi);
    return isWide ? V2f(major, minor) : V2f(minor, major);
}
/// Returns the u for which concentricDisk(u) = p.
V2f concentricDiskInverse(const V2f& p);

/// Returns a direction of the upper hemisphere with density cosθ/π.
STROBE_FORCE_INLINE V3f cosineHemisphere(const V2f& u) {
    const V2f d = concentricDisk(u);
    return {d.x, d.y, safeSqrt(1 - d.x * d.x - d.y * d.y)};
}
inline V2f cosineHemisphereInverse(const V3f& w) { return concentricDiskInverse({w.x, w.y}); }
/// Returns the density of cosineHemisphere; zero below the horizon.
inline float cosineHemispherePdf(float cosTheta) { return std::max(cosTheta, 0.f) * kInvPi; }

/// Returns a direction of the cone around +z with half-angle θmax, uniform by solid angle. The parameter is
/// 1 - cosθmax, in (0,2], which stays accurate for cones so narrow that cosθmax rounds to 1; see oneMinusCos.
STROBE_FORCE_INLINE V3f uniformCone(const V2f& u, float oneMinusCosMax) {
    const V2f d = concentricDisk(u);
    const float x = (d.x * d.x + d.y * d.y) * oneMinusCosMax; // 1 - cosθ
    const float scale = safeSqrt(oneMinusCosMax * (2 - x));   // sinθ divided by the radius of d
    return {d.x * scale, d.y * scale, 1 - x};
}
V2f uniformConeInverse(const V3f& w, float oneMinusCosMax);
/// Returns the density of uniformCone inside the cone.
inline float uniformConePdf(float oneMinusCosMax) { return 1 / (2 * kPi * oneMinusCosMax); }
/// Returns 1 - cosθ given sin²θ, for θ <= 90°, without cancellation.
inline float oneMinusCos(float sin2Theta) { return sin2Theta / (1 + safeSqrt(1 - sin2Theta)); }

/// Returns a direction of the whole sphere, uniform: density 1/(4π).
inline V3f uniformSphere(const V2f& u) { return uniformCone(u, 2); }
inline V2f uniformSphereInverse(const V3f& w) { return uniformConeInverse(w, 2); }
inline constexpr float kUniformSpherePdf = kInvPi / 4;
/// Returns a direction of the upper hemisphere, uniform: density 1/(2π).
inline V3f uniformHemisphere(const V2f& u) { return uniformCone(u, 1); }
inline V2f uniformHemisphereInverse(const V3f& w) { return uniformConeInverse(w, 1); }
inline constexpr float kUniformHemispherePdf = kInvPi / 2;

/// Returns barycentric coordinates x and y of the first two vertices (the third has 1 - x - y), uniform by
/// area over the triangle (Heitz, "A Low-Distortion Map Between Triangle and Square", 2019).
inline V2f uniformTriangle(const V2f& u) {
    if (u.y > u.x)
        return {u.x / 2, u.y - u.x / 2};
    return {u.x - u.y / 2, u.y / 2};
}
V2f uniformTriangleInverse(const V2f& barycentrics);

/// Returns x in [-1,1] with density 1 - |x|; u in [0,1).
float tent(float u);
float tentInverse(float x);
inline float tentPdf(float x) { return std::max(0.f, 1 - std::abs(x)); }

/// Returns x in [0,1) with density proportional to lerp(a, b, x), for a, b >= 0; u in [0,1). Returns u if a
/// and b are both zero.
STROBE_FORCE_INLINE float sampleLinear(float u, float a, float b) {
    const float denominator = a + std::sqrt(lerp(a * a, b * b, u));
    const float x = u * (a + b) / denominator;
    return std::min(denominator > 0 ? x : u, kOneMinusEpsilon);
}
float linearInverse(float x, float a, float b);
inline float linearPdf(float x, float a, float b) { return 2 * lerp(a, b, x) / (a + b); }

/// A function on the unit square: the bilinear interpolation of its values at the corners.
struct Bilinear {
    float f00, f10, f01, f11; ///< f10 is the value at (1,0)
    STROBE_FORCE_INLINE float eval(const V2f& p) const {
        return lerp(lerp(f00, f10, p.x), lerp(f01, f11, p.x), p.y);
    }
    STROBE_FORCE_INLINE float mean() const { return (f00 + f10 + f01 + f11) / 4; }
    /// Returns a point of the unit square with density eval / mean. Precondition: all values are >= 0.
    /// Returns u if all values are 0.
    STROBE_FORCE_INLINE V2f sample(const V2f& u) const {
        const float y = sampleLinear(u.y, f00 + f10, f01 + f11);
        return {sampleLinear(u.x, lerp(f00, f01, y), lerp(f10, f11, y)), y};
    }
    V2f inverse(const V2f& p) const;
    /// Returns the density of `sample` at p, per area.
    float pdf(const V2f& p) const { return eval(p) / mean(); }
};

/// Returns the multiple importance sampling weight of one of nf samples drawn from f, combined with ng
/// samples drawn from g: the power heuristic with exponent 2 (Veach and Guibas 1995). Returns 1 for an
/// infinite fPdf (a delta distribution) and 0 for fPdf = 0.
inline float powerHeuristic(float nf, float fPdf, float ng, float gPdf) {
    if (!(fPdf > 0))
        return 0;
    const float ratio = (ng * gPdf) / (nf * fPdf); // the squares could overflow, the ratio does not
    return 1 / (1 + ratio * ratio);
}

/// Returns the index i with cdf[i] <= u < cdf[i+1], for an ascending cdf of n+1 values, the first of which is
/// 0. Returns an empty interval only if all intervals are empty.
uint32_t findInterval(const float* cdf, uint32_t n, float u);

/// Writes a guide table for findGuided: guide[g] is the interval of u = g/n.
void makeGuide(const float* cdf, uint32_t n, uint32_t* guide);
/// Returns the same index as findInterval for u in [0,1), in constant time on average over u: searches from
/// the entry of the guide table (Chen and Asau 1974). The mapping is monotonic, so it preserves the
/// stratification of u.
inline uint32_t findGuided(const float* cdf, const uint32_t* guide, uint32_t n, float u) {
    uint32_t i = guide[std::min(uint32_t(u * float(n)), n - 1)];
    while (i > 0 && cdf[i] > u) // u * n was rounded up
        --i;
    while (i + 1 < n && cdf[i + 1] <= u)
        ++i;
    return i;
}

/// A piecewise constant density on [0,1) with n cells of equal size, or a discrete distribution of n
/// outcomes. Sampling takes constant time on average.
class Piecewise1D {
  public:
    Piecewise1D() = default;
    /// Precondition: `values` is not empty, and all values are >= 0 and finite. If all are zero, integral()
    /// is 0 and the density is uniform.
    explicit Piecewise1D(const std::vector<float>& values);

    uint32_t count() const { return static_cast<uint32_t>(m_values.size()); }
    /// Returns the mean of the values, which is the integral over [0,1).
    float integral() const { return m_integral; }
    /// Returns i with probability `probability(i)`; u in [0,1). If `remapped` is not null, it receives the
    /// position of u within the interval of i: a uniform random number in [0,1), independent of i.
    uint32_t sampleIndex(float u, float* remapped = nullptr) const;
    float probability(uint32_t i) const { return m_values[i] / count(); }
    /// Returns x in [0,1) with density pdf(x); u in [0,1).
    float sample(float u) const;
    /// Returns the density at x in [0,1), per length.
    float pdf(float x) const;
    float inverse(float x) const;

  private:
    std::vector<float> m_values; ///< scaled to a mean of 1
    std::vector<float> m_cdf;    ///< count()+1 values from 0 to 1
    std::vector<uint32_t> m_guide;
    float m_integral = 0;
};

/// A piecewise constant density on [0,1)² with nx * ny cells of equal size, stored row by row: y is the index
/// of the row.
class Piecewise2D {
  public:
    Piecewise2D() = default;
    /// Precondition: there are nx * ny values, nx and ny are positive, and all values are >= 0 and finite. If
    /// all values are zero, integral() is 0 and the density is uniform.
    Piecewise2D(const std::vector<float>& values, uint32_t nx, uint32_t ny);

    uint32_t nx() const { return m_nx; }
    uint32_t ny() const { return m_rows.count(); }
    /// Returns the mean of the values, which is the integral over [0,1)².
    float integral() const { return m_rows.integral(); }
    /// Returns a point of [0,1)² with density `pdf`; u in [0,1)².
    V2f sample(const V2f& u) const;
    /// A sampled point, as a cell and a position in it.
    struct CellSample {
        uint32_t x, y; ///< indices of the cell
        V2f offset;    ///< position within the cell, in [0,1)²
    };
    /// Returns the point that `sample` returns, in terms of its cell.
    CellSample sampleCell(const V2f& u) const;
    /// Samples points 0 … n-1, n <= kSoAWidth. Same results as sampleCell, to the bit; prefetches the tables,
    /// so that the cache misses of different points overlap.
    void sampleCellSoA(const V2SoA& u, int n, CellSample* out) const;
    /// Returns the density at p in [0,1)², per area.
    float pdf(const V2f& p) const;
    V2f inverse(const V2f& p) const;

  private:
    /// Samples a column from the conditional distribution of row y, with u in [0,1). Returns its cell, with
    /// offset.y = offsetY.
    CellSample sampleColumn(uint32_t y, float offsetY, float u) const;
    const float* cdfRow(uint32_t y) const { return &m_cdf[size_t(y) * (m_nx + 1)]; }
    uint32_t m_nx = 0;
    Piecewise1D m_rows;
    std::vector<float> m_cdf;      ///< nx+1 values from 0 to 1 per row
    std::vector<uint32_t> m_guide; ///< nx entries per row
    std::vector<float> m_values;   ///< scaled to a mean of 1
};

/// A piecewise linear density on [0,1], given by n+1 equidistant nodes. Sampling takes constant time on
/// average (guide table).
class PiecewiseLinear1D {
  public:
    PiecewiseLinear1D() = default;
    /// Precondition: at least two nodes, all >= 0, not all zero.
    explicit PiecewiseLinear1D(const std::vector<float>& nodes);
    /// Returns the integral of the function before normalization.
    float integral() const { return m_integral; }
    /// Returns x in [0,1) with density pdf(x); u in [0,1).
    float sample(float u) const;
    /// Returns the density at x in [0,1), per length.
    float pdf(float x) const;
    float inverse(float x) const;

  private:
    std::vector<float> m_nodes; ///< scaled to an integral of 1
    std::vector<float> m_cdf;   ///< one value per node, from 0 to 1
    std::vector<uint32_t> m_guide;
    float m_integral = 0;
};

} // namespace strobe
