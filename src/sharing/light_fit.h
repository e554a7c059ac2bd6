// Fits of linear functions to the light of points on a surface. Internal to cell_estimates.cpp.
#pragma once

#include "core/math/fast_math.h"
#include "sharing/cell_pyramid.h"

#include <algorithm>
#include <cstring>

namespace strobe::light_fit {

/// The terms of a fit: the value at the node, and the derivatives by two tangents of the position (per radius
/// of the fit) and of the normal.
inline constexpr int kTerms = 5;

/// Several channels of light as linear functions of the position and the normal on a surface.
template <int kChannels>
struct LightFit {
    float terms[kTerms][kChannels];
};

/// A point relative to a node: the features of a fit and the weight of the point.
struct FitFrame {
    V3f p, n;
    V3f ps, pt, ns, nt; ///< the tangents, scaled to the derivatives of the fit
    float inverseRadius2;

    FitFrame(const CellNode& node, float radius) : p(node.p), n(node.n) {
        const Frame frame = Frame::fromNormal(node.n);
        const float inverseRadius = 1 / radius;
        ps = frame.s * inverseRadius;
        pt = frame.t * inverseRadius;
        ns = frame.s * 2.f;
        nt = frame.t * 2.f;
        inverseRadius2 = sqr(inverseRadius);
    }
    void features(const V3f& point, const V3f& normal, float* out) const {
        const V3f dp = point - p, dn = normal - n;
        out[0] = 1;
        out[1] = dot(dp, ps);
        out[2] = dot(dp, pt);
        out[3] = dot(dn, ns);
        out[4] = dot(dn, nt);
    }
    /// Returns a bell of the distance; 0 from √2 radii on.
    float kernel(const V3f& point) const {
        const float u = std::max(1 - length2(point - p) * inverseRadius2 / 2, 0.f);
        return u * u * u;
    }
    /// Returns a fit of another frame as one of this frame: both have the same value at the node, and the
    /// same derivatives by the tangents of this frame.
    template <int kChannels>
    LightFit<kChannels> expand(const LightFit<kChannels>& fit, const FitFrame& of) const {
        const V3f stepS = ps * (1 / inverseRadius2), stepT = pt * (1 / inverseRadius2); // of one feature
        const V3f turnS = ns * 0.25f, turnT = nt * 0.25f;
        float value[kTerms];
        of.features(p, n, value);
        const float byP[2][2] = {{dot(stepS, of.ps), dot(stepS, of.pt)},
                                 {dot(stepT, of.ps), dot(stepT, of.pt)}};
        const float byN[2][2] = {{dot(turnS, of.ns), dot(turnS, of.nt)},
                                 {dot(turnT, of.ns), dot(turnT, of.nt)}};
        LightFit<kChannels> out;
        for (int c = 0; c < kChannels; ++c) {
            float t[kTerms];
            out.terms[0][c] = 0;
            for (int k = 0; k < kTerms; ++k) {
                t[k] = fit.terms[k][c];
                out.terms[0][c] += value[k] * t[k];
            }
            for (int k = 0; k < 2; ++k) {
                out.terms[1 + k][c] = byP[k][0] * t[1] + byP[k][1] * t[2];
                out.terms[3 + k][c] = byN[k][0] * t[3] + byN[k][1] * t[4];
            }
        }
        return out;
    }
};

/// The normal equations of weighted least-squares fits of several channels with equal weights.
template <int kChannels>
struct NormalEquations {
    static constexpr int kColumns = (kTerms + kChannels + 7) / 8 * 8; ///< features, channels, then zeros

    alignas(64) float rows[kTerms][kColumns] = {};

    bool hasPoints() const { return rows[0][0] > 0; }

