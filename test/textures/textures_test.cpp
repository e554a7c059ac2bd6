#include "core/image/texture_cache.h"
#include "textures/checkerboard.h"
#include "textures/constant.h"
#include "textures/imagemap.h"
#include "textures/mix.h"
#include "textures/scale.h"

#include <OpenImageIO/imageio.h>

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <unistd.h>

namespace strobe {
namespace {

using TexturePlugin = Plugin<TexturePtr, const TextureArgs&>;

Param floatParam(const std::string& name, float value) {
    return {name, ParamType::Float, {}, {value}, {}, {}};
}
Param rgbParam(const std::string& name, const Rgb& c) {
    return {name, ParamType::Rgb, {}, {c.x, c.y, c.z}, {}, {}};
}
Param stringParam(const std::string& name, const std::string& v) {
    return {name, ParamType::String, {}, {}, {}, {v}};
}
Param vectorParam(const std::string& name, const V3f& v) {
    return {name, ParamType::Vector3, {}, {v.x, v.y, v.z}, {}, {}};
}
/// A parameter that refers to texture i of the table of TextureFactory.
Param textureParam(const std::string& name, int i) {
    return {name, ParamType::Texture, {}, {}, {i, i}, {"t"}};
}

/// Creates textures, which may refer to textures of a table.
struct TextureFactory {
    std::vector<std::string> warnings;
    Diagnostics diagnostics{[this](const std::string& text) { warnings.push_back(text); }};
    std::shared_ptr<TextureTable> table = std::make_shared<TextureTable>();
    BuildContext context{diagnostics, Conventions::PbrtV4, {0, 1}, std::make_shared<TextureCache>()};

