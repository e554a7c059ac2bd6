#include "filters/box.h"
#include "filters/gaussian.h"
#include "filters/mitchell.h"
#include "filters/sinc.h"
#include "filters/triangle.h"
#include "support/chi_square.h"
#include "support/params.h"

#include <gtest/gtest.h>

using namespace strobe;
using namespace strobe::test;

namespace {

using FilterPlugin = Plugin<std::shared_ptr<const Filter>>;

std::shared_ptr<const Filter> make(const FilterPlugin& plugin, const ParamSet& params = {},
                                   Conventions conventions = Conventions::PbrtV4) {
    static Diagnostics quiet;
    return plugin.create(params, BuildContext{.diagnostics = quiet, .conventions = conventions});
}

struct NamedFilter {
    std::string name;
    std::shared_ptr<const Filter> filter;
    bool hasNegativeLobes;
};

std::vector<NamedFilter> filters() {
    const auto v2 = Conventions::PbrtV2;
    return {
        {"box", make(boxFilterPlugin()), false},
        {"wide box", make(boxFilterPlugin(), Params().floats("xwidth", {1.5f}).floats("ywidth", {.75f})),
         false},
        {"triangle", make(triangleFilterPlugin(), Params().floats("xradius", {1}).floats("yradius", {3})),
         false},
        {"gaussian", make(gaussianFilterPlugin()), false},
        {"gaussian v2", make(gaussianFilterPlugin(), {}, v2), false},
        {"wide gaussian", make(gaussianFilterPlugin(), Params().floats("alpha", {.001f})), false},
        {"narrow gaussian", make(gaussianFilterPlugin(), Params().floats("alpha", {100})), false},
        {"mitchell", make(mitchellFilterPlugin(), Params().floats("xwidth", {2}).floats("ywidth", {3})),
         true},
        {"catmull-rom", make(mitchellFilterPlugin(), Params().floats("B", {0}).floats("C", {.5f})), true},
        {"sinc", make(sincFilterPlugin()), true},
        {"sinc v2", make(sincFilterPlugin(), {}, v2), true},
    };
}

/// ∫f, ∫|f|, ∫x²f and ∫y²f over the support.
struct Moments {
    double mass = 0, absolute = 0, xx = 0, yy = 0;
};
/// Integrates by the midpoint rule.
Moments integrate(const Filter& filter, int n = 600) {
    const V2f r = filter.radius();
    const double cell = 4.0 * r.x * r.y / (double(n) * n);
    Moments m;
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            const V2f p((2 * (float(i) + .5f) / float(n) - 1) * r.x,
                        (2 * (float(j) + .5f) / float(n) - 1) * r.y);
            const double f = filter.eval(p);
            m.mass += f * cell;
            m.absolute += std::abs(f) * cell;
            m.xx += f * p.x * p.x * cell;
            m.yy += f * p.y * p.y * cell;
        }
    return m;
}

} // namespace

TEST(Filters, SamplesFollowTheAbsoluteValue) {
    constexpr int n = 100000, bins = 20, sub = 24;
    for (const auto& [name, filter, negative] : filters()) {
        const V2f r = filter->radius();
        std::vector<double> counts(bins * bins), expected(bins * bins);
        for (int i = 0; i < n; ++i) {
            const Filter::Sample s = filter->sample(random2D(1, i));
            ASSERT_LE(std::abs(s.offset.x), r.x) << name;
            ASSERT_LE(std::abs(s.offset.y), r.y) << name;
            const int x = std::min(int((s.offset.x / r.x + 1) / 2 * bins), bins - 1);
            const int y = std::min(int((s.offset.y / r.y + 1) / 2 * bins), bins - 1);
            counts[y * bins + x] += 1;
            if (std::abs(filter->eval(s.offset)) > 1e-3f) { // not close to a root
                EXPECT_EQ(s.weight < 0, filter->eval(s.offset) < 0) << name << " at " << s.offset;
            }
            if (!negative) {
                ASSERT_FLOAT_EQ(s.weight, 1) << name;
            }
        }
        double sum = 0;
        for (int y = 0; y < bins; ++y)
            for (int x = 0; x < bins; ++x) {
                double& cell = expected[y * bins + x];
                for (int k = 0; k < sub * sub; ++k)
                    cell += std::abs(filter->eval({(2 * (x + (k % sub + .5f) / sub) / bins - 1) * r.x,
                                                   (2 * (y + (k / sub + .5f) / sub) / bins - 1) * r.y}));
                sum += cell;
            }
        for (double& cell : expected)
            cell *= n / sum;
        EXPECT_GT(chiSquareP(counts, expected), 1e-4) << name;
    }
}

/// Equal steps of the first random number, as of a stratified sampler: the mean weight is 1 within one
/// sample.
TEST(Filters, StrataHaveAsManyNegativeSamplesAsTheyShould) {
    for (const auto& [name, filter, negative] : filters())
        for (const int n : {16, 64, 256})
            for (int pixel = 0; pixel < 100; ++pixel) {
                double sum = 0, absolute = 0;
                for (int i = 0; i < n; ++i) {
                    const V2f u = random2D(pixel, i);
                    const Filter::Sample s = filter->sample({(float(i) + u.x) / float(n), u.y});
                    sum += double(s.weight);
                    absolute += double(std::abs(s.weight));
                }
                ASSERT_NEAR(sum / n, 1, 2.01 * absolute / n / n) << name << ", " << n << " samples";
            }
}

