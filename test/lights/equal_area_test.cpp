#include "lights/equal_area.h"

#include "core/math/sampling.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

TEST(EqualArea, MapsKnownDirections) {
    const auto expectAt = [](const V3f& w, float x, float y) {
        const V2f p = equalAreaPoint(w);
        EXPECT_NEAR(p.x, x, 1e-6f) << w.x << ' ' << w.y << ' ' << w.z;
        EXPECT_NEAR(p.y, y, 1e-6f) << w.x << ' ' << w.y << ' ' << w.z;
    };
    expectAt({0, 0, 1}, .5f, .5f);
    expectAt({1, 0, 0}, 1, .5f);
    expectAt({0, 1, 0}, .5f, 1);
    expectAt({-1, 0, 0}, 0, .5f);
    expectAt({0, -1, 0}, .5f, 0);
    const float h = std::sqrt(.5f);
    expectAt({h, h, 0}, .75f, .75f);
    const V2f below = equalAreaPoint(normalize(V3f(1e-4f, 1e-4f, -1)));
    EXPECT_NEAR(below.x, 1, 1e-3f);
    EXPECT_NEAR(below.y, 1, 1e-3f);
}

TEST(EqualArea, DirectionsAreTheInverse) {
    for (int i = 0; i < 2000; ++i) {
        const V3f w = uniformSphere({(float(i) + .5f) / 2000, float(i % 61) / 61});
        const V3f back = equalAreaDirection(equalAreaPoint(w));
        EXPECT_NEAR(length2(back - w), 0, 1e-9f);
        EXPECT_NEAR(length2(back), 1, 1e-5f);
    }
    const V2f beyond(1.1f, .3f), same(.9f, .7f); // the edge u = 1 is mirrored at (1, 1/2)
    EXPECT_NEAR(length2(equalAreaDirection(beyond) - equalAreaDirection(same)), 0, 1e-10f);
    EXPECT_NEAR(length2(equalAreaDirection({.2f, -.1f}) - equalAreaDirection({.8f, .1f})), 0, 1e-10f);
}

TEST(EqualArea, EqualAreasHaveEqualSolidAngles) {
    constexpr int kSide = 8, kSamples = 512;
    std::vector<int> counts(kSide * kSide);
    for (int i = 0; i < kSamples * kSamples; ++i) {
        const V3f w =
            uniformSphere({(float(i % kSamples) + .5f) / kSamples, (float(i / kSamples) + .5f) / kSamples});
        const V2f p = equalAreaPoint(w);
        ++counts[size_t(std::min(int(p.y * kSide), kSide - 1) * kSide +
                        std::min(int(p.x * kSide), kSide - 1))];
    }
    const double expected = double(kSamples) * kSamples / (kSide * kSide);
    for (const int count : counts)
        EXPECT_NEAR(count / expected, 1, .02);
}

TEST(EqualArea, ResamplingToLatitudeLongitudeKeepsDirections) {
    // The pixels are the components of their directions, which are continuous over all edges.
    constexpr int n = 128;
    Image square{n, n, std::vector<Rgb>(size_t(n * n), Rgb(0))};
    std::vector<int> hits(size_t(n * n));
    constexpr int kSamples = 1 << 20;
    for (int i = 0; i < kSamples; ++i) { // a golden spiral, which hits every pixel, also at the poles
        const double turns = i * 0.6180339887498949;
        const V3f w = uniformSphere({(float(i) + .5f) / kSamples, float(turns - std::floor(turns))});
        const V2f p = equalAreaPoint(w);
        const size_t pixel = size_t(std::min(int(p.y * n), n - 1) * n + std::min(int(p.x * n), n - 1));
        square.pixels[pixel] += w;
        ++hits[pixel];
    }
    for (size_t i = 0; i < hits.size(); ++i)
        square.pixels[i] = square.pixels[i] / float(std::max(hits[i], 1));
    const Image map = toLatitudeLongitude(square);
    ASSERT_EQ(map.width, 2 * n);
    for (int y = 0; y < map.height; ++y)
        for (int x = 0; x < map.width; ++x) {
            const float phi = (float(x) + .5f) / float(map.width) * 2 * kPi;
            const float theta = (float(y) + .5f) / float(map.height) * kPi;
            const V3f w(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
            EXPECT_LT(length(map.at(x, y) - w), .015f) << x << ' ' << y;
        }
}

} // namespace
} // namespace strobe
