#include "sharing/pilots/pilot_costs.h"

#include <cmath>

namespace strobe {

namespace {

/// The time of a sample whose path has no first vertex, in units of a ray.
constexpr float kMissTime = 0.3f;

/// Densities grow with this power of the error: the mean of 1/2, which gives the least squared error, and
/// 1/3, which gives the least sum of its roots.
constexpr float kErrorPower = 5.f / 12;

/// Returns the cost of a block that has the samples of both `a` and `b`. `rays`: of a sample with a first
/// vertex.
Costs costOf(const BlockNoise& a, const BlockNoise& b, float rays, const PlannedLight& planned) {
    constexpr float kDark = 0.1f;
    const float pairs = a.pairs + b.pairs, samples = PairPilot::kPair * pairs;
    if (pairs == 0)
        return {};
    const float vertices = (a.vertices + b.vertices) / samples;
    const float weight = 1 / (pairs * ((a.radiance + b.radiance) / samples + kDark));
    const BlockNoise::Light &ofA = a.*planned.light, &ofB = b.*planned.light;
    const Float4 errors = {ofA.variance + ofB.variance, ofA.raw + ofB.raw, ofA.clipped + ofB.clipped,
                           planned.otherLeft * (ofA.other + ofB.other)};
    return {weight * errors, kMissTime * (1 - vertices) + rays * vertices};
}

} // namespace

void PilotCosts::Sets::set(int k, const Costs& cost) {
    errors[k] = cost.errors;
    times[k] = cost.time;
    weights[k] = cost.time > 0 ? 1 : 0;
}

void PilotCosts::Sets::add(const Sets& other, float weight) {
    for (int k = 0; k < kSets; ++k)
        errors[k] += weight * other.errors[k];
    times += weight * other.times;
    weights += weight * other.weights;
}

PilotCosts::Sets PilotCosts::costsOf(size_t block) const {
    const BlockNoise &a = m_pilot.noise(0, block), &b = m_pilot.noise(1, block);
    const float rays = m_pilot.rays(block);
    Sets sets;
    sets.set(0, costOf(a, {}, rays, m_planned));
    sets.set(1, costOf({}, b, rays, m_planned));
    sets.set(kWhole, costOf(a, b, rays, m_planned));
    return sets;
}

/// Sums the costs of a row over neighbors in the row. `costs`: scratch.
void PilotCosts::smoothRow(size_t y, Row& costs, Row& out) const {
    for (size_t x = 0; x < m_columns; ++x)
        costs[x] = costsOf(y * m_columns + x);
    for (size_t x = 0; x < m_columns; ++x) {
        Sets sums;
        sums.add(costs[x], 2);
        if (x > 0)
            sums.add(costs[x - 1], 1);
        if (x + 1 < m_columns)
            sums.add(costs[x + 1], 1);
        out[x] = sums;
    }
}

BlockCost PilotCosts::meanOf(const Sets& sums, int k) {
    BlockCost mean;
    if (sums.weights[k] > 0) {
        const float scale = 1 / sums.weights[k];
        mean.errors = scale * sums.errors[k];
        mean.time = scale * sums.times[k];
    }
    if (mean.errors[kPlanned] > 0)
        mean.logDensity =
            kErrorPower * std::log2(mean.errors[kPlanned]) - (1 - kErrorPower) * std::log2(mean.time);
    return mean;
}

} // namespace strobe
