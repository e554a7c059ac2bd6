// Meshes that form one surface.
#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

/// Returns the first geometry of the surface of each shape outside of instances.
std::vector<uint64_t> surfacesOf(const std::string& shapes) {
    const BuiltScene built = test::build("WorldBegin\n" + shapes);
    std::vector<uint64_t> out;
    for (uint32_t i = 0; i < built.scene->groups()[0].geometries.size(); ++i) {
        Hit hit{};
        hit.instance = kNone;
        hit.geometry = i;
        out.push_back(built.scene->surfaceIds().of(hit) & 0xffffffff);
    }
    return out;
}

std::string triangle(const std::string& points) {
    return "Shape \"trianglemesh\" \"point P\" [" + points + "]\n";
}
const std::string kFirst = triangle("0 0 0  1 0 0  0 1 0"), kNext = triangle("0 0 0  1 0 0  0 -1 0"),
                  kFar = triangle("5 0 0  6 0 0  5 1 0"), kBetween = triangle("0 1 0  3 3 0  5 0 0");

TEST(SurfaceIds, JoinMeshesWithCommonVertices) {
    EXPECT_EQ(surfacesOf(kFirst + kNext), (std::vector<uint64_t>{0, 0}));
    EXPECT_EQ(surfacesOf(kFirst + kFar), (std::vector<uint64_t>{0, 1}));
    EXPECT_EQ(surfacesOf(kFar + kFirst + kBetween), (std::vector<uint64_t>{0, 0, 0}));
    const std::string moved = "Translate -.5 0 0\n" + triangle(".5 0 0  1.5 0 0  .5 -1 0");
    EXPECT_EQ(surfacesOf(kFirst + moved), (std::vector<uint64_t>{0, 0}));
}

TEST(SurfaceIds, TellMaterialsApart) {
    EXPECT_EQ(surfacesOf("Material \"matte\"\n" + kFirst + "Material \"mirror\"\n" + kNext + kNext),
              (std::vector<uint64_t>{0, 1, 1}));
}

TEST(SurfaceIds, TellOtherShapesAndLightsApart) {
    const std::string sphere = "Shape \"sphere\"\n";
    EXPECT_EQ(surfacesOf(sphere + sphere), (std::vector<uint64_t>{0, 1}));
    const std::string light = "AttributeBegin AreaLightSource \"diffuse\" " + kFirst + "AttributeEnd\n";
    EXPECT_EQ(surfacesOf(kFirst + light + light + kNext), (std::vector<uint64_t>{0, 1, 2, 0}));
}

TEST(SurfaceIds, TellInstancesApart) {
    const std::string text = "WorldBegin\nObjectBegin \"pair\"\n" + kFirst + kNext +
                             "ObjectEnd\nObjectInstance \"pair\"\nTranslate 0 0 3\nObjectInstance \"pair\"\n";
    const BuiltScene built = test::build(text);
    const auto surfaceOf = [&](uint32_t instance, uint32_t geometry) {
        Hit hit{};
        hit.instance = instance;
        hit.geometry = geometry;
        return built.scene->surfaceIds().of(hit);
    };
    ASSERT_EQ(built.scene->instances().size(), 2u);
    EXPECT_EQ(surfaceOf(0, 0), surfaceOf(0, 1));
    EXPECT_NE(surfaceOf(0, 0), surfaceOf(1, 0));
}

} // namespace
} // namespace strobe