    /// Solves the equations for some of the channels, kCount from `first` on. The ridge keeps derivatives
    /// small that the points do not determine: it is added to the sums of their squared features.
    template <int kCount>
    void solve(int first, float ridge, LightFit<kChannels>& fit) const {
        const Cholesky factor(*this, ridge);
        float x[kTerms][kCount];
        for (int a = 0; a < kTerms; ++a) {
            std::copy_n(rows[a] + kTerms + first, kCount, x[a]);
            for (int k = 0; k < a; ++k)
                subtract<kCount>(x[k], factor.rows[a][k], x[a]);
            scale<kCount>(factor.inverse[a], x[a]);
        }
        for (int a = kTerms - 1; a >= 0; --a) {
            for (int k = a + 1; k < kTerms; ++k)
                subtract<kCount>(x[k], factor.rows[k][a], x[a]);
            scale<kCount>(factor.inverse[a], x[a]);
            std::copy_n(x[a], kCount, fit.terms[a] + first);
        }
    }

  private:
    /// The Cholesky decomposition of the sums of products of features.
    struct Cholesky {
        float rows[kTerms][kTerms]; ///< lower triangle
        float inverse[kTerms];      ///< of its diagonal

        Cholesky(const NormalEquations& equations, float ridge) {
            const float total = equations.rows[0][0];
            for (int a = 0; a < kTerms; ++a) {
                for (int b = 0; b <= a; ++b) {
                    float sum = equations.rows[a][b] + (a == b && a > 0 ? ridge : 0);
                    for (int k = 0; k < b; ++k)
                        sum -= rows[a][k] * rows[b][k];
                    rows[a][b] = sum * (a == b ? 1 : inverse[b]);
                }
                inverse[a] = 1 / std::sqrt(std::max(rows[a][a], 1e-12f * total));
                rows[a][a] *= inverse[a];
            }
        }
    };

