// Points and lines of glTF files as spheres and tubes.
#include "gltf/import.h"
#include "support/gltf_scene.h"

#include <map>

namespace strobe::test {
namespace {

enum Mode { Points, Lines, LineLoop, LineStrip };

class GltfPoints : public GltfSceneTest {
  protected:
    /// Returns a file of one primitive.
    static GltfFile primitive(Mode mode, const std::vector<float>& positions,
                              const std::vector<uint8_t>& indices = {}) {
        GltfFile file = unlitFile();
        json p = {{"attributes", {{"POSITION", file.addFloats(positions, "VEC3")}}},
                  {"mode", int(mode)},
                  {"material", 0}};
        if (!indices.empty())
            p["indices"] = file.add(indices, "SCALAR", UByte);
        file.addNode({{"mesh", file.addMesh(p)}});
        return file;
    }
    /// Returns the only mesh of the file.
    static TriangleMesh mesh(const GltfFile& file, float radius) {
        GltfFolder folder;
        Diagnostics quiet;
        TextureCache textures;
        gltf::Settings settings;
        settings.pointRadius = radius;
        gltf::Importer importer(gltf::open(folder.write("test.gltf", file.text()), {}), settings, textures,
                                quiet);
        return *importer.takeObjects().at(0).shapes.at(0).mesh;
    }
    /// Returns the enclosed volume. Expects that the mesh is closed: that each edge has a triangle on either
    /// side.
    static float volume(const TriangleMesh& mesh) {
        std::map<std::pair<uint32_t, uint32_t>, int> edges;
        double volume = 0;
        for (size_t i = 0; i < mesh.indices.size(); i += 3) {
            const auto corner = [&](size_t k) { return mesh.indices[i + k % 3]; };
            for (size_t k = 0; k < 3; ++k) {
                ++edges[{corner(k), corner(k + 1)}];
                --edges[{corner(k + 1), corner(k)}];
            }
            const auto p = [&](size_t k) { return mesh.positions[0][corner(k)]; };
            volume += dot(p(0), cross(p(1), p(2))) / 6;
        }
        for (const auto& [edge, count] : edges)
            EXPECT_EQ(count, 0) << edge.first << " " << edge.second;
        return float(volume);
    }
    static float segments(const GltfFile& file, float length) {
        const float tube = kPi * sqr(kRadius) * length + 4 * kPi / 3 * kRadius * sqr(kRadius);
        return volume(mesh(file, kRadius)) / tube;
    }
    static constexpr float kRadius = .1f;
};

TEST_F(GltfPoints, PointsAreSpheres) {
    const TriangleMesh m = mesh(primitive(Points, {1, 2, 3, 4, 5, 6, 9, 9, 9}, {1, 0}), kRadius);
    const float sphere = 4 * kPi / 3 * kRadius * sqr(kRadius);
    EXPECT_NEAR(volume(m), 2 * sphere, .15f * sphere); // inscribed; the third point is not used
    ASSERT_EQ(m.normals.at(0).size(), m.vertexCount());
    const size_t half = m.vertexCount() / 2;
    for (size_t i = 0; i < m.vertexCount(); ++i) {
        const V3f center = i < half ? V3f(4, 5, 6) : V3f(1, 2, 3);
        EXPECT_LT(length(m.positions[0][i] - center - m.normals[0][i] * kRadius), 1e-5f);
    }
}

TEST_F(GltfPoints, LinesAreClosedTubes) {
    const std::vector<float> corners{0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0};
    EXPECT_NEAR(segments(primitive(Lines, corners), 2), 2, .1f);
    EXPECT_NEAR(segments(primitive(LineStrip, corners), 2), 3, .15f);
    EXPECT_NEAR(segments(primitive(LineLoop, corners), 2), 4, .2f);
    EXPECT_NEAR(segments(primitive(Lines, corners, {0, 1, 3}), 2), 1, .05f); // the last one is incomplete
    EXPECT_NEAR(segments(primitive(LineStrip, corners, {2, 2}), 0), 1, .1f); // without length
    EXPECT_NEAR(segments(primitive(Lines, {0, 0, -1, 1e-3f, 2e-3f, 1}), 2), 1, .05f);
}

TEST_F(GltfPoints, ManyAreCoarser) {
    const TriangleMesh few = mesh(primitive(Points, std::vector<float>(3 * 10, .5f)), kRadius);
    const TriangleMesh many = mesh(primitive(Points, std::vector<float>(3 * 5000, .5f)), kRadius);
    EXPECT_LT(many.triangleCount() / 5000, few.triangleCount() / 10 / 4);
    EXPECT_GT(volume(many), 5000 * .7f * 4 * kPi / 3 * kRadius * sqr(kRadius));
}

TEST_F(GltfPoints, TheRadiusIsInUnitsOfTheScene) {
    GltfFile file = primitive(Points, {0, 0, 0});
    file.root["nodes"][2]["scale"] = {10, 10, 10};
    EXPECT_NEAR(length(mesh(file, kRadius).positions[0][0]), kRadius / 10, 1e-6f);
}

TEST_F(GltfPoints, AreOnRequest) {
    GltfFile file = primitive(Points, {0, 0, 0});
    EXPECT_EQ(centerOf(build(file)), 0);
    ASSERT_FALSE(warnings.empty());
    EXPECT_NE(warnings[0].find("points and lines are skipped; --gltf-points RADIUS shows them"),
              std::string::npos)
        << warnings[0];
    const std::string shape = "Shape \"gltf\" \"string filename\" \"model.gltf\" ";
    EXPECT_EQ(centerOf(build(file, shape)), 0);
    warnings.clear();
    EXPECT_EQ(centerOf(build(file, shape + "\"float pointradius\" .5")), 1);
    options.gltfPointRadius = .5f;
    EXPECT_EQ(centerOf(build(file)), 1);
    options.gltfCulling = true;
    EXPECT_EQ(centerOf(build(file)), 1);
    EXPECT_EQ(centerOf(build(file, shape + "\"float pointradius\" .001")), 0); // the parameter has precedence
    EXPECT_TRUE(warnings.empty()) << warnings[0];
}

TEST_F(GltfPoints, TubesHaveVertexColors) {
    GltfFile file = primitive(Lines, {-4, 0, 0, 4, 0, 0});
    json& attributes = file.root["meshes"][0]["primitives"][0]["attributes"];
    attributes["COLOR_0"] = file.addFloats({0, .5f, 1, 1, .5f, 0}, "VEC3");
    options.gltfPointRadius = .5f;
    const Image image = render(build(file)).image;
    for (const int x : {0, 7}) {
        const float expected = (float(x) - 3.5f) / 4 / 8 + .5f;
        EXPECT_NEAR(image.at(x, 4).x, expected, .02f) << x;
        EXPECT_NEAR(image.at(x, 4).y, .5f, 1e-5f) << x;
        EXPECT_NEAR(image.at(x, 4).z, 1 - expected, .02f) << x;
    }
}

TEST_F(GltfPoints, FollowMorphTargetsAndSkins) {
    GltfFile morphed = primitive(Points, {9, 0, 0});
    morphed.root["meshes"][0]["primitives"][0]["targets"] = {
        {{"POSITION", morphed.addFloats({-9, 0, 0}, "VEC3")}}};
    options.gltfPointRadius = .5f;
    EXPECT_EQ(centerOf(build(morphed)), 0);
    morphed.root["meshes"][0]["weights"] = {1};
    EXPECT_EQ(centerOf(build(morphed)), 1);
    GltfFile skinned = primitive(Points, {9, 0, 0});
    json& attributes = skinned.root["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = skinned.add(std::vector<uint8_t>(4, 0), "VEC4", UByte);
    attributes["WEIGHTS_0"] = skinned.addFloats({1, 0, 0, 0}, "VEC4");
    skinned.root["skins"] = {{{"joints", {skinned.addNode({{"translation", {-9, 0, 0}}})}}}};
    EXPECT_EQ(centerOf(build(skinned)), 0);
    skinned.root["nodes"][2]["skin"] = 0;
    EXPECT_EQ(centerOf(build(skinned)), 1);
}

} // namespace
} // namespace strobe::test
