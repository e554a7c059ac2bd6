#include "sharing/cell_estimates.h"

#include "core/util/parallel.h"

#include <algorithm>
#include <cstring>

namespace strobe {

namespace {

constexpr float kFitRadius = 2; ///< of a fit, in edges of its cells
/// The terms of a fit: the value at the node, and the derivatives by two tangents of the position (per radius
/// of the fit) and of the normal.
constexpr int kTerms = 5;

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

/// The points of a fit, by point.
template <int kChannels>
struct FitPoints {
    static constexpr int kMax = 256, kColumns = NormalEquations<kChannels>::kColumns;
    alignas(64) float rows[kMax][kColumns];
    float weights[kMax];
    const CellNode* nodes[kMax];
    int count = 0;
};

/// Adds the points with these weights to the equations.
template <int kChannels>
STROBE_TARGET_CLONES void accumulate(const FitPoints<kChannels>& points, const float* weights,
                                     NormalEquations<kChannels>& out) {
    typedef float Floats __attribute__((vector_size(8 * sizeof(float))));
    constexpr int kVectors = FitPoints<kChannels>::kColumns / 8;
    Floats sums[kTerms][kVectors];
    std::memcpy(sums, out.rows, sizeof sums);
    for (int i = 0; i < points.count; ++i) {
        Floats row[kVectors];
        std::memcpy(row, points.rows[i], sizeof row);
        for (int a = 0; a < kTerms; ++a) {
            const float factor = weights[i] * points.rows[i][a];
            for (int v = 0; v < kVectors; ++v)
                sums[a][v] += factor * row[v];
        }
    }
    std::memcpy(out.rows, sums, sizeof sums);
}

/// The estimates of several parts of the light at once.
template <int kPartCount>
class CellEstimator {
  public:
    static constexpr int kPartChannels = NodeLight::kChannels, kChannels = kPartCount * kPartChannels;

    /// `estimates`: by part; those of other parts are not used.
    CellEstimator(const CellPyramid& pyramid, const LightPart (&parts)[kPartCount], CellEstimates& estimates)
        : m_pyramid(pyramid), m_parts(parts), m_estimates(estimates) {
        for (int scale = 0; scale < kFitScales; ++scale)
            m_fits.push_back({CellPyramid::Neighbors(pyramid), ~0u, {}});
    }

    void estimate(uint32_t cell) {
        const uint32_t node = m_pyramid.nodeOf(cell);
        CellEstimate out[kPartCount];
        float light[kChannels];
        copyLight(node, light);
        set(0, light, out);
        uint32_t ancestor = m_pyramid.nodes()[node].parent;
        for (int scale = 0; scale < kFitScales; ++scale) {
            evaluate(fitOf(scale, ancestor), ancestor, m_pyramid.nodes()[node], light);
            set(1 + scale, light, out);
            ancestor = m_pyramid.nodes()[ancestor].parent;
        }
        for (int i = 0; i < kPartCount; ++i)
            m_estimates.parts[int(m_parts[i])][cell] = out[i];
    }

  private:
    using Fit = LightFit<kChannels>;
    /// The fits of one size.
    struct FitsOfScale {
        CellPyramid::Neighbors neighbors;
        uint32_t node = ~0u; ///< the last one
        Fit fit;
    };

