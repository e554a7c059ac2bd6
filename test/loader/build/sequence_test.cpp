// Frames built from one description equal frames built from a description each.
#include "support/render_text.h"

#include "loader/parser/content_hash.h"

#include <gtest/gtest.h>

#include <fstream>

namespace strobe {
namespace {

// Static, partly moving, always moving, deforming, mirrored and emissive shapes and instances, with keys from
// 0 to 1: everything that frames may or must not share.
const std::string kScene = R"(
TransformTimes 0 .25 .5 .75 1
Film "image" "integer xresolution" 24 "integer yresolution" 20
Sampler "sobol" "integer pixelsamples" 8
Integrator "directlighting"
ActiveTransform EndTime
Translate .3 0 0
ActiveTransform All
Camera "perspective" "float fov" 60
WorldBegin
LightSource "distant" "point3 from" [1 2 -3] "rgb L" [2 2 2]
ActiveTransform 2
Rotate 20 0 1 0
ActiveTransform All
LightSource "point" "rgb I" [3 2 1] "point3 from" [-2 2 2]
Identity
ObjectBegin "pair"
  Shape "sphere" "float radius" .3
  ActiveTransform 3
  Translate 0 .8 0
  ActiveTransform All
  Shape "trianglemesh" "integer indices" [0 1 2] "point3 P" [0 0 0  .5 0 0  0 .5 .2]
ObjectEnd
Material "matte" "rgb Kd" [.7 .5 .3]
AttributeBegin
  Translate 0 0 6
  Scale -1 1 1
  Shape "trianglemesh" "integer indices" [0 2 1 0 1 3 1 2 3 0 3 2]
    "point3 P" [-.2 -.2 -.2  1.6 .1 -.3  -.1 .5 .1  .3 .2 .7]
AttributeEnd
AttributeBegin
  Translate -1 0 5
  ActiveTransform 1
  Translate 1 .4 0
  ActiveTransform 2
  Rotate 70 1 1 0
  ActiveTransform All
  ObjectInstance "pair"
  Scale 1 -1 1
  Shape "trianglemesh" "integer indices" [0 2 1 0 1 3 1 2 3 0 3 2] "integer keys" 3
    "point3 P" [-.2 -.2 -.2  1.6 .1 -.3  -.1 .5 .1  .3 .2 .7   -.8 -.2 -.2  1.2 .9 -.3  -.1 .5 .1  .3 .2 .7
                -.2 -.9 -.2  1.6 1.1 -.3  -.1 1.5 .1  .3 .2 .7]
AttributeEnd
AttributeBegin
  Translate 1 1 5
  AreaLightSource "diffuse" "rgb L" [4 5 6]
  Shape "sphere" "float radius" .2
  ActiveTransform 4
  Translate 0 -1 0
  ActiveTransform All
  Shape "trianglemesh" "integer indices" [0 1 2] "point3 P" [0 0 0  .5 0 0  0 .5 .2]
AttributeEnd
)";

SceneDescription parsed(const std::string& text) {
    Diagnostics quiet;
    return parseText(text, "test.scene", {"supersample"}, quiet);
}

bool equal(const Image& a, const Image& b) {
    return a.width == b.width && a.height == b.height &&
           std::equal(a.pixels.begin(), a.pixels.end(), b.pixels.begin());
}

// Shutters between keys, across keys, before the first, after the last, of zero length, and repeated.
const Shutter kShutters[] = {{0, .1f}, {.2f, .55f}, {-2, -1}, {.9f, 3}, {2, 3}, {.4f, .4f}, {0, 1}, {0, .1f}};

TEST(Sequence, FramesOfOneBuilderEqualThoseOfSeparateBuilders) {
    Diagnostics quiet;
    SceneBuilder builder(parsed(kScene), {}, quiet);
    std::vector<Image> frames;
    for (const Shutter& shutter : kShutters) {
        BuildOptions options;
        options.shutter = shutter;
        const Image expected = test::render(test::build(kScene, options)).image;
        frames.push_back(test::render(builder.build(shutter)).image);
        EXPECT_TRUE(equal(frames.back(), expected)) << shutter.open << " to " << shutter.close;
    }
    EXPECT_TRUE(equal(frames.front(), frames.back()));
    for (size_t i = 1; i + 1 < frames.size(); ++i)
        for (size_t k = 0; k < i; ++k)
            EXPECT_FALSE(equal(frames[i], frames[k])) << i << ' ' << k;
}

TEST(Sequence, ScenesOutliveTheBuilderAndOneAnother) {
    std::vector<BuiltScene> scenes;
    Image expected;
    {
        Diagnostics quiet;
        SceneBuilder builder(parsed(kScene), {}, quiet);
        expected = test::render(builder.build(kShutters[1])).image;
        for (const Shutter& shutter : kShutters)
            scenes.push_back(builder.build(shutter));
    }
    EXPECT_TRUE(equal(test::render(scenes[1]).image, expected));
}

TEST(Sequence, MotionIsConstantBeyondTheKeys) {
    BuildOptions before, first, after, last;
    before.shutter = {-7, -6};
    first.shutter = {0, 0};
    after.shutter = {5, 9};
    last.shutter = {1, 1};
    EXPECT_EQ(test::build(kScene, before).scene->tracer().counts().timeSteps, 0u);
    EXPECT_TRUE(equal(test::render(test::build(kScene, before)).image,
                      test::render(test::build(kScene, first)).image));
    EXPECT_TRUE(
        equal(test::render(test::build(kScene, after)).image, test::render(test::build(kScene, last)).image));
}

TEST(Sequence, StaticMeshesAreSharedByAllFrames) {
    Diagnostics quiet;
    SceneBuilder builder(parsed(kScene), {}, quiet);
    const BuiltScene a = builder.build({0, .1f}), b = builder.build({.5f, .6f});
    const auto mesh = [](const BuiltScene& built) {
        return built.scene->groups()[0].geometries[0].placed.shape.mesh;
    };
    ASSERT_TRUE(mesh(a));
    EXPECT_EQ(mesh(a), mesh(b));
    EXPECT_EQ(a.scene->materials(), b.scene->materials());
    EXPECT_EQ(a.scene->lights()[0], b.scene->lights()[0]);
    EXPECT_NE(a.scene->lights()[1], b.scene->lights()[1]); // it moves
}

TEST(ContentHash, ChangesWithTextsAndFilesOfParameters) {
    const std::filesystem::path folder =
        std::filesystem::path(testing::TempDir()) / ("content-hash-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
    const auto write = [&](const char* name, const std::string& text) {
        std::ofstream(folder / name) << text;
    };
    const auto hash = [&] {
        Diagnostics quiet;
        return contentOf(parseFiles({folder / "a.scene"}, {"supersample"}, quiet)).hash;
    };
    write("mesh.ply", "ply");
    write("b.scene", R"(Shape "plymesh" "string filename" "mesh.ply"
)");
    write("a.scene", R"(Film "image" "string filename" "out.exr"
WorldBegin
Include "b.scene"
)");
    const uint64_t first = hash();
    EXPECT_EQ(hash(), first);
    write("out.exr", "output files are not part of the scene");
    EXPECT_EQ(hash(), first);
    write("mesh.ply", "ply of another size");
    const uint64_t second = hash();
    EXPECT_NE(second, first);
    write("b.scene", R"(Shape "plymesh" "string filename" "mesh.ply" #
)");
    EXPECT_NE(hash(), second);
    std::filesystem::remove_all(folder);
}

} // namespace
} // namespace strobe
