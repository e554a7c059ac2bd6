#include "sharing/pilots/block_chooser.h"

#include <algorithm>
#include <cmath>

namespace strobe {

BlockChooser::BlockChooser(const PairPilot& pairs) : m_pairs(pairs) {
    std::vector<double> noise;
    double noiseSum = 0, rootSum = 0, directRootSum = 0, sum = 0;
    for (size_t i = 0; i < pairs.blocks().factors().size(); ++i)
        if (pairs.pairs(i) > 0) {
            m_blocks.push_back(i);
            noise.push_back(smoothedNoise(i, &BlockNoise::vertex));
            noiseSum += noise.back();
            rootSum += std::sqrt(noise.back());
            directRootSum += std::sqrt(smoothedNoise(i, &BlockNoise::direct));
        }
    if (!noise.empty())
        m_meanNoise = noiseSum / double(noise.size());
    if (rootSum > 0)
        m_gainWithoutIndirect = sqr(rootSum / std::max(directRootSum, 1e-6 * rootSum));
    for (const double value : noise) {
        sum += 1 / double(noise.size());
        if (noiseSum > 0)
            sum += value / noiseSum + std::sqrt(value) / rootSum;
        m_cumulated.push_back(sum);
    }
}

BlockChoice BlockChooser::choose(size_t i) const {
    constexpr double kStep = 0.6180339887498949; // the golden ratio
    const double x = 0.5 + double(i) * kStep, target = (x - std::floor(x)) * m_cumulated.back();
    const auto found = std::upper_bound(m_cumulated.begin(), m_cumulated.end() - 1, target);
    const size_t k = size_t(found - m_cumulated.begin());
    const double probability = m_cumulated[k] - (k > 0 ? m_cumulated[k - 1] : 0);
    return {m_blocks[k], 1 / (double(m_blocks.size()) * probability)};
}

/// Returns the variance of some light of a sample of a block, relative to the radiance.
double BlockChooser::noiseOf(size_t block, BlockNoise::Light BlockNoise::*light) const {
    constexpr double kDark = 0.1; // radiance below which noise does not count as relative
    const BlockNoise &a = m_pairs.noise(0, block), &b = m_pairs.noise(1, block);
    const double pairs = double(m_pairs.pairs(block));
    const double radiance = double(a.radiance + b.radiance) / (PairPilot::kPair * pairs);
    return double((a.*light).clipped + (b.*light).clipped) / (pairs * (sqr(radiance) + sqr(kDark)));
}

/// Returns the mean noise of a block and of its neighbors.
double BlockChooser::smoothedNoise(size_t block, BlockNoise::Light BlockNoise::*light) const {
    double sum = 0, weights = 0;
    m_pairs.forEachNeighbor(block, [&](size_t i, float weight) {
        if (m_pairs.pairs(i) == 0)
            return;
        sum += double(weight) * noiseOf(i, light);
        weights += double(weight);
    });
    return sum / weights;
}

} // namespace strobe
