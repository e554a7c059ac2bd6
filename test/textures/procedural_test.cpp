// Noise, the textures made of it, and mappings of the position.
#include "textures/directionmix.h"
#include "textures/dots.h"
#include "textures/fbm.h"
#include "textures/imagemap.h"
#include "textures/inputs.h"
#include "textures/marble.h"
#include "textures/noise.h"
#include "textures/windy.h"

#include <gtest/gtest.h>

#include <random>

namespace strobe {
namespace {

using TexturePlugin = Plugin<TexturePtr, const TextureArgs&>;

struct Factory {
    Diagnostics diagnostics{[](const std::string&) {}};
    BuildContext context{diagnostics};
    TexturePtr make(const TexturePlugin& plugin, const std::vector<Param>& params = {},
                    const M44f& toWorld = {}) {
        ParamSet set;
        for (const Param& p : params)
            set.add(p);
        return plugin.create(set, context, TextureArgs{false, toWorld});
    }
};

Param number(const char* name, float value) { return {name, ParamType::Float, {}, {value}, {}, {}}; }
Param count(const char* name, int value) { return {name, ParamType::Int, {}, {}, {value}, {}}; }
Param word(const char* name, const char* value) { return {name, ParamType::String, {}, {}, {}, {value}}; }

TextureQuery queryAt(const V3f& p, float width = 0) {
    TextureQuery q;
    q.uv = V2f(p.x, p.y);
    q.p = p;
    q.width = width;
    return q;
}

V3f randomPoint(std::mt19937& random, float range = 100) {
    std::uniform_real_distribution<float> d(-range, range);
    const float x = d(random), y = d(random);
    return {x, y, d(random)};
}

TEST(Noise, IsZeroAtLatticePointsBoundedPeriodicAndWithoutBias) {
    std::mt19937 random(1);
    double sum = 0, squares = 0;
    constexpr int kCount = 20000;
    for (int i = 0; i < kCount; ++i) {
        const V3f p = randomPoint(random);
        const float x = noise(p);
        EXPECT_LE(std::abs(x), 1.05f);
        EXPECT_NEAR(noise(p + V3f(256, 0, -512)), x, 1e-3f);
        EXPECT_EQ(noise({std::floor(p.x), std::floor(p.y), std::floor(p.z)}), 0);
        EXPECT_NEAR(noise(p + V3f(1e-3f, 0, 0)), x, 5e-3f); // continuous
        sum += x;
        squares += sqr(x);
    }
    EXPECT_NEAR(sum / kCount, 0, 5 * std::sqrt(squares / kCount / kCount));
    EXPECT_GT(squares / kCount, .03);
    EXPECT_FALSE(std::isfinite(noise({std::numeric_limits<float>::quiet_NaN(), 0, 0})));
    EXPECT_FALSE(std::isfinite(noise({std::numeric_limits<float>::infinity(), 0, 0})));
}

TEST(Noise, OctavesFadeToTheirMeanAsTheFootprintGrows) {
    std::mt19937 random(2);
    const Octaves octaves{6, .5f};
    double sum = 0;
    constexpr int kCount = 2000;
    for (int i = 0; i < kCount; ++i) {
        const V3f p = randomPoint(random);
        EXPECT_EQ(fbm(p, 10, octaves), 0);
        EXPECT_NEAR(turbulence(p, 10, octaves), .2f * (1 - std::pow(.5f, 6)) / .5f, 1e-6f);
        EXPECT_EQ(fbm(p, .25f, octaves), fbm(p, 0, {1, .5f})); // one octave is left, and none of the next
        EXPECT_NEAR(fbm(p, 0, {2, .5f}), noise(p) + .5f * noise(p * 1.99f), 1e-6f);
        sum += turbulence(p, 0, octaves);
    }
    EXPECT_NEAR(sum / kCount, .2f * (1 - std::pow(.5f, 6)) / .5f, .05f);
}

TEST(ProceduralTextures, AreTheirFormulas) {
    Factory f;
    std::mt19937 random(3);
    M44f scale;
    scale.scale(V3f(2));
    const TexturePtr clouds =
        f.make(fbmTexturePlugin(), {count("octaves", 3), number("roughness", .7f)}, scale);
    const TexturePtr wrinkles = f.make(wrinkledTexturePlugin(), {}, scale);
    const TexturePtr waves = f.make(windyTexturePlugin());
    const TexturePtr stone = f.make(marbleTexturePlugin(), {number("variation", 0)});
    for (int i = 0; i < 100; ++i) {
        const TextureQuery q = queryAt(randomPoint(random), .1f);
        EXPECT_FLOAT_EQ(clouds->value(q), fbm(q.p * .5f, .05f, {3, .7f}));
        EXPECT_EQ(clouds->rgb(q), Rgb(clouds->value(q)));
        EXPECT_FLOAT_EQ(wrinkles->value(q), turbulence(q.p * .5f, .05f, {8, .5f}));
        EXPECT_FLOAT_EQ(waves->value(q), std::abs(fbm(q.p * .1f, .01f, {3, .5f})) * fbm(q.p, .1f, {6, .5f}));
        const Rgb c = stone->rgb(q); // layers along y without a disturbance
        EXPECT_EQ(c, stone->rgb(queryAt({0, q.p.y, 0})));
        EXPECT_LE(maxComponent(c), .9f + 1e-5f);
        EXPECT_GE(c.x, .3f - 1e-5f);
    }
    f.context.pbrtVersion = 3; // v2 and v3 apply the transformation, not its inverse
    const TexturePtr old = f.make(fbmTexturePlugin(), {}, scale);
    EXPECT_FLOAT_EQ(old->value(queryAt({.3f, .4f, .5f})), fbm({.6f, .8f, 1}, 0, {8, .5f}));
    EXPECT_THROW(f.make(fbmTexturePlugin(), {count("octaves", 33)}), Error);
    EXPECT_THROW(f.make(marbleTexturePlugin(), {count("octaves", -1)}), Error);
}

TEST(Dots, AreDisksInTwoFifthsOfTheCellsAndAreSwappedInPbrtFiles) {
    Factory f;
    const TexturePtr dots = f.make(dotsTexturePlugin());
    std::mt19937 random(4);
    double sum = 0;
    constexpr int kCount = 40000;
    f.context.isLenient = true;
    const TexturePtr swapped = f.make(dotsTexturePlugin());
    for (int i = 0; i < kCount; ++i) {
        const TextureQuery q = queryAt(randomPoint(random, 500));
        const float x = dots->value(q);
        EXPECT_TRUE(x == 0 || x == 1);
        EXPECT_EQ(swapped->value(q), 1 - x);
        sum += x;
    }
    EXPECT_NEAR(sum / kCount, kPi * sqr(.35f) * .4, .01);
}

TEST(DirectionMix, IsTheMagnitudeOfTheCosine) {
    Factory f;
    M44f turn;
    turn.rotate(V3f(0, 0, float(M_PI) / 2)); // y becomes -x
    const TexturePtr t = f.make(directionMixTexturePlugin(), {number("tex1", 1), number("tex2", 0)}, turn);
    TextureQuery q;
    q.n = V3f(-3, 0, 0);
    EXPECT_NEAR(t->value(q), 1, 1e-5f);
    q.n = V3f(1, 0, 1);
    EXPECT_NEAR(t->value(q), std::sqrt(.5f), 1e-5f);
    q.n = V3f(0, 1, 0);
    EXPECT_NEAR(t->value(q), 0, 1e-5f);
}

TexturePoint mapped(const char* name, const V3f& p, float width, int version = 4) {
    Factory f;
    f.context.pbrtVersion = version;
    ParamSet params;
    params.add(word("mapping", name));
    M44f shift;
    shift.translate(V3f(1, 0, 0));
    return Mapping2D(params, f.context, TextureArgs{false, shift}).at(queryAt(p + V3f(1, 0, 0), width));
}

TEST(Mapping, SphericalAndCylindricalCoordinates) {
    for (const V3f& p : {V3f(1, 2, 3), V3f(-1, 2, -.5f), V3f(-2, -1, 0), V3f(.5f, -.2f, 4)}) {
        const float r = std::sqrt(length2(p));
        const float phi = std::atan2(p.y, p.x) / (2 * kPi);
        const TexturePoint sphere = mapped("spherical", p, .01f);
        EXPECT_NEAR(sphere.st.x, std::acos(p.z / r) / kPi, 1e-5f);
        EXPECT_NEAR(sphere.st.y, phi < 0 ? phi + 1 : phi, 1e-5f);
        EXPECT_NEAR(sphere.dstdx.x, .01f / r / kPi, 1e-6f); // an arc of a meridian
        EXPECT_NEAR(sphere.dstdy.y, .01f / std::hypot(p.x, p.y) / (2 * kPi), 1e-6f);
        const TexturePoint cylinder = mapped("cylindrical", p, .01f);
        EXPECT_NEAR(cylinder.st.x, phi + .5f, 1e-5f);
        EXPECT_NEAR(cylinder.st.y, p.z, 1e-5f);
        EXPECT_NEAR(cylinder.dstdy.y, .01f, 1e-6f);
        EXPECT_NEAR(mapped("cylindrical", p, .01f, 3).st.y, p.z / r, 1e-5f); // v2 and v3 normalize
    }
    EXPECT_EQ(mapped("spherical", V3f(0), 1).st, V2f(0));
    const TexturePoint plane = mapped("planar", V3f(3, 4, 5), .5f);
    EXPECT_EQ(plane.st, V2f(3, 4));
    EXPECT_EQ(plane.dstdx, V2f(.5f, 0));
    EXPECT_EQ(plane.dstdy, V2f(0, .5f));
    EXPECT_EQ(mapped("planar", V3f(3, 4, 5), .5f, 3).st, V2f(4, 4)); // world space in v2 and v3
    EXPECT_THROW(mapped("cubic", V3f(1), 0), Error);
}

} // namespace
} // namespace strobe