TEST(Filters, SampleSoAEqualsSample) {
    for (const auto& [name, filter, negative] : filters()) {
        V2SoA u, offset;
        float weight[kSoAWidth];
        for (int i = 0; i < kSoAWidth; ++i)
            u.set(i, random2D(3, i));
        u.set(0, V2f(0));
        u.set(1, V2f(kOneMinusEpsilon));
        filter->sampleSoA(u, kSoAWidth - 3, offset, weight);
        for (int i = 0; i < kSoAWidth - 3; ++i) {
            const Filter::Sample s = filter->sample(u.at(i));
            EXPECT_EQ(s.offset, offset.at(i)) << name;
            EXPECT_EQ(s.weight, weight[i]) << name;
        }
    }
}

TEST(Filters, MeanWeightIsOneAndMomentsAgreeWithQuadrature) {
    constexpr int n = 1 << 20; // points of a rank-1 lattice, whose error is about 1/n
    for (const auto& [name, filter, negative] : filters()) {
        const Moments exact = integrate(*filter);
        EXPECT_NEAR(exact.mass, 1, 1e-4) << name << ": eval is not normalized";
        double weight = 0, x = 0, y = 0, xx = 0, yy = 0;
        for (int i = 0; i < n; ++i) {
            const double golden = (i + .5) * 0.61803398874989485;
            const Filter::Sample s =
                filter->sample({(float(i) + .5f) / n, float(golden - std::floor(golden))});
            weight += s.weight;
            x += s.weight * s.offset.x;
            y += s.weight * s.offset.y;
            xx += s.weight * sqr(s.offset.x);
            yy += s.weight * sqr(s.offset.y);
            if (i % 64 == 0) {
                EXPECT_NEAR(std::abs(s.weight), exact.absolute, 2e-3 * exact.absolute) << name;
            }
        }
        const double rx = filter->radius().x, ry = filter->radius().y;
        EXPECT_NEAR(weight / n, 1, 2e-4) << name;
        EXPECT_NEAR(x / n, 0, 5e-4 * rx) << name;
        EXPECT_NEAR(y / n, 0, 5e-4 * ry) << name;
        EXPECT_NEAR(xx / n, exact.xx, 5e-4 * rx * rx) << name;
        EXPECT_NEAR(yy / n, exact.yy, 5e-4 * ry * ry) << name;
    }
}

TEST(Filters, ValuesEqualTheFormulasOfPbrt) {
    // Ratios to the value at the center.
    const auto v2 = Conventions::PbrtV2;
    const auto gaussian = make(gaussianFilterPlugin(), {}, v2);
    EXPECT_EQ(gaussian->radius(), V2f(2));
    const double end = std::exp(-8.0);
    EXPECT_NEAR(gaussian->eval({1, 0}) / gaussian->eval({0, 0}), (std::exp(-2.0) - end) / (1 - end), 1e-6);
    const auto v4 = make(gaussianFilterPlugin());
    EXPECT_EQ(v4->radius(), V2f(1.5f));
    EXPECT_NEAR(v4->eval({1, 0}) / v4->eval({0, 0}), (std::exp(-2.0) - std::exp(-4.5)) / (1 - std::exp(-4.5)),
                1e-6);
    const auto mitchell = make(mitchellFilterPlugin());
    EXPECT_NEAR(mitchell->eval({1, 0}) / mitchell->eval({0, 0}), (1. / 18) / (16. / 18), 1e-6);
    EXPECT_LT(mitchell->eval({1.5f, 0}), 0);
    EXPECT_NEAR(make(boxFilterPlugin())->eval({.49f, -.49f}), 1, 1e-6);
    EXPECT_EQ(make(boxFilterPlugin())->eval({.51f, 0}), 0);
    const auto sinc = make(sincFilterPlugin(), {}, v2);
    EXPECT_NEAR(sinc->eval({2, 0}) / sinc->eval({0, 0}),
                std::sin(M_PI / 2) / (M_PI / 2) * std::sin(M_PI * 1.5) / (M_PI * 1.5), 1e-5);
}

TEST(Filters, ErrorsHaveLocations) {
    EXPECT_EQ(
        errorOffset([] { make(boxFilterPlugin(), Params().floats("xwidth", {1}).floats("ywidth", {0})); }),
        20);
    EXPECT_EQ(errorOffset([] { make(gaussianFilterPlugin(), Params().floats("alpha", {-1})); }), 10);
    EXPECT_EQ(
        errorOffset([] { make(gaussianFilterPlugin(), Params().floats("alpha", {1}).floats("sigma", {1})); }),
        20);
    EXPECT_EQ(errorOffset([] { make(mitchellFilterPlugin(), Params().floats("B", {9})); }), 10);
    EXPECT_EQ(errorOffset([] { make(sincFilterPlugin(), Params().floats("tau", {0})); }), 10);
}
