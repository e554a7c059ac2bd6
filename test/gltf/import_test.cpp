// Imports of glTF files: meshes, nodes, animation, deformation, lights and cameras.
#include "gltf/import.h"
#include "support/gltf_file.h"

#include <gtest/gtest.h>

#include <functional>

namespace strobe::test {
namespace {

using gltf::ImportedObject;
using gltf::Importer;

class Gltf : public testing::Test {
  protected:
    Importer import(const std::string& text, const gltf::Settings& settings = {}) {
        return Importer(gltf::open(m_folder.write("test.gltf", text), {}), settings, *m_textures,
                        m_diagnostics);
    }
    Importer import(const GltfFile& file, const gltf::Settings& settings = {}) {
        return import(file.text(), settings);
    }
    /// Returns the only mesh of the file.
    TriangleMesh mesh(const GltfFile& file) {
        Importer importer = import(file);
        const auto objects = importer.takeObjects();
        EXPECT_EQ(objects.size(), 1u);
        return *objects.at(0).shapes.at(0).mesh;
    }
    static V3f moved(const std::vector<TransformChain>& motions, int node, float time,
                     const V3f& p = V3f(0)) {
        return transformPoint(motions[size_t(node)].at(time), p);
    }
    /// Returns the position in the scene of a point of a node at one instant.
    static V3f at(const Importer& importer, int node, float time, const V3f& p = V3f(0)) {
        return moved(importer.motions({time, time}), node, time, p);
    }
    static void expectNear(const V3f& a, const V3f& b, float tolerance) {
        EXPECT_NEAR(a.x, b.x, tolerance);
        EXPECT_NEAR(a.y, b.y, tolerance);
        EXPECT_NEAR(a.z, b.z, tolerance);
    }