    static void set(int estimate, const float* light, CellEstimate (&out)[kPartCount]) {
        for (int i = 0; i < kPartCount; ++i)
            out[i].set(estimate, light + i * NodeLight::kChannels);
    }
    float* copyLight(uint32_t node, float* out) const {
        for (const LightPart part : m_parts)
            out = std::copy_n(m_pyramid.light(part, node).of, NodeLight::kChannels, out);
        return out;
    }
    /// Returns the fit of a node. Consecutive cells of CellPyramid::cellsByNode have the same.
    const Fit& fitOf(int scale, uint32_t node) {
        FitsOfScale& last = m_fits[size_t(scale)];
        if (node != last.node)
            last.fit = fitNode(node, last.neighbors);
        last.node = node;
        return last.fit;
    }
    /// Fits both halves with the same weights: the inverse variances of the difference between both, relative
    /// to the variance of a sample.
    Fit fitNode(uint32_t index, CellPyramid::Neighbors& neighbors) const {
        constexpr float kMinCosine = 0.7f; // between the normals of points that share
        const CellNode& node = m_pyramid.nodes()[index];
        const FitFrame frame(node, kFitRadius * m_pyramid.edge(node));
        FitPoints<kChannels> points;
        NormalEquations<kChannels> equations;
        float squares[kPartCount] = {}; // of the differences between both halves
        float kernels = 0;
        for (const uint32_t neighbor : neighbors.of(index)) {
            const CellNode& other = m_pyramid.nodes()[neighbor];
            const float kernel = frame.kernel(other.p);
            const float weight =
                kernel * (other.count[0] * other.count[1] / (other.count[0] + other.count[1]));
            if (!(weight > 0) || dot(node.n, other.n) < kMinCosine)
                continue;
            if (points.count == points.kMax) {
                accumulate(points, points.weights, equations);
                points.count = 0;
            }
            points.weights[points.count] = weight;
            points.nodes[points.count] = &other;
            float* const row = points.rows[points.count++];
            frame.features(other.p, other.n, row);
            std::fill(copyLight(neighbor, row + kTerms), row + points.kColumns, 0.f);
            kernels += kernel;
            for (int part = 0; part < kPartCount; ++part)
                squares[part] += weight * squaredDifference(row + kTerms + part * kPartChannels);
        }
        const bool hasAllPoints = !equations.hasPoints();
        accumulate(points, points.weights, equations);
        Fit fit{};
        if (!equations.hasPoints()) {
            copyLight(index, fit.terms[0]);
            return fit;
        }
        for (int part = 0; part < kPartCount; ++part) {
            const float variance = squares[part] / kernels;
            const float squaredMean = squaredMeanOf(equations, part * kPartChannels);
            equations.template solve<kPartChannels>(
                part * kPartChannels, ridgeOf(equations.rows[0][0], squaredMean, variance), fit);
            // Indirect light has few edges, and errors grow by 2 % (measured).
            if (m_parts[part] == LightPart::Direct && hasAllPoints)
                fitWithinEdges(index, part, points, variance, squaredMean, fit);
        }
        return fit;
    }
    /// Fits each half of a part again, with less weight for points that differ from the node by more than the
    /// first fit and noise explain, such as those beyond the edge of a shadow. The light of the other half
    /// decides, so that the noise of a half does not choose its own weights (as in non-local means with cross
    /// filtering: Rousselle et al. 2012). `variance`: of a sample.
    void fitWithinEdges(uint32_t index, int part, const FitPoints<kChannels>& points, float variance,
                        float squaredMean, Fit& fit) const {
        const Fit first = fit;
        float light[kChannels];
        copyLight(index, light);
        const CellNode& node = m_pyramid.nodes()[index];
        for (int half = 0; half < kHalves; ++half) {
            const int other = kHalves - 1 - half, guide = part * kPartChannels + 3 * other;
            const int channels = part * kPartChannels + 3 * half;
            FitPoints<3> ofHalf; // fewer columns
            ofHalf.count = points.count;
            for (int i = 0; i < points.count; ++i) {
                const float* const row = points.rows[i];
                const float noise = variance * (1 / float(points.nodes[i]->count[other]) +
                                                1 / std::max(float(node.count[other]), 1.f));
                const float distance = squaredDistance(row, first, light, guide);
                ofHalf.weights[i] = points.weights[i] * rangeKernel(distance, noise);
                std::copy_n(row, kTerms, ofHalf.rows[i]);
                std::copy_n(row + kTerms + channels, 3, ofHalf.rows[i] + kTerms);
            }
            NormalEquations<3> equations;
            accumulate(ofHalf, ofHalf.weights, equations);
            LightFit<3> again;
            equations.solve<3>(0, ridgeOf(equations.rows[0][0], squaredMean, variance), again);
            for (int k = 0; k < kTerms; ++k)
                std::copy_n(again.terms[k], 3, fit.terms[k] + channels);
        }
    }
    /// Returns the squared distance between the light of a point and that of the node with the trend of the
    /// fit, in three channels from `first` on.
    static float squaredDistance(const float* row, const Fit& fit, const float* nodeLight, int first) {
        float sum = 0;
        for (int c = first; c < first + 3; ++c) {
            float expected = nodeLight[c];
            for (int k = 1; k < kTerms; ++k)
                expected += fit.terms[k][c] * row[k];
            sum += sqr(row[kTerms + c] - expected);
        }
        return sum;
    }
    /// Returns the weight of a point at a squared distance, of which noise explains this much.
    static float rangeKernel(float squaredDistance, float noise) {
        constexpr float kWidth = 0.5f, kMaxExponent = 30, kTiny = 1e-12f;
        const float excess = std::max(squaredDistance - noise, 0.f);
        return std::exp(-std::min(excess / (kWidth * noise + kTiny), kMaxExponent));
    }
    /// Returns the squared difference between the two halves of the light of one part.
    static float squaredDifference(const float* light) {
        float sum = 0;
        for (int c = 0; c < 3; ++c)
            sum += sqr(light[c] - light[3 + c]);
        return sum;
    }
    /// Returns the squared mean light of a part, whose channels start at `first`.
    static float squaredMeanOf(const NormalEquations<kChannels>& equations, int first) {
        const float total = equations.rows[0][0];
        const float* const sums = equations.rows[0] + kTerms + first;
        float squaredMean = 0;
        for (int c = 0; c < 3; ++c)
            squaredMean += sqr((sums[c] + sums[3 + c]) / (2 * total));
        return squaredMean;
    }
    /// Returns the ridge for points with a total weight. `variance`: of a sample. The ridge of the least
    /// expected error is the variance of a sample over the mean square of the derivatives, which are taken to
    /// be as large as the mean light.
    static float ridgeOf(float totalWeight, float squaredMean, float variance) {
        constexpr float kMin = 0.002f; // relative to the total weight, for few samples without noise
        return std::max(kMin * totalWeight, variance / std::max(squaredMean, 1e-20f));
    }
    /// Writes the values of the fit of a node at a cell.
    void evaluate(const Fit& fit, uint32_t node, const CellNode& cell, float (&out)[kChannels]) const {
        const CellNode& center = m_pyramid.nodes()[node];
        float features[kTerms];
        FitFrame(center, kFitRadius * m_pyramid.edge(center)).features(cell.p, cell.n, features);
        std::fill(std::begin(out), std::end(out), 0.f);
        for (int k = 0; k < kTerms; ++k)
            for (int c = 0; c < kChannels; ++c)
                out[c] += fit.terms[k][c] * features[k];
    }

