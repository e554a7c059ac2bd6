#include "sharing/cell_estimates.h"

#include "core/util/parallel.h"

#include <algorithm>

namespace strobe {

namespace {

constexpr float kFitRadius = 2; ///< of a fit, in edges of its cells

/// A point relative to a node: the features of a fit and the weight of the point.
struct FitFrame {
    V3f p, n;
    V3f ps, pt, ns, nt; ///< the tangents, scaled to the derivatives of LightFit
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
struct NormalEquations {
    static constexpr int kTerms = LightFit::kTerms, kChannels = kLightChannels;
    static constexpr int kColumns = 24; ///< features, then channels, then zeros
    static constexpr int kPadding = kColumns - kTerms - kChannels;

    alignas(64) float rows[kTerms][kColumns] = {};

    bool hasPoints() const { return rows[0][0] > 0; }

    /// Adds a point whose row holds its features and its values.
    STROBE_FORCE_INLINE void add(const float* row, float weight) {
        for (int a = 0; a < kTerms; ++a) {
            const float wa = weight * row[a];
            for (int c = 0; c < kColumns; ++c)
                rows[a][c] += wa * row[c];
        }
    }
    /// Solves the equations by Cholesky decomposition. The ridge keeps derivatives small that the points do
    /// not determine; it is relative to the total weight.
    LightFit solve() {
        constexpr float kRidge[kTerms] = {0, 0.02f, 0.02f, 0.05f, 0.05f};
        const float total = rows[0][0];
        LightFit fit{};
        if (!(total > 0))
            return fit;
        float inverse[kTerms]; // of the diagonal
        for (int a = 0; a < kTerms; ++a) {
            rows[a][a] += kRidge[a] * total;
            for (int b = 0; b <= a; ++b) {
                float sum = rows[a][b];
                for (int k = 0; k < b; ++k)
                    sum -= rows[a][k] * rows[b][k];
                rows[a][b] = sum * (a == b ? 1 : inverse[b]);
            }
            inverse[a] = 1 / std::sqrt(std::max(rows[a][a], 1e-12f * total));
            rows[a][a] *= inverse[a];
        }
        for (int c = 0; c < kChannels; ++c)
            substitute(inverse, c, fit);
        return fit;
    }

  private:
    void substitute(const float* inverse, int c, LightFit& fit) const {
        float x[kTerms];
        for (int a = 0; a < kTerms; ++a) {
            x[a] = rows[a][kTerms + c];
            for (int k = 0; k < a; ++k)
                x[a] -= x[k] * rows[a][k];
            x[a] *= inverse[a];
        }
        for (int a = kTerms - 1; a >= 0; --a) {
            for (int k = a + 1; k < kTerms; ++k)
                x[a] -= x[k] * rows[k][a];
            x[a] *= inverse[a];
            fit.terms[a][c] = x[a];
        }
    }
};

/// The points of a fit, by point.
struct FitPoints {
    static constexpr int kMax = 256;
    alignas(64) float rows[kMax][NormalEquations::kColumns];
    float weights[kMax];
    int count = 0;
};

STROBE_TARGET_CLONES void accumulate(const FitPoints& points, NormalEquations& out) {
    for (int i = 0; i < points.count; ++i)
        out.add(points.rows[i], points.weights[i]);
}

/// Fits both halves with the same weights: the inverse variances of the difference between both.
LightFit fitNode(const CellPyramid& pyramid, const CellNode& node) {
    constexpr float kMinCosine = 0.7f; // between the normals of points that share
    const FitFrame frame(node, kFitRadius * pyramid.edge(node));
    FitPoints points;
    NormalEquations equations;
    pyramid.forNeighbors(node, [&](uint32_t index) {
        const CellNode& other = pyramid.nodes()[index];
        const float weight =
            frame.kernel(other.p) * (other.count[0] * other.count[1] / (other.count[0] + other.count[1]));
        if (!(weight > 0) || dot(node.n, other.n) < kMinCosine)
            return;
        if (points.count == FitPoints::kMax) {
            accumulate(points, equations);
            points.count = 0;
        }
        points.weights[points.count] = weight;
        float* row = points.rows[points.count++];
        frame.features(other.p, other.n, row);
        row += LightFit::kTerms;
        row = std::copy(std::begin(other.light), std::end(other.light), row);
        std::fill(row, row + NormalEquations::kPadding, 0.f);
    });
    accumulate(points, equations);
    LightFit fit = equations.solve();
    if (!equations.hasPoints())
        std::copy(std::begin(node.light), std::end(node.light), fit.terms[0]);
    return fit;
}

/// The fit of the node that was asked for last. Consecutive cells of CellPyramid::cellsByNode have the same.
class LastFit {
  public:
    const LightFit& of(const CellPyramid& pyramid, uint32_t node) {
        if (node != m_node) {
            m_node = node;
            m_fit = fitNode(pyramid, pyramid.nodes()[node]);
        }
        return m_fit;
    }

  private:
    uint32_t m_node = ~0u;
    LightFit m_fit;
};

CellEstimate estimateCell(const CellPyramid& pyramid, const CellNode& cell, LastFit (&fits)[kFitScales]) {
    CellEstimate out;
    out.set(0, cell.light);
    uint32_t ancestor = cell.parent;
    for (LastFit& last : fits) {
        const LightFit& fit = last.of(pyramid, ancestor);
        const CellNode& node = pyramid.nodes()[ancestor];
        float features[LightFit::kTerms];
        FitFrame(node, kFitRadius * pyramid.edge(node)).features(cell.p, cell.n, features);
        float value[kLightChannels] = {};
        for (int k = 0; k < LightFit::kTerms; ++k)
            for (int c = 0; c < kLightChannels; ++c)
                value[c] += fit.terms[k][c] * features[k];
        out.set(1 + int(&last - fits), value);
        ancestor = node.parent;
    }
    return out;
}

} // namespace

float fitWidth(int scale) { return 2 * kFitRadius * float(2 << scale); }

HugeBuffer<CellEstimate> estimateCells(const CellPyramid& pyramid, std::span<const uint32_t> cellsByNode) {
    constexpr size_t kRun = 512;
    HugeBuffer<CellEstimate> estimates(pyramid.cellCount());
    parallelFor((cellsByNode.size() + kRun - 1) / kRun, [&](size_t run) {
        LastFit fits[kFitScales];
        const size_t first = run * kRun;
        for (const uint32_t cell : cellsByNode.subspan(first, std::min(kRun, cellsByNode.size() - first)))
            estimates[cell] = estimateCell(pyramid, pyramid.nodes()[pyramid.nodeOf(cell)], fits);
    });
    return estimates;
}

} // namespace strobe