    GltfFolder m_folder;
    std::shared_ptr<TextureCache> m_textures = std::make_shared<TextureCache>();
    std::vector<std::string> m_warnings;
    Diagnostics m_diagnostics{[this](const std::string& text) { m_warnings.push_back(text); }};
};

const std::vector<float> kSquare{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};

TEST_F(Gltf, IndicesOfAllSizesAndNone) {
    const auto withIndices = [&](auto number, ComponentType type) {
        GltfFile file;
        using T = decltype(number);
        const int indices = file.add(std::vector<T>{2, 3, 0, 0, 1, 2}, "SCALAR", type);
        file.addNode({{"mesh", file.addMesh({{"attributes", {{"POSITION", file.addFloats(kSquare, "VEC3")}}},
                                             {"indices", indices}})}});
        return mesh(file).indices;
    };
    const std::vector<uint32_t> expected{2, 3, 0, 0, 1, 2};
    EXPECT_EQ(withIndices(uint8_t(0), UByte), expected);
    EXPECT_EQ(withIndices(uint16_t(0), UShort), expected);
    EXPECT_EQ(withIndices(uint32_t(0), UInt), expected);
    GltfFile file;
    file.addNode({{"mesh", file.addTriangle()}});
    EXPECT_EQ(mesh(file).indices, (std::vector<uint32_t>{0, 1, 2}));
}

TEST_F(Gltf, StripsAndFansKeepTheirOrientation) {
    const auto ofMode = [&](int mode) {
        GltfFile file;
        file.addNode({{"mesh", file.addMesh({{"attributes", {{"POSITION", file.addFloats(kSquare, "VEC3")}}},
                                             {"mode", mode}})}});
        return mesh(file).indices;
    };
    EXPECT_EQ(ofMode(5), (std::vector<uint32_t>{0, 1, 2, 1, 3, 2}));
    EXPECT_EQ(ofMode(6), (std::vector<uint32_t>{1, 2, 0, 2, 3, 0}));
}

TEST_F(Gltf, NormalizedInterleavedAndSparseAccessors) {
    GltfFile file;
    const int triangle = file.addTriangle();
    // Two unsigned shorts as fractions, eight bytes apart, in one buffer view.
    const int uvs =
        file.add(std::vector<uint16_t>{0, 65535, 9, 9, 65535, 13107, 9, 9, 0, 0, 9, 9}, "VEC2", UShort, true);
    file.root["accessors"][uvs]["count"] = 3;
    file.root["bufferViews"][file.root["accessors"][uvs]["bufferView"].get<int>()]["byteStride"] = 8;
    // Vertex 1 is moved by a sparse accessor.
    json& positions = file.root["accessors"][0];
    positions["sparse"] = {
        {"count", 1},
        {"indices", {{"bufferView", file.addView(std::vector<uint8_t>{1})}, {"componentType", 5121}}},
        {"values", {{"bufferView", file.addView(std::vector<float>{5, 6, 7})}}}};
    json& primitive = file.root["meshes"][triangle]["primitives"][0];
    primitive["attributes"]["TEXCOORD_0"] = uvs;
    file.root["images"] = {{{"uri", "none.png"}}};
    file.addNode({{"mesh", triangle}});
    const TriangleMesh m = mesh(file);
    EXPECT_EQ(m.positions[0][1], V3f(5, 6, 7));
    EXPECT_EQ(m.positions[0][2], V3f(0, 1, 0));
    ASSERT_EQ(m.uvs.size(), 3u);
    EXPECT_EQ(m.uvs[0], V2f(0, 0)); // strobe: v = 0 at the bottom
    EXPECT_NEAR(m.uvs[1].y, .8f, 1e-6f);
    EXPECT_EQ(m.uvs[2], V2f(0, 1));
}

TEST_F(Gltf, BinaryFilesAndExternalBuffersHoldTheSame) {
    GltfFile file;
    file.addNode({{"mesh", file.addTriangle()}});
    const TriangleMesh expected = mesh(file);
    const auto positionsOf = [&](const std::filesystem::path& path) {
        Importer importer(gltf::open(path, {}), {}, *m_textures, m_diagnostics);
        return importer.takeObjects().at(0).shapes.at(0).mesh->positions;
    };
    EXPECT_EQ(positionsOf(m_folder.write("a.glb", file.binary())), expected.positions);
    const auto& bytes = file.bytes();
    m_folder.write("with space.bin", {bytes.begin(), bytes.end()});
    file.root["buffers"] = {{{"byteLength", bytes.size()}, {"uri", "with%20space.bin"}}};
    const auto path = m_folder.write("a.gltf", file.text());
    EXPECT_EQ(positionsOf(path), expected.positions);
    EXPECT_EQ(gltf::filesOf(*gltf::open(path, {})),
              (std::vector<std::filesystem::path>{path, m_folder.path() / "with space.bin"}));
}

TEST_F(Gltf, NodesPlaceTheirChildrenAndShareMeshes) {
    GltfFile file;
    const int triangle = file.addTriangle();
    const float h = std::sqrt(.5f);
    // A quarter turn about z, then a shift; below it, a scale.
    const int child = file.addNode({{"mesh", triangle}, {"scale", {2, 3, 4}}}, false);
    const int parent = file.addNode(
        {{"rotation", {0, 0, h, h}}, {"translation", {10, 0, 0}}, {"children", {child}}, {"mesh", triangle}});
    // Columns of a matrix: the fourth is the translation.
    const int other =
        file.addNode({{"mesh", triangle}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1}}});
    Importer importer = import(file);
    expectNear(at(importer, parent, 0, {1, 0, 0}), {10, 1, 0}, 1e-6f);
    expectNear(at(importer, child, 0, {1, 1, 1}), {7, 2, 4}, 1e-5f);
    expectNear(at(importer, other, 0), {7, 8, 9}, 0);
    const auto objects = importer.takeObjects();
    ASSERT_EQ(objects.size(), 1u);
    EXPECT_EQ(objects[0].instances.size(), 3u);
    EXPECT_TRUE(m_warnings.empty());
}

