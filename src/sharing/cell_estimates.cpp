#include "sharing/cell_estimates.h"

#include "core/util/parallel.h"
#include "sharing/light_fit.h"

namespace strobe {

using namespace light_fit;

namespace {

constexpr float kFitRadius = 2; ///< of a fit, in edges of its cells
/// Fits from this scale on are moved towards wider ones, of up to kAllScales. Moving narrower fits, too, has
/// 1 % more error (measured).
constexpr int kFirstShrunk = 1, kAllScales = kFitScales + 2;

/// The estimates of several parts of the light at once.
template <int kPartCount>
class CellEstimator {
  public:
    static constexpr int kPartChannels = NodeLight::kChannels, kChannels = kPartCount * kPartChannels;

    /// `estimates`: by part; those of other parts are not used.
    CellEstimator(const CellPyramid& pyramid, const LightPart (&parts)[kPartCount], CellEstimates& estimates)
        : m_pyramid(pyramid), m_parts(parts), m_estimates(estimates) {
        for (int scale = 0; scale < kAllScales; ++scale)
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
        if (node != last.node) {
            NormalEquations<kChannels> equations;
            last.fit = fitNode(node, last.neighbors, equations);
            if (scale >= kFirstShrunk && scale + 1 < kAllScales && equations.hasPoints())
                shrink(scale, node, equations, last.fit);
        }
        last.node = node;
        return last.fit;
    }
    /// Moves the fit of a node towards that of the next scale.
    void shrink(int scale, uint32_t node, const NormalEquations<kChannels>& equations, Fit& fit) {
        const uint32_t parent = m_pyramid.nodes()[node].parent;
        const Fit wide = frameOf(node).expand(fitOf(scale + 1, parent), frameOf(parent));
        for (int part = 0; part < kPartCount; ++part)
            shrinkTowards(wide, equations, part * kPartChannels, fit);
    }
    FitFrame frameOf(uint32_t node) const {
        const CellNode& center = m_pyramid.nodes()[node];
        return {center, kFitRadius * m_pyramid.edge(center)};
    }
    /// Fits both halves with the same weights: the inverse variances of the difference between both, relative
    /// to the variance of a sample. `equations`: initially without points.
    Fit fitNode(uint32_t index, CellPyramid::Neighbors& neighbors,
                NormalEquations<kChannels>& equations) const {
        constexpr float kMinCosine = 0.7f; // between the normals of points that share
        const CellNode& node = m_pyramid.nodes()[index];
        const FitFrame frame = frameOf(index);
        FitPoints<kChannels> points;
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
                accumulate(points, equations);
                points.count = 0;
            }
            points.weights[points.count] = weight;
            for (int half = 0; half < kHalves; ++half)
                points.counts[half][points.count] = float(other.count[half]);
            float* const row = points.rows[points.count++];
            frame.features(other.p, other.n, row);
            std::fill(copyLight(neighbor, row + kTerms), row + points.kColumns, 0.f);
            kernels += kernel;
            for (int part = 0; part < kPartCount; ++part)
                squares[part] += weight * squaredDifference(row + kTerms + part * kPartChannels);
        }
        const bool hasAllPoints = !equations.hasPoints();
        accumulate(points, equations);
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
    /// first fit and noise explain, such as those beyond the edge of a shadow. `variance`: of a sample.
    void fitWithinEdges(uint32_t index, int part, const FitPoints<kChannels>& points, float variance,
                        float squaredMean, Fit& fit) const {
        const CellNode& node = m_pyramid.nodes()[index];
        EdgeGuide guide{};
        guide.first = part * kPartChannels;
        guide.variance = variance;
        for (int half = 0; half < kHalves; ++half)
            guide.inverseCounts[half] = 1 / std::max(float(node.count[half]), 1.f);
        float light[kChannels];
        copyLight(index, light);
        for (int k = 0; k < kTerms; ++k)
            std::memcpy(&guide.trend[k], (k == 0 ? light : fit.terms[k]) + guide.first,
                        kPartChannels * sizeof(float));
        alignas(64) float weights[kHalves][FitPoints<kChannels>::kMax];
        weighWithinEdges(points, guide, weights);
        for (int half = 0; half < kHalves; ++half) {
            const int channels = guide.first + 3 * half;
            NormalEquations<3> equations;
            accumulateThree(points, weights[half], channels, equations);
            LightFit<3> again;
            equations.solve<3>(0, ridgeOf(equations.rows[0][0], squaredMean, variance), again);
            for (int k = 0; k < kTerms; ++k)
                std::copy_n(again.terms[k], 3, fit.terms[k] + channels);
        }
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
        float features[kTerms];
        frameOf(node).features(cell.p, cell.n, features);
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
