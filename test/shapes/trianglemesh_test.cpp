#include "shapes/trianglemesh.h"

#include "shapes/shape_params.h"

namespace strobe {
namespace {

const std::vector<float> kSquare{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};

ShapeParams square() {
    ShapeParams params;
    params.ints("indices", {0, 1, 2, 0, 2, 3}).points("P", kSquare);
    return params;
}

/// Returns the vectors `values` twice, the second time with `lift` added to z.
std::vector<float> twice(const std::vector<float>& values, float lift) {
    std::vector<float> all = values;
    for (size_t i = 0; i < values.size(); ++i)
        all.push_back(values[i] + (i % 3 == 2 ? lift : 0));
    return all;
}

TEST(TriangleMesh, ReadsAllVertexAttributes) {
    ShapeParams params = square();
    params.points("N", {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 2})
        .points("S", {1, 0, 0, 1, 0, 0, 1, 0, 0, 2, 0, 0})
        .floats("uv", {0, 0, 1, 0, 1, 1, 0, 1})
        .floats("alpha", {0.5f});
    const Shape shape = makeShape(triangleMeshPlugin(), params);
    ASSERT_TRUE(shape.mesh);
    EXPECT_FALSE(shape.quadric);
    const TriangleMesh& mesh = *shape.mesh;
    EXPECT_EQ(mesh.indices, (std::vector<uint32_t>{0, 1, 2, 0, 2, 3}));
    ASSERT_EQ(mesh.positions.size(), 1u);
    EXPECT_EQ(mesh.positions[0][2], V3f(1, 1, 0));
    ASSERT_EQ(mesh.normals.size(), 1u);
    EXPECT_EQ(mesh.normals[0][3], V3f(0, 0, 2)); // not normalized
    EXPECT_EQ(mesh.tangents[3], V3f(2, 0, 0));
    EXPECT_EQ(mesh.uvs[1], V2f(1, 0));
    EXPECT_EQ(mesh.alpha.constant, 0.5f);
    EXPECT_TRUE(mesh.keyTimes.empty());
    EXPECT_FALSE(mesh.deforms());
}

TEST(TriangleMesh, OptionalAttributesAreEmptyByDefault) {
    const TriangleMesh mesh = *makeShape(triangleMeshPlugin(), square()).mesh;
    EXPECT_TRUE(mesh.normals.empty());
    EXPECT_TRUE(mesh.tangents.empty());
    EXPECT_TRUE(mesh.uvs.empty());
    EXPECT_EQ(mesh.alpha.constant, 1.f);
}

TEST(TriangleMesh, UvMayBeNamedStAndMayBePoint2) {
    for (const char* name : {"uv", "st"}) {
        for (const ParamType type : {ParamType::Float, ParamType::Point2}) {
            ShapeParams params = square();
            params.floats(name, {0, 0, 1, 0, 1, 1, 0, 0.25f}, type);
            EXPECT_EQ(makeShape(triangleMeshPlugin(), params).mesh->uvs.at(3), V2f(0, 0.25f)) << name;
        }
    }
}

TEST(TriangleMesh, ThreeVerticesNeedNoIndices) {
    ShapeParams params;
    params.points("P", {0, 0, 0, 1, 0, 0, 0, 1, 0});
    EXPECT_EQ(makeShape(triangleMeshPlugin(), params).mesh->indices, (std::vector<uint32_t>{0, 1, 2}));
    ShapeParams four;
    four.points("P", kSquare);
    expectShapeError(triangleMeshPlugin(), four, "", "\"indices\" is missing");
}

TEST(TriangleMesh, DegenerateTrianglesAreKept) {
    ShapeParams params;
    params.ints("indices", {0, 0, 1, 0, 1, 2}).points("P", {0, 0, 0, 1, 0, 0, 2, 0, 0});
    EXPECT_EQ(makeShape(triangleMeshPlugin(), params).mesh->triangleCount(), 2u);
}

TEST(TriangleMesh, KeyTimesDefaultToTransformTimes) {
    ShapeParams params;
    params.ints("indices", {0, 1, 2}).ints("keys", {2}).points("P", twice(kSquare, 5));
    const TriangleMesh mesh = *makeShape(triangleMeshPlugin(), params, {0.25f, 0.75f}).mesh;
    ASSERT_TRUE(mesh.deforms());
    EXPECT_EQ(mesh.vertexCount(), 4u);
    EXPECT_EQ(mesh.positions[1][1], V3f(1, 0, 5));
    EXPECT_EQ(mesh.keyTimes, (std::vector<float>{0.25f, 0.75f}));
}

TEST(TriangleMesh, KeyTimesDefaultToEquidistantTimes) {
    std::vector<float> points = twice(kSquare, 1);
    points.insert(points.end(), kSquare.begin(), kSquare.end());
    ShapeParams params;
    params.ints("indices", {0, 1, 2}).ints("keys", {3}).points("P", points);
    const TriangleMesh mesh = *makeShape(triangleMeshPlugin(), params, {1, 3}).mesh;
    EXPECT_EQ(mesh.keyTimes, (std::vector<float>{1, 2, 3}));
    EXPECT_EQ(mesh.positions.size(), 3u);
}

TEST(TriangleMesh, KeysMayHaveTimesAndNormals) {
    ShapeParams moving;
    const std::vector<float> normals{0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
    moving.ints("indices", {0, 1, 2})
        .ints("keys", {2})
        .floats("keytimes", {-1, 4})
        .points("P", twice(kSquare, 5))
        .points("N", twice(normals, 1));
    const TriangleMesh mesh = *makeShape(triangleMeshPlugin(), moving).mesh;
    EXPECT_EQ(mesh.keyTimes, (std::vector<float>{-1, 4}));
    ASSERT_EQ(mesh.normals.size(), 2u);
    EXPECT_EQ(mesh.normals[1][0], V3f(0, 0, 2));
}

TEST(TriangleMesh, OneArrayOfNormalsIsUsedForAllKeys) {
    ShapeParams params;
    params.ints("indices", {0, 1, 2}).ints("keys", {2}).points("P", twice(kSquare, 5)).points("N", kSquare);
    const TriangleMesh mesh = *makeShape(triangleMeshPlugin(), params).mesh;
    ASSERT_EQ(mesh.normals.size(), 2u);
    EXPECT_EQ(mesh.normals[0], mesh.normals[1]);
}

TEST(TriangleMesh, ShadowAlphaIsIgnoredWithAWarning) {
    ShapeParams params = square();
    params.floats("shadowalpha", {0});
    std::string warning;
    Diagnostics diagnostics([&](const std::string& text) { warning = text; });
    makeShape(triangleMeshPlugin(), params, {0, 1}, &diagnostics);
    EXPECT_NE(warning.find("\"shadowalpha\" is ignored: shadow rays use \"alpha\""), std::string::npos);
}

TEST(TriangleMesh, ErrorsHaveLocations) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const Plugin<Shape> plugin = triangleMeshPlugin();
    struct Case {
        ShapeParams params;
        const char *name, *message;
    };
    const auto mesh = [](std::vector<int> indices, std::vector<float> points) {
        return ShapeParams().ints("indices", std::move(indices)).points("P", std::move(points));
    };
    const std::vector<Case> cases{
        {mesh({0, 1, 4}, kSquare), "indices",
         "index 4 (number 2 of \"indices\", in triangle 0) is out of range: "
         "the mesh has 4 vertices"},
        {mesh({0, 1, 2, 0, -1, 2}, kSquare), "indices", "index -1 (number 4 of \"indices\", in triangle 1)"},
        {mesh({0, 1, 2, 3}, kSquare), "indices", "4 numbers, which is not a multiple of 3"},
        {mesh({}, kSquare), "indices", "no triangles"},
        {mesh({0, 1, 2}, {}), "P", "no vertices"},
        {mesh({0, 1, 2}, {0, 0, 0, nan, 0, 0, 0, 1, 0}), "P", "the position of vertex 1 is not finite"},
        {mesh({0, 1, 2}, {0, 0, 0, 0, 0, 0, 0, 1, kInfinity}), "P", "vertex 2"},
        {ShapeParams().ints("indices", {0, 1, 2}), "", "\"P\" is missing"},
        {square().ints("keys", {3}), "P", "4 points, which do not divide into 3 keys"},
        {square().ints("keys", {0}), "keys", "at least 1, not 0"},
        {square().ints("keys", {-2}), "keys", "at least 1, not -2"},
        {mesh({0, 1}, kSquare).ints("keys", {2}), "indices", "multiple of 3"},
        {mesh({0, 1, 3}, twice({0, 0, 0, 1, 0, 0, 0, 1, 0}, 1)).ints("keys", {2}), "indices", "3 vertices"},
        {mesh({0, 1, 2}, twice({0, 0, 0, 1, 0, 0, 0, 1, 0}, kInfinity)).ints("keys", {2}), "P",
         "vertex 0 of key 1 is not finite"},
        {square().floats("keytimes", {0, 1}), "keytimes", "2 numbers, but the mesh has 1 key"},
        {square().ints("keys", {2}).floats("keytimes", {1, 1}), "keytimes", "ascending; number 1 is not"},
        {square().ints("keys", {2}).floats("keytimes", {0, nan}), "keytimes", "number 1"},
        {square().points("N", {0, 0, 1}), "N", "1 normal, but the mesh has 4 vertices"},
        {square().points("N", {0, 0, 1, 0, 0, 1, 0, nan, 1, 0, 0, 1}), "N", "the normal of vertex 2"},
        {square().points("S", {0, 0, 1}), "S", "1 vectors, but the mesh has 4 vertices"},
        {square().points("S", {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, nan}), "S", "tangent of vertex 3"},
        {square().floats("uv", {0, 0, 1, 1}), "uv", "2 pairs, but the mesh has 4 vertices"},
        {square().floats("st", {0, 0, 1, 1, 0, 0, nan, 1}), "st", "the uv of vertex 3 is not finite"},
        {square().floats("uv", {0, 0, 1}), "uv", "multiple of 2"},
        {square().floats("uv", {0, 0, 1}, ParamType::Vector3), "uv", "must be"},
    };
    for (const Case& c : cases)
        expectShapeError(plugin, c.params, c.name, c.message);
}

TEST(TriangleMesh, DeformationNeedsAnIntervalOfTime) {
    std::vector<float> points;
    for (int k = 0; k < 3; ++k)
        points.insert(points.end(), {0, 0, 0, 1, 0, 0, 0, 1, 0});
    ShapeParams three;
    three.ints("indices", {0, 1, 2}).ints("keys", {3}).points("P", points);
    EXPECT_THROW(makeShape(triangleMeshPlugin(), three, {1, 1}), Error);
    EXPECT_NO_THROW(makeShape(triangleMeshPlugin(), three, {1, 2}));
}

} // namespace
} // namespace strobe
