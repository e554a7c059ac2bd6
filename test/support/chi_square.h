// Chi-square tests and reproducible random numbers for tests of sampling code.
#pragma once

#include "core/math/hash.h"
#include "core/math/math.h"

#include <cmath>
#include <vector>

namespace strobe::test {

/// Returns number `index` of a stream of random numbers in [0,1).
inline float random1D(uint64_t stream, uint64_t index) {
    return unitFloat(uint32_t(hashOf(stream, index) >> 32));
}
/// Returns point `index` of a stream of random points in [0,1)².
inline V2f random2D(uint64_t stream, uint64_t index) {
    return {random1D(stream * 2 + 1, index), random1D(stream * 2 + 2, index)};
}

/// Returns the probability that a chi-square variable with `dof` degrees of freedom exceeds x: the
/// regularized upper incomplete gamma function Q(dof/2, x/2), by its series or its continued fraction.
inline double chiSquareTail(double x, double dof) {
    const double a = dof / 2, z = x / 2;
    if (z <= 0)
        return 1;
    const double front = std::exp(a * std::log(z) - z - std::lgamma(a));
    if (z < a + 1) {
        double term = 1 / a, sum = term;
        for (int n = 1; n < 10000 && term > sum * 1e-15; ++n)
            sum += term *= z / (a + n);
        return 1 - front * sum;
    }
    double b = z + 1 - a, c = 1e300, d = 1 / b, h = d;
    for (int n = 1; n < 10000; ++n) {
        const double an = -n * (n - a);
        b += 2;
        d = 1 / (an * d + b);
        c = b + an / c;
        h *= d * c;
        if (std::abs(d * c - 1) < 1e-14)
            break;
    }
    return front * h;
}

/// Returns the p-value of `counts` given the `expected` counts. Bins with fewer than 5 expected counts are
/// pooled. Returns 0 if the pooled bins expect fewer than 5 counts and contain significantly more.
inline double chiSquareP(const std::vector<double>& counts, const std::vector<double>& expected) {
    double sum = 0, pooledCount = 0, pooledExpected = 0;
    int bins = 0;
    for (size_t i = 0; i < counts.size(); ++i) {
        if (expected[i] < 5) {
            pooledCount += counts[i];
            pooledExpected += expected[i];
            continue;
        }
        sum += (counts[i] - expected[i]) * (counts[i] - expected[i]) / expected[i];
        ++bins;
    }
    if (pooledExpected >= 5) {
        sum += (pooledCount - pooledExpected) * (pooledCount - pooledExpected) / pooledExpected;
        ++bins;
    } else if (pooledCount > 12 + 5 * pooledExpected) {
        return 0;
    }
    return chiSquareTail(sum, std::max(bins - 1, 1));
}

} // namespace strobe::test
