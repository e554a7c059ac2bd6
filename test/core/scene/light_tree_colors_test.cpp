#include "core/scene/light_tree_colors.h"

#include "support/chi_square.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace strobe {
namespace {

constexpr int kMaxClasses = LightNode::kWidth;

std::vector<TreeEmitter> emittersOf(const std::vector<Rgb>& intensities) {
    std::vector<TreeEmitter> out(intensities.size());
    for (size_t i = 0; i < out.size(); ++i) {
        out[i].bounds.setIntensity(intensities[i]);
        out[i].index = uint32_t(i);
    }
    return out;
}

/// Returns the sum of the squared differences from the mean color, weighted by the intensities.
double deviation(std::span<const TreeEmitter> emitters) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
        double weight = 0, mean = 0;
        for (const TreeEmitter& e : emitters) {
            weight += double(e.bounds.intensity);
            mean += double(e.bounds.intensity * e.bounds.color[c]);
        }
        mean /= weight;
        for (const TreeEmitter& e : emitters)
            sum += double(e.bounds.intensity) * std::pow(double(e.bounds.color[c]) - mean, 2);
    }
    return sum;
}

TEST(LightTreeColors, EqualColorsAreOneClass) {
    std::vector<Rgb> intensities;
    for (int i = 1; i <= 100; ++i)
        intensities.push_back(Rgb(.9f, .5f, .1f) * float(i));
    std::vector<TreeEmitter> emitters = emittersOf(intensities);
    std::span<TreeEmitter> classes[kMaxClasses];
    EXPECT_EQ(divideByColor(emitters, kMaxClasses, classes), 1);
    EXPECT_EQ(classes[0].size(), emitters.size());
}

TEST(LightTreeColors, DistinctColorsAreClasses) {
    const Rgb colors[] = {Rgb(1, 0, 0), Rgb(0, 1, 0), Rgb(0, .1f, 1), Rgb(1)};
    std::vector<Rgb> intensities;
    for (int i = 0; i < 100; ++i)
        intensities.push_back(colors[i % 4] * float(1 + i));
    std::vector<TreeEmitter> emitters = emittersOf(intensities);
    std::span<TreeEmitter> classes[kMaxClasses];
    ASSERT_EQ(divideByColor(emitters, kMaxClasses, classes), 4);
    for (const auto& one : std::span(classes).first(4)) {
        EXPECT_EQ(one.size(), 25u);
        for (const TreeEmitter& e : one)
            EXPECT_EQ(e.index % 4, one.front().index % 4);
    }
}

TEST(LightTreeColors, ClassesPartitionEmittersAndDeviateLess) {
    std::vector<Rgb> intensities;
    for (uint64_t i = 0; i < 1000; ++i)
        intensities.push_back(Rgb(test::random1D(1, i), test::random1D(2, i), test::random1D(3, i)));
    std::vector<TreeEmitter> emitters = emittersOf(intensities);
    const double whole = deviation(emitters);
    double before = whole;
    for (const int count : {2, 4, kMaxClasses}) {
        std::span<TreeEmitter> classes[kMaxClasses];
        ASSERT_EQ(divideByColor(emitters, count, classes), count);
        double sum = 0;
        std::vector<uint32_t> indices;
        for (const auto& one : std::span(classes).first(size_t(count))) {
            sum += deviation(one);
            for (const TreeEmitter& e : one)
                indices.push_back(e.index);
        }
        EXPECT_LT(sum, .8 * before);
        before = sum;
        std::sort(indices.begin(), indices.end());
        std::vector<uint32_t> all(emitters.size());
        std::iota(all.begin(), all.end(), 0u);
        EXPECT_EQ(indices, all);
    }
    EXPECT_LT(before, .35 * whole);
}

} // namespace
} // namespace strobe
