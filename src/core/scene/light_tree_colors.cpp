#include "core/scene/light_tree_colors.h"

#include <algorithm>

namespace strobe {

namespace {

using Range = std::span<TreeEmitter>;

/// Sums over emitters, weighted by their intensities.
struct ColorSums {
    double weight = 0, color[3] = {}, squares[3] = {};

    void add(const EmitterBounds& b) {
        const auto w = double(b.intensity);
        weight += w;
        for (int c = 0; c < 3; ++c) {
            const auto x = double(b.color[c]);
            color[c] += w * x;
            squares[c] += w * x * x;
        }
    }
    void add(const ColorSums& s) {
        weight += s.weight;
        for (int c = 0; c < 3; ++c) {
            color[c] += s.color[c];
            squares[c] += s.squares[c];
        }
    }
    /// Returns the sum of the squared differences from the mean color in a channel.
    double deviation(int c) const { return weight > 0 ? squares[c] - color[c] * color[c] / weight : 0; }
    double deviation() const { return deviation(0) + deviation(1) + deviation(2); }
    int widestChannel() const {
        const double d[3] = {deviation(0), deviation(1), deviation(2)};
        return int(std::max_element(d, d + 3) - d);
    }
};

ColorSums sumsOf(Range range) {
    ColorSums sums;
    for (const TreeEmitter& e : range)
        sums.add(e.bounds);
    return sums;
}

/// Orders the emitters by the value of a channel such that the first part and the rest deviate least from
/// their means, for values that are the ends of bins. Returns the size of the first part.
size_t splitByChannel(Range range, int channel) {
    constexpr int kBins = 16;
    float low = kInfinity, high = -kInfinity;
    for (const TreeEmitter& e : range) {
        low = std::min(low, e.bounds.color[channel]);
        high = std::max(high, e.bounds.color[channel]);
    }
    const auto binOf = [&](const TreeEmitter& e) {
        return std::min(int((e.bounds.color[channel] - low) * (kBins / (high - low))), kBins - 1);
    };
    ColorSums bins[kBins];
    for (const TreeEmitter& e : range)
        bins[binOf(e)].add(e.bounds);
    double above[kBins];
    ColorSums sums;
    for (int i = kBins - 1; i > 0; --i) {
        sums.add(bins[i]);
        above[i] = sums.deviation();
    }
    ColorSums below;
    int best = 1;
    double least = double(kInfinity);
    for (int i = 1; i < kBins; ++i) {
        below.add(bins[i - 1]);
        if (const double deviation = below.deviation() + above[i]; deviation < least) {
            least = deviation;
            best = i;
        }
    }
    const auto end =
        std::partition(range.begin(), range.end(), [&](const TreeEmitter& e) { return binOf(e) < best; });
    return size_t(end - range.begin());
}

} // namespace

int divideByColor(Range emitters, int maxCount, Range* classes) {
    /// The least variance of a class to be divided; colors have a mean square of 1.
    constexpr double kMinVariance = .02;
    std::vector<ColorSums> sums{sumsOf(emitters)};
    classes[0] = emitters;
    while (int(sums.size()) < maxCount) {
        const auto widest =
            std::max_element(sums.begin(), sums.end(), [](const ColorSums& a, const ColorSums& b) {
                return a.deviation() < b.deviation();
            });
        if (!(widest->deviation() > kMinVariance * widest->weight))
            break;
        Range& part = classes[widest - sums.begin()];
        const size_t first = splitByChannel(part, widest->widestChannel());
        classes[sums.size()] = part.subspan(first);
        part = part.first(first);
        *widest = sumsOf(part);
        sums.push_back(sumsOf(classes[sums.size()]));
    }
    return int(sums.size());
}

} // namespace strobe
