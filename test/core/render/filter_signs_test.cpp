// Samples in the negative lobes of filters.
#include "core/math/filter_signs.h"
#include "core/render/passes.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

using namespace std::chrono_literals;

TEST(FilterSigns, NegativeSamplesAreTheirFractionRoundedDown) {
    for (const float fraction : {0.f, 0.064f, 0.2f, 0.45f}) {
        const FilterSigns signs(fraction);
        EXPECT_EQ(signs.hasNegative(), fraction > 0);
        uint32_t negative = 0;
        for (uint32_t sample = 0; sample < 5000; ++sample) {
            negative += signs.isNegative(sample);
            ASSERT_EQ(negative, uint32_t((sample + 1) * double(fraction))) << sample;
        }
    }
}

/// A strip of 1/n of each axis has one of n points of an additive recurrence, or up to three.
TEST(FilterSigns, PointsAreWellDistributed) {
    const FilterSigns signs(0.0625f);
    constexpr uint32_t n = 64;
    for (uint64_t domain = 0; domain < 20; ++domain) {
        int countsX[n] = {}, countsY[n] = {};
        for (uint32_t i = 0; i < n; ++i) {
            const V2f point = signs.point(16 * i + 15, domain);
            ASSERT_TRUE(point.x >= 0 && point.x < 1 && point.y >= 0 && point.y < 1);
            ++countsX[int(point.x * n)];
            ++countsY[int(point.y * n)];
        }
        EXPECT_LE(*std::max_element(countsX, countsX + n), 3);
        EXPECT_LE(*std::max_element(countsY, countsY + n), 3);
        EXPECT_NE(signs.point(15, domain), signs.point(15, domain + 1));
    }
}

/// A white background with a black rectangle from the center of pixel 8 on.
std::string sceneWith(const std::string& filter, bool hasEdge) {
    return R"(
        Film "image" "integer xresolution" 16 "integer yresolution" 4
        Integrator "directlighting"
        Camera "orthographic" "float screenwindow" [-8 8 -2 2]
        PixelFilter ")" +
           filter + R"("
        WorldBegin
        LightSource "infinite" "rgb L" [1 1 1]
        Material "matte" "rgb Kd" [0 0 0]
    )" +
           (hasEdge ? R"(Shape "trianglemesh" "integer indices" [0 1 2 0 2 3]
                        "point P" [.5 -9 1  99 -9 1  99 9 1  .5 9 1])"
                    : "");
}

BuiltScene buildWith(const std::string& filter, const std::string& integrator, int samples, bool hasEdge) {
    BuildOptions options;
    options.integrator = integrator;
    options.samplesPerPixel = samples;
    return test::build(sceneWith(filter, hasEdge), options);
}

TEST(FilterSigns, AWhiteImageHasNoNoise) {
    for (const std::string filter : {"mitchell", "sinc", "gaussian"})
        for (const std::string integrator : {"supersample", "msaa", "adaptive-cache"})
            for (const int samples : {1, 2, 4, 8, 16, 64}) {
                const BuiltScene built = buildWith(filter, integrator, samples, false);
                for (const Rgb& pixel : test::render(built, 5).image.pixels)
                    ASSERT_EQ(pixel, Rgb(1)) << filter << ", " << integrator << ", " << samples;
            }
}

/// Returns the columns of an image with an edge at x = 8.5: the integrals of the filter.
std::vector<double> columnsByQuadrature(const Filter& filter, int width) {
    constexpr int n = 400;
    std::vector<double> columns(static_cast<size_t>(width));
    const V2f r = filter.radius();
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            const V2f offset((2 * (float(i) + .5f) / n - 1) * r.x, (2 * (float(j) + .5f) / n - 1) * r.y);
            const double value = double(filter.eval(offset) * 4 * r.x * r.y) / (n * n);
            for (int x = 0; x < width; ++x)
                if (float(x) + .5f + offset.x < 8.5f)
                    columns[size_t(x)] += value;
        }
    return columns;
}

double columnMean(const Image& image, int x) {
    double sum = 0;
    for (int y = 0; y < image.height; ++y)
        sum += double(image.pixels[size_t(y * image.width + x)].x) / image.height;
    return sum;
}

TEST(FilterSigns, EdgesAreThoseOfTheFilter) {
    for (const std::string filter : {"mitchell", "sinc"}) {
        const BuiltScene built = buildWith(filter, "supersample", 4096, true);
        const std::vector<double> expected = columnsByQuadrature(*built.filter, 16);
        EXPECT_GT(expected[7], 1.01) << "edges overshoot";
        constexpr int kSeeds = 16;
        std::vector<double> columns(16);
        for (int seed = 0; seed < kSeeds; ++seed) {
            const Image image = test::render(built, uint64_t(seed)).image;
            for (int x = 4; x < 12; ++x)
                columns[size_t(x)] += columnMean(image, x) / kSeeds;
        }
        for (int x = 4; x < 12; ++x)
            EXPECT_NEAR(columns[size_t(x)], expected[size_t(x)], 1e-3) << filter << ", " << x;
    }
}

/// Passes of one sample each have negative samples, too.
TEST(FilterSigns, PassesContinueTheNumbersOfSamples) {
    const BuiltScene built = buildWith("mitchell", "supersample", 1, true);
    RenderSettings settings;
    settings.threads = 2;
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds);
    int passes = 0;
    PassGoal goal;
    goal.deadline = PassGoal::Clock::now() + 1h;
    renderPasses(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter,
                 settings, goal, 1, film,
                 [&](const Film&, const RenderStats&) -> std::optional<PassGoal::Clock::time_point> {
                     return PassGoal::Clock::now() + (++passes < 1024 ? 1h : -1h);
                 });
    const FilterSigns signs(built.filter->negativeFraction());
    int64_t weight = 0;
    for (uint64_t sample = 0; sample < 1024; ++sample)
        weight += signs.isNegative(sample) ? -1 : 1;
    for (const PixelAccumulator& sum : film.sums())
        EXPECT_EQ(sum.weight(), weight);
    const std::vector<double> expected = columnsByQuadrature(*built.filter, 16);
    for (int x = 4; x < 12; ++x)
        EXPECT_NEAR(columnMean(film.image(), x), expected[size_t(x)], 0.02) << x;
}

} // namespace
} // namespace strobe