    TexturePtr make(const TexturePlugin& plugin, const std::vector<Param>& params, bool isFloat = false,
                    const M44f& toWorld = {}) {
        ParamSet set;
        for (const Param& p : params)
            set.add(p);
        set.bindTextures(table);
        return plugin.create(set, context, TextureArgs{isFloat, toWorld});
    }
    /// Adds a texture to the table and returns its index.
    int add(const TexturePtr& t) {
        table->floats.push_back(t);
        table->rgbs.push_back(t);
        return int(table->rgbs.size()) - 1;
    }
};

/// Returns a query at (u, v) with a square footprint.
TextureQuery queryAt(float u, float v, float width = 0) {
    TextureQuery q;
    q.uv = V2f(u, v);
    q.p = V3f(u, v, 0);
    q.duvdx = V2f(width, 0);
    q.duvdy = V2f(0, width);
    return q;
}

TEST(Constant, HasTheGivenValue) {
    TextureFactory m;
    const auto rgb = m.make(constantTexturePlugin(), {rgbParam("value", {.1f, .2f, .6f})});
    EXPECT_EQ(rgb->rgb(queryAt(.3f, .4f)), Rgb(.1f, .2f, .6f));
    EXPECT_FLOAT_EQ(rgb->value(queryAt(.3f, .4f)), .3f);
    EXPECT_TRUE(rgb->isConstant() && !rgb->needsFootprint());
    const auto scalar = m.make(constantTexturePlugin(), {floatParam("value", .7f)}, true);
    EXPECT_EQ(scalar->value({}), .7f);
    EXPECT_EQ(scalar->rgb({}), Rgb(.7f));
    EXPECT_EQ(m.make(constantTexturePlugin(), {})->rgb({}), Rgb(1));
    EXPECT_THROW(m.make(constantTexturePlugin(), {rgbParam("value", Rgb(1))}, true), Error);
}

TEST(Scale, MultipliesItsInputs) {
    TextureFactory m;
    const int half = m.add(m.make(constantTexturePlugin(), {floatParam("value", .5f)}, true));
    const auto v2 =
        m.make(scaleTexturePlugin(), {textureParam("tex1", half), rgbParam("tex2", {.2f, .4f, .6f})});
    EXPECT_EQ(v2->rgb({}), Rgb(.1f, .2f, .3f));
    const auto v4 =
        m.make(scaleTexturePlugin(), {rgbParam("tex", {.2f, .4f, .6f}), floatParam("scale", .5f)});
    EXPECT_EQ(v4->rgb({}), Rgb(.1f, .2f, .3f));
    EXPECT_TRUE(v4->isConstant() && v2->isConstant());
}

TEST(Mix, InterpolatesItsInputs) {
    TextureFactory m;
    const auto mix = m.make(mixTexturePlugin(), {rgbParam("tex1", Rgb(0)), rgbParam("tex2", {1, 2, 4}),
                                                 floatParam("amount", .25f)});
    EXPECT_EQ(mix->rgb({}), Rgb(.25f, .5f, 1));
    EXPECT_FLOAT_EQ(m.make(mixTexturePlugin(), {}, true)->value({}), .5f);
}

TEST(Checkerboard, AlternatesWithoutAFootprint) {
    TextureFactory m;
    const auto board =
        m.make(checkerboardTexturePlugin(), {floatParam("uscale", 4), floatParam("vscale", 2)});
    EXPECT_TRUE(board->needsFootprint());
    for (int i = -3; i < 8; ++i)
        for (int j = -3; j < 5; ++j)
            EXPECT_EQ(board->rgb(queryAt((i + .3f) / 4, (j + .7f) / 2)), Rgb((i + j) % 2 ? 0.f : 1.f))
                << i << " " << j;
}

TEST(Checkerboard, IsBoxFilteredOverTheFootprint) {
    TextureFactory m;
    const auto board =
        m.make(checkerboardTexturePlugin(), {rgbParam("tex1", {1, 0, 2}), rgbParam("tex2", Rgb(0))});
    for (const auto& [u, v, width] :
         {std::tuple{.2f, .7f, .3f}, {.9f, 5.1f, .5f}, {-.1f, .05f, 1.3f}, {.4f, 1, 7.7f}}) {
        constexpr int kN = 400;
        double mean = 0;
        for (int i = 0; i < kN * kN; ++i)
            mean += board
                        ->rgb(queryAt(u + width * ((i % kN + .5f) / kN - .5f),
                                      v + width * ((i / kN + .5f) / kN - .5f)))
                        .x;
        const Rgb c = board->rgb(queryAt(u, v, width));
        EXPECT_NEAR(c.x, mean / kN / kN, .004);
        EXPECT_FLOAT_EQ(c.z, 2 * c.x);
        EXPECT_EQ(c.y, 0);
    }
    EXPECT_NEAR(board->rgb(queryAt(.3f, .3f, 1000)).x, .5f, 1e-3f);
    EXPECT_NEAR(board->rgb(queryAt(.3f, .3f, 1e-3f)).x, 1, 0); // within one square: exactly its value
}

TEST(Checkerboard, NeedsAFootprintOnlyIfFiltered) {
    TextureFactory m;
    EXPECT_FALSE(m.make(checkerboardTexturePlugin(), {stringParam("aamode", "none")})->needsFootprint());
    EXPECT_FALSE(m.make(checkerboardTexturePlugin(), {rgbParam("tex2", Rgb(1))})->needsFootprint());
    EXPECT_TRUE(m.make(checkerboardTexturePlugin(), {rgbParam("tex2", Rgb(1))})->isConstant());
}

TEST(Checkerboard, PlanarMappingIsInWorldSpaceInPbrtV2AndInTextureSpaceOtherwise) {
    TextureFactory m;
    M44f shift;
    shift.translate(V3f(1, 0, 0));
    const std::vector<Param> params{stringParam("mapping", "planar"), vectorParam("v1", {2, 0, 0}),
                                    vectorParam("v2", {0, 1, 0}), floatParam("udelta", 1)};
    TextureQuery q;
    q.p = V3f(1.3f, .2f, 9);
    const auto v4 = m.make(checkerboardTexturePlugin(), params, false, shift);
    EXPECT_EQ(v4->rgb(q), Rgb(0)); // s = 1 + 2 * .3
    m.context.pbrtVersion = 2;
    const auto v2 = m.make(checkerboardTexturePlugin(), params, false, shift);
    EXPECT_EQ(v2->rgb(q), Rgb(0)); // s = 1 + 2 * 1.3 = 3.6
    q.p.x = .7f;
    EXPECT_EQ(v2->rgb(q), Rgb(1)); // 2.4
    EXPECT_EQ(v4->rgb(q), Rgb(1)); // .4
    q.p.x = 1.1f;
    EXPECT_EQ(v2->rgb(q), Rgb(0)); // 3.2
    EXPECT_EQ(v4->rgb(q), Rgb(0)); // 1.2
    q.p.x = 1.6f;
    EXPECT_EQ(v2->rgb(q), Rgb(1)); // 4.2
    EXPECT_EQ(v4->rgb(q), Rgb(1)); // 2.2
    q.p.x = .1f;
    EXPECT_EQ(v2->rgb(q), Rgb(0)); // 1.2
    EXPECT_EQ(v4->rgb(q), Rgb(0)); // -.8: odd
}

TEST(Checkerboard, AlternatesInThreeDimensions) {
    TextureFactory m;
    const auto board =
        m.make(checkerboardTexturePlugin(), {Param{"dimension", ParamType::Int, {}, {}, {3}, {}}});
    TextureQuery q;
    q.p = V3f(.5f, .5f, .5f);
    EXPECT_EQ(board->rgb(q), Rgb(1));
    q.p = V3f(.5f, 1.5f, -.5f);
    EXPECT_EQ(board->rgb(q), Rgb(1));
    q.p = V3f(.5f, .5f, -.5f);
    EXPECT_EQ(board->rgb(q), Rgb(0));
    EXPECT_THROW(m.make(checkerboardTexturePlugin(), {Param{"dimension", ParamType::Int, {}, {}, {4}, {}}}),
                 Error);
}

/// An image file of 1 x 2 pixels: red in the first row, and 188 (of 255) in all channels in the second.
class ImageMaps : public testing::Test {
  protected:
    void SetUp() override {
        const auto out = OIIO::ImageOutput::create(m_path.string());
        const uint8_t bytes[6] = {255, 0, 0, 188, 188, 188};
        ASSERT_TRUE(out->open(m_path.string(), OIIO::ImageSpec(1, 2, 3, OIIO::TypeDesc::UINT8)));
        ASSERT_TRUE(out->write_image(OIIO::TypeDesc::UINT8, bytes) && out->close());
    }
    void TearDown() override { std::filesystem::remove(m_path); }
    void writeNoise(int width, int height, int channels) const {
        const auto out = OIIO::ImageOutput::create(m_path.string());
        std::vector<uint16_t> values(size_t(width * height * channels));
        uint32_t state = 1;
        for (uint16_t& v : values)
            v = uint16_t((state = state * 1664525u + 1013904223u) >> 16);
        ASSERT_TRUE(
            out->open(m_path.string(), OIIO::ImageSpec(width, height, channels, OIIO::TypeDesc::UINT16)) &&
            out->write_image(OIIO::TypeDesc::UINT16, values.data()) && out->close());
    }
    TexturePtr make(std::vector<Param> params, bool isFloat = false) {
        params.push_back(stringParam("filename", m_path.string()));
        return m_factory.make(imagemapTexturePlugin(), params, isFloat);
    }
    std::string errorOf(const std::vector<Param>& params) {
        try {
            make(params);
        } catch (const Error& e) {
            return e.what();
        }
        return "no error";
    }
    TextureFactory m_factory;
    std::filesystem::path m_path =
        std::filesystem::temp_directory_path() / ("strobe-map-" + std::to_string(::getpid()) + ".png");
};

TEST_F(ImageMaps, PbrtV4HasTheFirstRowAtOneAndDecodesSrgb) {
    const auto map = make({});
    EXPECT_EQ(map->rgb(queryAt(.5f, .75f)), Rgb(1, 0, 0));
    EXPECT_NEAR(map->rgb(queryAt(.5f, .25f)).x, decodeSrgb(188 / 255.f), 1e-5f);
    EXPECT_NEAR(map->value(queryAt(.5f, .75f)), 1 / 3.f, 1e-6f);
    EXPECT_TRUE(map->needsFootprint());
}

TEST_F(ImageMaps, PbrtV2HasTheFirstRowAtZeroAndLinearValues) {
    m_factory.context.conventions = Conventions::PbrtV2;
    EXPECT_EQ(make({})->rgb(queryAt(.5f, .25f)), Rgb(1, 0, 0));
    EXPECT_NEAR(make({})->rgb(queryAt(.5f, .75f)).x, 188 / 255.f, 1e-5f);
    const auto map = make({floatParam("gamma", 2), floatParam("scale", .5f)});
    EXPECT_NEAR(map->rgb(queryAt(.5f, .75f)).x, std::pow(.5f * 188 / 255, 2), 1e-5f);
}

TEST_F(ImageMaps, ParametersHaveTheirEffect) {
    EXPECT_NEAR(make({stringParam("encoding", "linear")})->rgb(queryAt(.5f, .25f)).x, 188 / 255.f, 1e-5f);
    EXPECT_NEAR(make({stringParam("encoding", "gamma 2")})->rgb(queryAt(.5f, .25f)).x, sqr(188 / 255.f),
                1e-5f);
    EXPECT_NEAR(make({floatParam("scale", 3)})->rgb(queryAt(.5f, .75f)).x, 3, 1e-5f);
    EXPECT_EQ(make({Param{"invert", ParamType::Bool, {}, {}, {1}, {}}})->rgb(queryAt(.5f, .75f)),
              Rgb(0, 1, 1));
    EXPECT_EQ(make({floatParam("vdelta", .5f)})->rgb(queryAt(.5f, .25f)), Rgb(1, 0, 0));
    EXPECT_EQ(make({floatParam("vscale", 3)})->rgb(queryAt(.5f, .25f)), Rgb(1, 0, 0));
    EXPECT_EQ(make({stringParam("wrap", "black")})->rgb(queryAt(.5f, 5)), Rgb(0));
    EXPECT_EQ(make({stringParam("wrap", "clamp")})->rgb(queryAt(.5f, 5)), Rgb(1, 0, 0));
    EXPECT_FALSE(make({stringParam("filter", "bilinear")})->needsFootprint());
    EXPECT_NEAR(make({Param{"gamma", ParamType::Bool, {}, {}, {0}, {}}})->rgb(queryAt(.5f, .25f)).x,
                188 / 255.f, 1e-5f);
}

TEST_F(ImageMaps, EncodingMayBeAColorSpace) {
    const float stored = 188 / 255.f;
    EXPECT_EQ(make({stringParam("encoding", "raw")})->rgb(queryAt(.5f, .25f)).x,
              make({stringParam("encoding", "linear")})->rgb(queryAt(.5f, .25f)).x);
    EXPECT_NEAR(make({stringParam("encoding", "texture_paint")})->rgb(queryAt(.5f, .25f)).x,
                decodeSrgb(stored), 1e-4f);
    const Rgb red = make({stringParam("encoding", "ACEScg")})
                        ->rgb(queryAt(.5f, .75f)); // outside of the gamut of Rec. 709
    EXPECT_NEAR(red.x, 1.705051f, 1e-5f);
    EXPECT_NEAR(red.y, -.130256f, 1e-5f);
    EXPECT_NEAR(red.z, -.024003f, 1e-5f);
}

TEST_F(ImageMaps, FileRulesApplyToColorsWithoutAnEncoding) {
    const std::string config = m_path.string() + ".ocio";
    std::string text = kBuiltinColorConfig;
    text.replace(
        text.find("file_rules:"), 11,
        "file_rules:\n  - !<Rule> {name: maps, pattern: \"*strobe-map*\", extension: png, colorspace: raw}");
    std::ofstream(config) << text;
    m_factory.context.colorConfig = std::make_shared<const ColorConfig>(config);
    const float stored = 188 / 255.f;
    EXPECT_NEAR(make({})->rgb(queryAt(.5f, .25f)).x, stored, 1e-5f);
    EXPECT_NEAR(make({}, true)->rgb(queryAt(.5f, .25f)).x, decodeSrgb(stored), 1e-5f) << "a float texture";
    EXPECT_NEAR(make({stringParam("encoding", "sRGB")})->rgb(queryAt(.5f, .25f)).x, decodeSrgb(stored),
                1e-5f);
    EXPECT_NEAR(make({floatParam("gamma", 2)})->rgb(queryAt(.5f, .25f)).x, sqr(stored), 1e-5f);
    text.replace(text.find("*strobe-map*"), 12, "*another*");
    std::ofstream(config) << text;
    m_factory.context.colorConfig = std::make_shared<const ColorConfig>(config);
    EXPECT_NEAR(make({})->rgb(queryAt(.5f, .25f)).x, decodeSrgb(stored), 1e-5f)
        << "only the default rule matches";
    std::filesystem::remove(config);
}

TEST_F(ImageMaps, SmallImagesInMemoryAgreeWithTheCache) {
    for (const auto& [width, height, channels] :
         {std::tuple{64, 64, 3}, {96, 64, 3}, {50, 31, 3}, {32, 32, 1}}) {
        writeNoise(width, height, channels);
        TextureCache cache;
        const auto file = cache.open(m_path, {});
        std::mt19937 engine(3);
        std::uniform_real_distribution<float> number(0, 1);
        double maxDifference = 0;
        int lookups = 0, differing = 0;
        for (int i = 0; i < 20000; ++i) {
            // Footprints from far below a texel to larger than the image, isotropic to elongated, rotated.
            const float size = std::exp2(-12 + 14 * number(engine)), aspect = std::exp2(-8 * number(engine));
            const float angle = 2 * kPi * number(engine), skew = kPi * number(engine);
            const V2f a = V2f(std::cos(angle), std::sin(angle)) * size;
            const V2f b = V2f(-std::sin(angle), std::cos(angle)) * (size * aspect);
            const V2f dx = a * std::cos(skew) + b * std::sin(skew);
            const V2f dy = b * std::cos(skew) - a * std::sin(skew);
            const V2f uv(4 * number(engine) - 2, 4 * number(engine) - 2);
            const bool isPoint = i % 5 == 0;
            for (const Wrap wrap : {Wrap::Repeat, Wrap::Clamp, Wrap::Black}) {
                const V2f none(0);
                const Rgb result = cache.lookup(*file, uv, isPoint ? none : dx, isPoint ? none : dy, wrap);
                const Rgb expected =
                    cache.lookupFiltered(*file, uv, isPoint ? none : dx, isPoint ? none : dy, wrap);
                double difference = 0;
                for (int c = 0; c < 3; ++c)
                    difference = std::max(difference, double(std::abs(result[c] - expected[c])));
                maxDifference = std::max(maxDifference, difference);
                ++lookups;
                differing += difference > 1e-4;
            }
        }
        // The number of probes of a lookup depends on rounding in rare cases.
        EXPECT_LT(differing, lookups / 5000) << width << " x " << height;
        EXPECT_LT(maxDifference, .02) << width << " x " << height;
    }
}

TEST_F(ImageMaps, RgbSoAEqualsRgb) {
    writeNoise(50, 31, 3);
    TextureFactory factory;
    const int map = factory.add(make({})), other = factory.add(make({floatParam("uscale", 2)}));
    const TexturePtr textures[] = {
        make({}),
        factory.make(scaleTexturePlugin(), {textureParam("tex1", map), rgbParam("tex2", Rgb(.5f, 2, 1))}),
        factory.make(scaleTexturePlugin(), {textureParam("tex1", map), floatParam("tex2", .3f)}),
        factory.make(mixTexturePlugin(),
                     {textureParam("tex1", map), textureParam("tex2", other), textureParam("amount", map)}),
        factory.make(mixTexturePlugin(), {textureParam("tex1", map), floatParam("amount", .3f)}),
        make({floatParam("uscale", 3), floatParam("vdelta", .4f)}),
        make({stringParam("wrap", "clamp"),
              {"invert", ParamType::Bool, {}, {}, {1}, {}},
              floatParam("scale", .5f)}),
        make({stringParam("wrap", "black")}),
        make({stringParam("filter", "point")}),
        make({stringParam("mapping", "planar")})};
    std::mt19937 engine(7);
    std::uniform_real_distribution<float> number(0, 1);
    for (int round = 0; round < 200; ++round) {
        V2SoA uv, dx, dy;
        V3SoA p;
        uint32_t prim[kSoAWidth] = {};
        float barycentrics[kSoAWidth] = {};
        const TextureQuerySoA q{uv, p, dx, dy, prim, barycentrics, barycentrics, p, barycentrics};
        for (int i = 0; i < kSoAWidth; ++i) {
            const float size = i % 9 ? std::exp2(-8 + 10 * number(engine)) : 0;
            const float aspect = number(engine), angle = 2 * kPi * number(engine);
            uv.set(i, {4 * number(engine) - 2, 4 * number(engine) - 2});
            dx.set(i, V2f(std::cos(angle), std::sin(angle)) * size);
            dy.set(i, V2f(-std::sin(angle), std::cos(angle) + .3f) * (size * sqr(sqr(aspect))));
            p.set(i, {uv.x[i], number(engine), uv.y[i]});
        }
        uv.x[5] = 1e12f; // extreme values are looked up by OpenImageIO
        dx.x[6] = 1e5f;
        dy.y[7] = std::nanf("");
        const int begin = round % 7, end = kSoAWidth - round % 50;
        for (const TexturePtr& texture : textures) {
            RgbSoA out;
            texture->rgbSoA(q, begin, end, out);
            for (int i = begin; i < end; ++i) {
                const Rgb expected = texture->rgb(q.at(i)), result = out.at(i);
                EXPECT_EQ(0, std::memcmp(&expected, &result, sizeof expected)) << i;
            }
        }
    }
}

TEST_F(ImageMaps, InvalidParametersAreErrors) {
    EXPECT_EQ(errorOf({stringParam("wrap", "mirror")}),
              "unknown wrap \"mirror\" (known: repeat, black, clamp)");
    EXPECT_EQ(errorOf({stringParam("filter", "box")}),
              "unknown filter \"box\" (known: point, bilinear, trilinear, EWA, ewa)");
    EXPECT_EQ(errorOf({stringParam("encoding", "gamma x")}),
              "\"gamma\" must be followed by a positive number");
    EXPECT_EQ(errorOf({stringParam("encoding", "ACESgc")}),
              "\"encoding\" must be sRGB, linear, \"gamma NUMBER\" or a color space of the built-in "
              "OpenColorIO config: unknown color "
              "space \"ACESgc\"; did you mean \"ACEScg\"? (known: ACES2065-1, ACEScg, ACEScct, lin_rec709, "
              "srgb_texture, raw)");
    EXPECT_NE(errorOf({floatParam("gamma", 0)}).find("positive"), std::string::npos);
    TextureFactory m;
    EXPECT_THROW(m.make(imagemapTexturePlugin(), {}), Error);
}

} // namespace
} // namespace strobe