    const CellPyramid& m_pyramid;
    const LightPart (&m_parts)[kPartCount];
    CellEstimates& m_estimates;
    std::vector<FitsOfScale> m_fits; ///< by scale
};

template <int kPartCount>
void estimateParts(const CellPyramid& pyramid, std::span<const uint32_t> cellsByNode,
                   const LightPart (&parts)[kPartCount], CellEstimates& out) {
    for (const LightPart part : parts)
        out.parts[int(part)].resize(pyramid.cellCount());
    constexpr size_t kRun = 512;
    parallelFor((cellsByNode.size() + kRun - 1) / kRun, [&](size_t run) {
        CellEstimator<kPartCount> estimator(pyramid, parts, out);
        const size_t first = run * kRun;
        for (const uint32_t cell : cellsByNode.subspan(first, std::min(kRun, cellsByNode.size() - first)))
            estimator.estimate(cell);
    });
}

} // namespace

float fitWidth(int scale) { return 2 * kFitRadius * float(2 << scale); }

CellEstimates estimateCells(const CellPyramid& pyramid, std::span<const uint32_t> cellsByNode) {
    CellEstimates out;
    if (pyramid.parts() == LightParts::all()) {
        estimateParts(pyramid, cellsByNode, kAllParts, out);
    } else {
        for (const LightPart part : kAllParts)
            if (pyramid.parts().has(part))
                estimateParts<1>(pyramid, cellsByNode, {part}, out);
    }
    return out;
}

} // namespace strobe
