// Culling of the back of surfaces that are not doubleSided, for camera rays.
#include "support/gltf_scene.h"

namespace strobe::test {
namespace {

class GltfCulling : public GltfSceneTest {
  protected:
    GltfCulling() { options.gltfCulling = true; }
    /// Adds the mesh of a white square of side 2, facing +z, with `material`; returns its index.
    static int addSquare(GltfFile& file, int material = 0) {
        return file.addMesh(
            {{"attributes", {{"POSITION", file.addFloats({-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0}, "VEC3")}}},
             {"indices", file.add(std::vector<uint8_t>{0, 1, 2, 0, 2, 3}, "SCALAR", UByte)},
             {"material", material}});
    }
    /// Returns a file whose only square is in a node with these properties.
    static GltfFile square(json node) {
        GltfFile file = unlitFile();
        node["mesh"] = addSquare(file);
        file.addNode(node);
        return file;
    }
    /// Expects that the camera sees the square, or not, in a shape, in an instance, in a moving instance, and
    /// in a deforming shape.
    void expectSeen(bool isSeen, const json& node) {
        GltfFile file = square(node);
        EXPECT_EQ(centerOf(build(file)), float(isSeen)) << "shape of " << node;
        GltfFile moving = file;
        moving.animate("a", 2, "translation", {0, 1}, {0, 0, 0, .1f, 0, 0}, "VEC3");
        options.shutter = Shutter{0, .5f};
        EXPECT_EQ(centerOf(build(moving)), float(isSeen)) << "moving instance of " << node;
        GltfFile morphed = file;
        morphed.root["meshes"][0]["primitives"][0]["targets"] = {
            {{"POSITION", morphed.addFloats({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3")}}};
        morphed.animate("a", 2, "weights", {0, 1}, {0, 1}, "SCALAR");
        EXPECT_EQ(centerOf(build(morphed)), float(isSeen)) << "deforming shape of " << node;
        options.shutter.reset();
        file.addNode({{"mesh", 0}, {"translation", {9, 0, 0}}}); // the mesh is instanced
        EXPECT_EQ(centerOf(build(file)), float(isSeen)) << "instance of " << node;
    }
};

const json kFromBehind = {{"rotation", {0, 1, 0, 0}}}; // half a turn about y

TEST_F(GltfCulling, TheFrontIsCounterclockwise) {
    expectSeen(true, json::object());
    expectSeen(false, kFromBehind);
}

TEST_F(GltfCulling, MirroringKeepsTheFront) {
    expectSeen(true, {{"scale", {-1, 1, 1}}});
    expectSeen(false, {{"scale", {1, 1, -1}}});
    expectSeen(true, {{"scale", {-1, -1, 1}}});
    expectSeen(false, {{"scale", {-1, 1, 1}}, {"rotation", {0, 1, 0, 0}}});
}

TEST_F(GltfCulling, IsOnRequestAndOfSingleSidedMaterialsOnly) {
    GltfFile file = square(kFromBehind);
    options.gltfCulling = false;
    EXPECT_EQ(centerOf(build(file)), 1);
    EXPECT_EQ(build(file).scene->tracer().counts().filteredGeometries, 0u);
    const std::string shape = "Shape \"gltf\" \"string filename\" \"model.gltf\" ";
    EXPECT_EQ(centerOf(build(file, shape)), 1);
    EXPECT_EQ(centerOf(build(file, shape + "\"bool culling\" true")), 0);
    options.gltfCulling = true;
    EXPECT_EQ(build(file).scene->tracer().counts().filteredGeometries, 1u);
    file.root["materials"][0]["doubleSided"] = true;
    EXPECT_EQ(centerOf(build(file)), 1);
    EXPECT_EQ(build(file).scene->tracer().counts().filteredGeometries, 0u);
}

TEST_F(GltfCulling, FrontsHaveTheirAlphaTest) {
    GltfFile file = square(json::object());
    json& material = file.root["materials"][0];
    material["alphaMode"] = "MASK";
    material["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, .6};
    EXPECT_EQ(centerOf(build(file)), 1);
    material["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, .4};
    EXPECT_EQ(centerOf(build(file)), 0);
}

TEST_F(GltfCulling, ShadowRaysHitBothSides) {
    GltfFile file = square(kFromBehind);
    file.root["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "directional"}, {"intensity", 683}}};
    file.root["materials"] = {{{"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, 1}}}}},
                              {{"pbrMetallicRoughness", {{"metallicFactor", 0}}}}};
    file.addNode({{"mesh", addSquare(file, 1)}, {"translation", {0, 0, -2}}});
    EXPECT_EQ(centerOf(build(file)), 0); // of the wall, which the square shades
    file.root["nodes"][2]["translation"] = {9, 0, 0};
    EXPECT_GT(centerOf(build(file)), .2f);
}

TEST_F(GltfCulling, ReflectionsHitBothSides) {
    GltfFile file = square({{"translation", {0, 0, 7}}}); // behind the camera, seen from behind
    file.root["materials"].push_back({{"pbrMetallicRoughness", {{"roughnessFactor", 0}}}});
    file.addNode({{"mesh", addSquare(file, 1)}});
    EXPECT_NEAR(centerOf(build(file)), 1, 1e-3f);
}

} // namespace
} // namespace strobe::test