TEST_F(Gltf, CurvesAreStepLinearAndSpline) {
    GltfFile file;
    const int triangle = file.addTriangle();
    const int step = file.addNode({{"mesh", triangle}});
    const int linear = file.addNode({{"mesh", triangle}});
    const int spline = file.addNode({{"mesh", triangle}});
    const int rotation = file.addNode({{"mesh", triangle}});
    file.animate("a", step, "translation", {1, 3}, {0, 0, 0, 4, 0, 0}, "VEC3", "STEP");
    file.animate("a", linear, "translation", {1, 3}, {0, 0, 0, 4, 0, 0}, "VEC3");
    // In-tangent, value, out-tangent of each key: from 0 with slope 1 to 4 with slope 2, in two seconds.
    file.animate("a", spline, "translation", {1, 3}, {9, 9, 9, 0, 0, 0, 1, 0, 0, 2, 0, 0, 4, 0, 0, 9, 9, 9},
                 "VEC3", "CUBICSPLINE");
    const float h = std::sqrt(.5f);
    file.animate("a", rotation, "rotation", {1, 3}, {0, 0, 0, 1, 0, 0, h, h}, "VEC4");
    const Importer importer = import(file);
    for (const auto& [time, value] : {std::pair{0.f, 0.f}, {1.f, 0.f}, {2.99f, 0.f}, {3.f, 4.f}, {9.f, 4.f}})
        EXPECT_EQ(at(importer, step, time).x, value) << time;
    for (const auto& [time, value] : {std::pair{0.f, 0.f}, {1.5f, 1.f}, {2.f, 2.f}, {3.f, 4.f}, {9.f, 4.f}})
        EXPECT_NEAR(at(importer, linear, time).x, value, 1e-6f) << time;
    for (const float t : {.25f, .5f, .75f}) { // Hermite, on [0, 1]
        const float expected = (t * t * t - 2 * t * t + t) * 2 * 1 + (3 * t * t - 2 * t * t * t) * 4 +
                               (t * t * t - t * t) * 2 * 2;
        EXPECT_NEAR(at(importer, spline, 1 + 2 * t).x, expected, 1e-5f);
    }
    const float third = kPi / 2 / 3;
    expectNear(at(importer, rotation, 1 + 2.f / 3, {1, 0, 0}), {std::cos(third), std::sin(third), 0}, 1e-6f);
}

TEST_F(Gltf, MotionsAreWithinTheTolerance) {
    GltfFile file;
    const int triangle = file.addTriangle();
    const int child = file.addNode({{"mesh", triangle}, {"translation", {3, 0, 0}}}, false);
    const int parent = file.addNode({{"children", {child}}});
    file.animate("a", child, "translation", {0, .4f, 1},
                 {3, 0, 0, 0, 0, 30, 0, 5, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 3, 1, 1, 0, 0, 0}, "VEC3",
                 "CUBICSPLINE");
    file.animate("a", parent, "rotation", {0, .7f, 1}, {0, 0, 0, 1, 0, 1, 0, 0, .5f, .5f, .5f, .5f}, "VEC4");
    file.animate("a", parent, "scale", {0, 1}, {1, 1, 1, 2, 1, .5f}, "VEC3");
    const Importer importer = import(file);
    const Shutter shutter{.1f, .95f};
    const auto motions = importer.motions(shutter);
    const float size = length(importer.bounds().size());
    for (int i = 0; i <= 200; ++i) {
        const float time = shutter.sceneTime(float(i) / 200);
        for (const V3f& p : {V3f(0), V3f(1, 0, 0), V3f(0, 1, 0)})
            EXPECT_LT(length(moved(motions, child, time, p) - at(importer, child, time, p)), 1e-4f * size);
    }
    EXPECT_TRUE(import(file).motions({.3f, .3f})[size_t(child)].isStatic());
}

