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

TEST(Filters, SamplesFollowTheLobes) {
    constexpr int n = 100000, bins = 20, sub = 24;
    for (const auto& [name, filter, hasNegativeLobes] : filters()) {
        const V2f r = filter->radius();
        for (const float sign : {1.f, -1.f}) {
            if (sign < 0 && !hasNegativeLobes)
                continue;
            std::vector<double> counts(bins * bins), expected(bins * bins);
            for (int i = 0; i < n; ++i) {
                const V2f u = random2D(1, i),
                          offset = sign > 0 ? filter->sample(u) : filter->sampleNegative(u);
                ASSERT_LE(std::abs(offset.x), r.x) << name;
                ASSERT_LE(std::abs(offset.y), r.y) << name;
                const int x = std::min(int((offset.x / r.x + 1) / 2 * bins), bins - 1);
                const int y = std::min(int((offset.y / r.y + 1) / 2 * bins), bins - 1);
                counts[y * bins + x] += 1;
                ASSERT_GT(sign * filter->eval(offset), -1e-3f) << name << " at " << offset;
            }
            double sum = 0;
            for (int y = 0; y < bins; ++y)
                for (int x = 0; x < bins; ++x) {
                    double& cell = expected[y * bins + x];
                    for (int k = 0; k < sub * sub; ++k)
                        cell += std::max(
                            sign * filter->eval({(2 * (x + (k % sub + .5f) / sub) / bins - 1) * r.x,
                                                 (2 * (y + (k / sub + .5f) / sub) / bins - 1) * r.y}),
                            0.f);
                    sum += cell;
                }
            for (double& cell : expected)
                cell *= n / sum;
            EXPECT_GT(chiSquareP(counts, expected), 1e-4) << name << ", sign " << sign;
        }
    }
}

TEST(Filters, SampleSoAEqualsSample) {
    for (const auto& [name, filter, hasNegativeLobes] : filters()) {
        V2SoA u, offset;
        for (int i = 0; i < kSoAWidth; ++i)
            u.set(i, random2D(3, i));
        u.set(0, V2f(0));
        u.set(1, V2f(kOneMinusEpsilon));
        filter->sampleSoA(u, kSoAWidth - 3, offset);
        for (int i = 0; i < kSoAWidth - 3; ++i)
            EXPECT_EQ(filter->sample(u.at(i)), offset.at(i)) << name;
    }
}

TEST(Filters, MomentsAgreeWithQuadrature) {
    constexpr int n = 1 << 20; // points of a rank-1 lattice, whose error is about 1/n
    for (const auto& [name, filter, hasNegativeLobes] : filters()) {
        const Moments exact = integrate(*filter);
        EXPECT_NEAR(exact.mass, 1, 1e-4) << name << ": eval is not normalized";
        const double fraction = filter->negativeFraction();
        EXPECT_NEAR(fraction, (1 - exact.mass / exact.absolute) / 2, 2e-4) << name;
        EXPECT_EQ(fraction > 0, hasNegativeLobes) << name;
        double x = 0, y = 0, xx = 0, yy = 0;
        const auto add = [&](const V2f& offset, double weight) {
            x += weight * offset.x;
            y += weight * offset.y;
            xx += weight * sqr(offset.x);
            yy += weight * sqr(offset.y);
        };
        for (int i = 0; i < n; ++i) {
            const double golden = (i + .5) * 0.61803398874989485;
            const V2f u((float(i) + .5f) / n, float(golden - std::floor(golden)));
            add(filter->sample(u), (1 - fraction) / (1 - 2 * fraction) / n);
            if (hasNegativeLobes)
                add(filter->sampleNegative(u), -fraction / (1 - 2 * fraction) / n);
        }
        const double rx = filter->radius().x, ry = filter->radius().y;
        EXPECT_NEAR(x, 0, 5e-4 * rx) << name;
        EXPECT_NEAR(y, 0, 5e-4 * ry) << name;
        EXPECT_NEAR(xx, exact.xx, 5e-4 * rx * rx) << name;
        EXPECT_NEAR(yy, exact.yy, 5e-4 * ry * ry) << name;
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