    template <int kCount>
    static void subtract(const float* values, float factor, float* from) {
        for (int c = 0; c < kCount; ++c)
            from[c] -= values[c] * factor;
    }
    template <int kCount>
    static void scale(float factor, float* values) {
        for (int c = 0; c < kCount; ++c)
            values[c] *= factor;
    }
};

/// Moves the channels of one part, from `first` on, towards those of a wider fit in the same frame, which has
/// more bias and less noise: by the fraction with the least expected squared error over the points of the
/// equations (empirical Bayes; Efron and Morris 1973). The differences of both halves give it: they have the
/// same bias and independent noise. Neighboring fits use the same wider one, so that smooth light is averaged
/// over its region.
template <int kChannels>
void shrinkTowards(const LightFit<kChannels>& wide, const NormalEquations<kChannels>& equations, int first,
                   LightFit<kChannels>& fit) {
    constexpr int kPartChannels = NodeLight::kChannels, kRgb = kPartChannels / kHalves;
    float differences[kTerms][kPartChannels];
    for (int k = 0; k < kTerms; ++k)
        for (int c = 0; c < kPartChannels; ++c)
            differences[k][c] = fit.terms[k][first + c] - wide.terms[k][first + c];
    float squares = 0, products = 0; // of the differences of halves; of both halves
    for (int a = 0; a < kTerms; ++a)
        for (int b = 0; b < kTerms; ++b)
            for (int c = 0; c < kRgb; ++c) {
                const float of[kHalves] = {differences[a][c], differences[a][kRgb + c]};
                const float to[kHalves] = {differences[b][c], differences[b][kRgb + c]};
                products += equations.rows[a][b] * of[0] * to[1];
                squares += equations.rows[a][b] * (of[0] - of[1]) * (to[0] - to[1]);
            }
    // The halves are stratified and err in opposite directions: the bias is larger than the products.
    constexpr float kBias = 2;
    const float variance = std::max(squares, 0.f) / 4, bias = kBias * std::max(products, 0.f);
    const float fraction = variance > 0 ? variance / (variance + bias) : 0;
    for (int k = 0; k < kTerms; ++k)
        for (int c = 0; c < kPartChannels; ++c)
            fit.terms[k][first + c] -= fraction * differences[k][c];
}

/// The points of a fit, by point.
template <int kChannels>
struct FitPoints {
    static constexpr int kMax = 256, kColumns = NormalEquations<kChannels>::kColumns;
    alignas(64) float rows[kMax][kColumns];
    alignas(64) float weights[kMax];
    alignas(64) float counts[kHalves][kMax]; ///< of samples
    int count = 0;
};

typedef float Float8 __attribute__((vector_size(8 * sizeof(float))));

STROBE_FORCE_INLINE void load(const float* source, Float8& out) { std::memcpy(&out, source, sizeof out); }

/// Adds the points to the equations.
template <int kChannels>
STROBE_TARGET_CLONES void accumulate(const FitPoints<kChannels>& points, NormalEquations<kChannels>& out) {
    constexpr int kVectors = FitPoints<kChannels>::kColumns / 8;
    Float8 sums[kTerms][kVectors];
    std::memcpy(sums, out.rows, sizeof sums);
    for (int i = 0; i < points.count; ++i) {
        Float8 row[kVectors];
        std::memcpy(row, points.rows[i], sizeof row);
        for (int a = 0; a < kTerms; ++a) {
            const float factor = points.weights[i] * points.rows[i][a];
            for (int v = 0; v < kVectors; ++v)
                sums[a][v] += factor * row[v];
        }
    }
    std::memcpy(out.rows, sums, sizeof sums);
}

/// Writes the sums of the points with other weights to the equations of three of their channels, from
/// `first` on.
template <int kChannels>
STROBE_TARGET_CLONES void accumulateThree(const FitPoints<kChannels>& points, const float* weights, int first,
                                          NormalEquations<3>& out) {
    static_assert(kTerms == 5 && NormalEquations<3>::kColumns == 8);
    Float8 sums[kTerms] = {};
    for (int i = 0; i < points.count; ++i) {
        Float8 features, light; // the channels are behind the features
        load(points.rows[i], features);
        load(points.rows[i] + first, light);
        const Float8 row = __builtin_shufflevector(features, light, 0, 1, 2, 3, 4, 13, 14, 15);
        for (int a = 0; a < kTerms; ++a)
            sums[a] += weights[i] * points.rows[i][a] * row;
    }
    std::memcpy(out.rows, sums, sizeof sums);
}

/// Decides which points are beyond an edge: they differ from a node by more than a trend and noise explain.
struct EdgeGuide {
    Float8 trend[kTerms];         ///< the node's light, then its derivatives: both halves of a part
    int first;                    ///< channel of the part
    float variance;               ///< of a sample
    float inverseCounts[kHalves]; ///< of the node's samples
};

/// Returns the weight of a point at a squared distance, of which noise explains this much.
STROBE_FORCE_INLINE float rangeKernel(float squaredDistance, float noise) {
    constexpr float kWidth = 0.5f, kMaxExponent = 30, kTiny = 1e-12f;
    const float excess = std::max(squaredDistance - noise, 0.f);
    return fastExp(-std::min(excess / (kWidth * noise + kTiny), kMaxExponent));
}

/// Writes the weights of the points for the fits of both halves. The light of the other half decides, so that
/// the noise of a half does not choose its own weights (as in non-local means with cross filtering: Rousselle
/// et al. 2012).
template <int kChannels>
STROBE_TARGET_CLONES void weighWithinEdges(const FitPoints<kChannels>& points, const EdgeGuide& guide,
                                           float (&out)[kHalves][FitPoints<kChannels>::kMax]) {
    alignas(64) float distances[kHalves][FitPoints<kChannels>::kMax];
    for (int i = 0; i < points.count; ++i) {
        Float8 light;
        load(points.rows[i] + kTerms + guide.first, light);
        light -= guide.trend[0];
        for (int k = 1; k < kTerms; ++k)
            light -= guide.trend[k] * points.rows[i][k];
        light *= light;
        distances[0][i] = light[0] + light[1] + light[2];
        distances[1][i] = light[3] + light[4] + light[5];
    }
    for (int half = 0; half < kHalves; ++half) {
        const int other = kHalves - 1 - half;
        STROBE_IVDEP
        for (int i = 0; i < points.count; ++i) {
            const float noise = guide.variance * (1 / points.counts[other][i] + guide.inverseCounts[other]);
            out[half][i] = points.weights[i] * rangeKernel(distances[other][i], noise);
        }
    }
}

} // namespace strobe::light_fit