/// Returns a bar along y with vertices at 0 and 2, whose upper end is bound to a joint that rotates about z.
GltfFile bentBar() {
    GltfFile file;
    const int positions = file.addFloats({0, 0, 0, .1f, 0, 0, 0, 2, 0, .1f, 2, 0}, "VEC3");
    const int joints =
        file.add(std::vector<uint8_t>{0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4", UByte);
    const int weights = file.add(std::vector<uint8_t>{255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0},
                                 "VEC4", UByte, true);
    const int indices = file.add(std::vector<uint8_t>{0, 1, 2, 1, 3, 2}, "SCALAR", UByte);
    const int bar =
        file.addMesh({{"attributes", {{"POSITION", positions}, {"JOINTS_0", joints}, {"WEIGHTS_0", weights}}},
                      {"indices", indices}});
    const int upper = file.addNode({{"translation", {0, 1, 0}}}, false);
    const int lower = file.addNode({{"children", {upper}}});
    const int bind = file.addFloats({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0,  0, 1, //
                                     1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -1, 0, 1},
                                    "MAT4");
    file.root["skins"] = {{{"joints", {lower, upper}}, {"inverseBindMatrices", bind}}};
    file.addNode({{"mesh", bar}, {"skin", 0}, {"translation", {50, 0, 0}}}); // no effect on skins
    const float h = std::sqrt(.5f);
    file.animate("bend", upper, "rotation", {0, 1}, {0, 0, 0, 1, 0, 0, h, h}, "VEC4");
    return file;
}

TEST_F(Gltf, SkinsHaveTheKeysThatTheToleranceNeeds) {
    Importer importer = import(bentBar());
    EXPECT_TRUE(importer.takeObjects().empty());
    const auto positionsAt = [&](float time) {
        const Shutter shutter{time, time};
        const auto deformations = importer.deformations(importer.motions(shutter), shutter);
        EXPECT_EQ(deformations.at(0).shapes[0].mesh->positions.size(), 1u);
        return deformations.at(0).shapes[0].mesh->positions[0];
    };
    expectNear(positionsAt(0)[2], {0, 2, 0}, 1e-6f);
    expectNear(positionsAt(1)[2], {-1, 1, 0}, 1e-6f);
    expectNear(positionsAt(1)[0], {0, 0, 0}, 0);
    const Shutter shutter{0, .5f};
    const auto motions = importer.motions(shutter);
    const auto deformations = importer.deformations(motions, shutter);
    const TriangleMesh& m = *deformations.at(0).shapes[0].mesh;
    ASSERT_EQ(m.keyTimes.size(), m.positions.size());
    // 45 degrees in n steps: the chords deviate from the arc by 1 - cos(22.5°/n); 2e-5 of the size 2 needs n
    // = 64.
    EXPECT_EQ(m.positions.size(), 65u);
    for (int i = 0; i < 300; ++i) {
        const float time = shutter.sceneTime((float(i) + .37f) / 300), x = time / .5f * 64;
        const auto k = size_t(x);
        const V3f interpolated = lerp(m.positions[k][2], m.positions[k + 1][2], x - float(k));
        EXPECT_LT(length(interpolated - positionsAt(time)[2]), 1.1f * 2e-5f * 2.003f);
    }
    const Shutter slow{0, .002f};
    EXPECT_EQ(importer.deformations(importer.motions(slow), slow)[0].shapes[0].mesh->positions.size(), 2u);
}

TEST_F(Gltf, MorphTargetsAddUp) {
    GltfFile file;
    const int triangle = file.addTriangle();
    json& primitive = file.root["meshes"][triangle]["primitives"][0];
    primitive["targets"] = {{{"POSITION", file.addFloats({0, 0, 1, 0, 0, 0, 0, 0, 0}, "VEC3")}},
                            {{"POSITION", file.addFloats({0, 0, 0, 0, 0, 0, 2, 0, 0}, "VEC3")}}};
    file.root["meshes"][triangle]["weights"] = {.5, 0};
    const int node = file.addNode({{"mesh", triangle}, {"translation", {0, 9, 0}}});
    file.animate("a", node, "weights", {0, 1}, {1, 0, 0, 1}, "SCALAR");
    const Importer importer = import(file);
    const Shutter shutter{0, 1};
    const auto deformations = importer.deformations(importer.motions(shutter), shutter);
    const auto& keys = deformations.at(0).shapes[0].mesh->positions;
    ASSERT_EQ(keys.size(), 2u) << "linear motion needs two keys";
    expectNear(keys[0][0], {0, 0, 1}, 0);
    expectNear(keys[1][0], {0, 0, 0}, 0);
    expectNear(keys[1][2], {2, 1, 0}, 0);
    expectNear(transformPoint(deformations[0].toScene.at(0), V3f(0)), {0, 9, 0}, 0);
    file.root.erase("animations");
    Importer unanimated = import(file);
    EXPECT_TRUE(unanimated.takeObjects().empty());
    const auto half = unanimated.deformations(unanimated.motions(shutter), shutter);
    expectNear(half.at(0).shapes[0].mesh->positions.at(0)[0], {0, 0, .5f}, 0);
}

TEST_F(Gltf, AnimationsOfDifferentPropertiesPlayTogether) {
    GltfFile file;
    const int triangle = file.addTriangle();
    const int a = file.addNode({{"mesh", triangle}}), b = file.addNode({{"mesh", triangle}});
    file.animate("first", a, "translation", {0, 1}, {0, 0, 0, 1, 0, 0}, "VEC3");
    file.animate("of b", b, "translation", {0, 1}, {0, 0, 0, 2, 0, 0}, "VEC3");
    file.animate("second", a, "translation", {0, 1}, {0, 0, 0, 0, 3, 0}, "VEC3");
    const Importer importer = import(file);
    expectNear(at(importer, a, 1), {1, 0, 0}, 0);
    expectNear(at(importer, b, 1), {2, 0, 0}, 0);
    ASSERT_EQ(m_warnings.size(), 1u);
    EXPECT_NE(
        m_warnings[0].find(R"("first" plays; skipped, since they animate the same properties: "second")"),
        std::string::npos)
        << m_warnings[0];
    const Importer second = import(file, {"", "second", "", true});
    expectNear(at(second, a, 1), {0, 3, 0}, 0);
    expectNear(at(second, b, 1), {0, 0, 0}, 0);
}

TEST_F(Gltf, LightsAndCameras) {
    GltfFile file;
    file.root["extensionsUsed"] = {"KHR_lights_punctual"};
    file.root["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "point"}, {"intensity", 683}, {"color", {1, .5, 0}}},
        {{"type", "directional"}, {"intensity", 68.3}},
        {{"type", "spot"}, {"spot", {{"innerConeAngle", .25}, {"outerConeAngle", .5}}}}};
    for (int i = 0; i < 3; ++i)
        file.addNode({{"extensions", {{"KHR_lights_punctual", {{"light", i}}}}}});
    file.root["cameras"] = {{{"name", "one"},
                             {"type", "perspective"},
                             {"perspective", {{"yfov", 1}, {"znear", .1}, {"aspectRatio", 2}}}},
                            {{"name", "two"},
                             {"type", "orthographic"},
                             {"orthographic", {{"xmag", 6}, {"ymag", 2}, {"znear", 0}, {"zfar", 9}}}}};
    file.addNode({{"camera", 0}});
    file.addNode({{"camera", 1}, {"name", "of the node"}});
    const Importer importer = import(file);
    ASSERT_EQ(importer.lights().size(), 3u);
    EXPECT_EQ(importer.lights()[0].intensity, Rgb(1, .5f, 0));
    EXPECT_FLOAT_EQ(importer.lights()[1].intensity.x, .1f);
    EXPECT_FLOAT_EQ(importer.lights()[2].outerAngle, .5f);
    EXPECT_FLOAT_EQ(importer.camera()->halfHeight, std::tan(.5f));
    EXPECT_EQ(importer.camera()->aspect, 2);
    const Importer second = import(file, {"", "", "of the node", false});
    EXPECT_FALSE(second.camera()->isPerspective);
    EXPECT_EQ(second.camera()->halfHeight, 2);
    EXPECT_EQ(second.camera()->aspect, 3);
    EXPECT_TRUE(second.lights().empty());
}

TEST_F(Gltf, UnitsOfLights) {
    GltfFile file;
    file.root["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}, {"intensity", 683}}};
    file.addNode({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    gltf::Settings settings;
    EXPECT_EQ(import(file, settings).lights()[0].intensity, Rgb(1));
    settings.photometric = false;
    EXPECT_EQ(import(file, settings).lights()[0].intensity, Rgb(683));
}

TEST_F(Gltf, InstancesByAttribute) {
    GltfFile file;
    const float h = std::sqrt(.5f);
    const int node = file.addNode({{"mesh", file.addTriangle()}, {"translation", {0, 0, 5}}});
    file.root["nodes"][size_t(node)]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
        {"TRANSLATION", file.addFloats({0, 0, 0, 10, 0, 0}, "VEC3")},
        {"ROTATION", file.addFloats({0, 0, 0, 1, 0, 0, h, h}, "VEC4")},
        {"SCALE", file.addFloats({1, 1, 1, 2, 2, 2}, "VEC3")}};
    Importer importer = import(file);
    const auto objects = importer.takeObjects();
    ASSERT_EQ(objects.size(), 1u);
    ASSERT_EQ(objects[0].instances.size(), 2u);
    EXPECT_EQ(objects[0].instances[0].toNode, M44f());
    expectNear(transformPoint(objects[0].instances[1].toNode, {1, 0, 0}), {10, 2, 0}, 1e-5f);
    EXPECT_GE(importer.bounds().max.x, 10);
    EXPECT_EQ(importer.bounds().max.z, 5);
    file.root["nodes"][size_t(node)]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] =
        file.addFloats({1, 1, 1}, "VEC3");
    try {
        import(file);
        FAIL();
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("attributes.SCALE: has 1 elements, but other attributes have 2"),
                  std::string::npos)
            << e.what();
    }
}

TEST_F(Gltf, ExtremesSpanTheWholeAnimation) {
    GltfFile file;
    const int node = file.addNode({{"mesh", file.addTriangle()}});
    file.animate("move", node, "translation", {0, 2}, {0, 0, 0, 20, 0, 0}, "VEC3");
    float right = 0;
    const Importer importer = import(file);
    for (const V3f& p : importer.extremes())
        right = std::max(right, p.x);
    EXPECT_NEAR(right, 21, 1e-4f);
    EXPECT_TRUE(import(GltfFile()).extremes().empty());
}

/// A file with a deviation that viewers accept: a warning, or an error if the diagnostics are strict.
struct Deviation {
    const char* message; ///< without the name of the file
    std::function<void(GltfFile&)> change;
};

TEST_F(Gltf, DeviationsThatViewersAcceptAreWarnings) {
    const float nan = std::nanf("");
    const std::vector<Deviation> deviations{
        {"animations: channels without a node are ignored",
         [](GltfFile& f) {
             f.animate("a", 0, "translation", {0, 1}, {0, 0, 0, 1, 0, 0}, "VEC3");
             f.root["animations"][0]["channels"][0]["target"].erase("node");
         }},
        {"extensionsRequired: MINE_materials_velvet is not supported; the file is shown without it",
         [](GltfFile& f) { f.root["extensionsRequired"] = {"MINE_materials_velvet"}; }},
        {"element 1 is not finite; (0, 1, 0) takes the place of such elements", [&](GltfFile& f) {
             f.root["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] =
                 f.addFloats({0, 0, 1, nan, 0, 1, 0, 0, 1}, "VEC3");
         }}};
    for (const Deviation& deviation : deviations) {
        GltfFile file;
        file.addNode({{"mesh", file.addTriangle()}});
        deviation.change(file);
        m_warnings.clear();
        m_diagnostics = Diagnostics([this](const std::string& text) { m_warnings.push_back(text); });
        import(file);
        ASSERT_EQ(m_warnings.size(), 1u) << deviation.message;
        EXPECT_NE(m_warnings[0].find(deviation.message), std::string::npos) << m_warnings[0];
        m_diagnostics.setStrict(true);
        try {
            import(file);
            FAIL();
        } catch (const Error& e) {
            EXPECT_NE(std::string(e.what()).find(deviation.message), std::string::npos) << e.what();
        }
    }
}

} // namespace
} // namespace strobe::test
