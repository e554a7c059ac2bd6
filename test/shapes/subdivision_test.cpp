#include "shapes/subdivision.h"
#include "support/scene_data.h"

#include "shapes/loopsubdiv.h"
#include "shapes/shape_params.h"

#include <cstdlib>
#include <fstream>
#include <sstream>

namespace strobe {
namespace {

using Indices = std::vector<uint32_t>;
using Points = std::vector<V3f>;

const Indices kOctahedron{0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
const Points kOctahedronPoints{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
const Indices kTetrahedron{0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2};
const Points kTetrahedronPoints{{1, 1, 1}, {-1, 1, -1}, {1, -1, -1}, {-1, -1, 1}};

/// Appends n x n squares in the plane z = 2, each split along the same diagonal; counter-clockwise from
/// above.
void makeGrid(int n, Indices& indices, Points& points) {
    for (int y = 0; y <= n; ++y) {
        for (int x = 0; x <= n; ++x)
            points.emplace_back(static_cast<float>(x), static_cast<float>(y), 2.f);
    }
    const auto vertex = [&](int x, int y) { return static_cast<uint32_t>(y * (n + 1) + x); };
    for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) {
            const uint32_t square[] = {vertex(x, y), vertex(x + 1, y),     vertex(x + 1, y + 1),
                                       vertex(x, y), vertex(x + 1, y + 1), vertex(x, y + 1)};
            indices.insert(indices.end(), std::begin(square), std::end(square));
        }
    }
}

/// Returns the weight of a vertex of valence n in its own limit position.
float limitCenterWeight(int n) {
    const float beta = n == 3 ? 3.f / 16 : 3.f / (8.f * n);
    return 1 - n / (n + 3 / (8 * beta));
}

void expectOutwardNormals(const SubdividedMesh& mesh) {
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        const Points& p = mesh.positions[0];
        const V3f a = p[mesh.indices[i]], b = p[mesh.indices[i + 1]], c = p[mesh.indices[i + 2]];
        for (const size_t corner : {i, i + 1, i + 2})
            EXPECT_GT(dot(cross(b - a, c - a), mesh.normals[0][mesh.indices[corner]]), 0.f)
                << "triangle " << i / 3;
    }
}

TEST(SubdivideLoop, OctahedronHasTheKnownLimit) {
    // Opposite neighbors cancel, so at level 0 every vertex is scaled by its own weight.
    const SubdividedMesh mesh = subdivideLoop(kOctahedron, {kOctahedronPoints}, 0, {});
    EXPECT_EQ(mesh.indices, kOctahedron);
    for (size_t v = 0; v < 6; ++v) {
        const V3f expected = kOctahedronPoints[v] * limitCenterWeight(4);
        EXPECT_LT(length(mesh.positions[0][v] - expected), 1e-6f);
        EXPECT_NEAR(dot(normalize(mesh.normals[0][v]), kOctahedronPoints[v]), 1, 1e-5f);
        // The length of the normals in pbrt: the tangents are cos and sin sums over the limit points.
        EXPECT_NEAR(length(mesh.normals[0][v]), 4 * sqr(limitCenterWeight(4)), 1e-5f);
    }
}

TEST(SubdivideLoop, TetrahedronHasTheKnownLimit) {
    // The sum of the three neighbors is minus the vertex.
    const SubdividedMesh mesh = subdivideLoop(kTetrahedron, {kTetrahedronPoints}, 0, {});
    const float w = limitCenterWeight(3);
    for (size_t v = 0; v < 4; ++v)
        EXPECT_LT(length(mesh.positions[0][v] - kTetrahedronPoints[v] * (w - (1 - w) / 3)), 1e-6f);
}

TEST(SubdivideLoop, LimitIsIndependentOfTheLevel) {
    const std::pair<Indices, Points> solids[] = {{kOctahedron, kOctahedronPoints},
                                                 {kTetrahedron, kTetrahedronPoints}};
    for (const auto& [indices, points] : solids) {
        const Points coarse = subdivideLoop(indices, {points}, 0, {}).positions[0];
        for (int level = 1; level <= 5; ++level) {
            const SubdividedMesh mesh = subdivideLoop(indices, {points}, level, {});
            EXPECT_EQ(mesh.indices.size(), indices.size() << (2 * level));
            expectOutwardNormals(mesh);
            for (const V3f& p : coarse) {
                float nearest = kInfinity;
                for (const V3f& q : mesh.positions[0])
                    nearest = std::min(nearest, length(p - q));
                EXPECT_LT(nearest, 2e-6f) << "level " << level;
            }
        }
    }
}

TEST(SubdivideLoop, FlatGridStaysFlat) {
    Indices indices;
    Points points;
    makeGrid(4, indices, points);
    const SubdividedMesh mesh = subdivideLoop(indices, {points}, 3, {});
    EXPECT_EQ(mesh.indices.size(), indices.size() * 64);
    ASSERT_EQ(mesh.normals[0].size(), mesh.positions[0].size());
    for (size_t v = 0; v < mesh.positions[0].size(); ++v) {
        EXPECT_NEAR(mesh.positions[0][v].z, 2, 1e-6f);
        const V3f n = normalize(mesh.normals[0][v]);
        EXPECT_NEAR(n.z, 1, 1e-6f) << "vertex " << v;
    }
}

TEST(SubdivideLoop, BoundariesHaveRoundCorners) {
    Indices indices;
    Points points;
    makeGrid(1, indices, points);
    const SubdividedMesh mesh = subdivideLoop(indices, {points}, 0, {});
    // The weights are 3/5 for a corner and 1/5 for each of its two neighbors on the boundary.
    const V3f center(0.5f, 0.5f, 2);
    for (size_t v = 0; v < 4; ++v) {
        EXPECT_LT(length(mesh.positions[0][v] - (center + (points[v] - center) * (3.f / 5))), 1e-6f);
    }
}

TEST(SubdivideLoop, HasTheWeightsOfPbrt) {
    // A fan of six triangles whose center is lifted by 1. Refinement lifts the center by 5/8 and its six new
    // neighbors by 3/8. In the limit, the center has weight 1/2 and each neighbor 1/12.
    Points points{{0, 0, 1}};
    Indices indices;
    for (uint32_t i = 0; i < 6; ++i) {
        points.emplace_back(std::cos(i * kPi / 3), std::sin(i * kPi / 3), 0.f);
        indices.insert(indices.end(), {0, i + 1, (i + 1) % 6 + 1});
    }
    const SubdividedMesh mesh = subdivideLoop(indices, {points}, 1, {});
    const auto highest = std::max_element(mesh.positions[0].begin(), mesh.positions[0].end(),
                                          [](const V3f& a, const V3f& b) { return a.z < b.z; });
    EXPECT_NEAR(highest->z, 0.5f * 5 / 8 + 6.f / 12 * 3 / 8, 1e-6f);
    EXPECT_NEAR(highest->x, 0, 1e-6f);
    EXPECT_NEAR(normalize(mesh.normals[0][highest - mesh.positions[0].begin()]).z, 1, 1e-5f);
}

TEST(SubdivideLoop, KeysShareTheTopology) {
    Points moved = kOctahedronPoints;
    for (V3f& p : moved)
        p = p * 3.f + V3f(1, 2, 3);
    const SubdividedMesh mesh = subdivideLoop(kOctahedron, {kOctahedronPoints, moved}, 2, {});
    ASSERT_EQ(mesh.positions.size(), 2u);
    ASSERT_EQ(mesh.normals.size(), 2u);
    for (size_t v = 0; v < mesh.positions[0].size(); ++v)
        EXPECT_LT(length(mesh.positions[0][v] * 3.f + V3f(1, 2, 3) - mesh.positions[1][v]), 1e-5f);
}

TEST(SubdivideLoop, UnusedVerticesAreRemoved) {
    Points points = kOctahedronPoints;
    points.insert(points.begin(), {9, 9, 9});
    points.push_back({7, 7, 7});
    Indices indices = kOctahedron;
    for (uint32_t& v : indices)
        ++v;
    const SubdividedMesh mesh = subdivideLoop(indices, {points}, 2, {});
    const SubdividedMesh plain = subdivideLoop(kOctahedron, {kOctahedronPoints}, 2, {});
    EXPECT_EQ(mesh.indices, plain.indices);
    EXPECT_EQ(mesh.positions[0], plain.positions[0]);
}

TEST(SubdivideLoop, DegenerateMeshesHaveNoNaN) {
    const Points flat(6, V3f(1, 2, 3));
    const SubdividedMesh mesh = subdivideLoop(kOctahedron, {flat}, 2, {});
    for (const V3f& n : mesh.normals[0])
        EXPECT_LT(length(n), 1e-5f);
    // Three triangles share an edge, and a fourth touches them in a vertex.
    const Points points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {-1, 0, 0}, {-1, 1, 0}};
    const SubdividedMesh nonManifold = subdivideLoop({0, 1, 2, 1, 0, 3, 0, 1, 4, 0, 5, 6}, {points}, 2, {});
    for (size_t v = 0; v < nonManifold.positions[0].size(); ++v) {
        EXPECT_TRUE(std::isfinite(length(nonManifold.positions[0][v])));
        EXPECT_GT(length(nonManifold.normals[0][v]), 0.f);
    }
}

TEST(SubdivideLoop, RejectsInvalidInput) {
    EXPECT_THROW(subdivideLoop({0, 1, 1}, {kOctahedronPoints}, 1, {}), Error);
    EXPECT_THROW(subdivideLoop(kOctahedron, {kOctahedronPoints}, 12, {}), Error);
    EXPECT_THROW(subdivideLoop(kOctahedron, {kOctahedronPoints}, -1, {}), Error);
}

ShapeParams octahedron() {
    std::vector<float> numbers;
    for (const V3f& p : kOctahedronPoints)
        numbers.insert(numbers.end(), {p.x, p.y, p.z});
    return ShapeParams().ints("indices", {kOctahedron.begin(), kOctahedron.end()}).points("P", numbers);
}

TEST(LoopSubdiv, LevelsMayBeNamedNlevelsOrLevels) {
    EXPECT_EQ(makeShape(loopSubdivPlugin(), octahedron()).mesh->triangleCount(), 8u * 64);
    EXPECT_EQ(makeShape(loopSubdivPlugin(), octahedron().ints("nlevels", {1})).mesh->triangleCount(), 32u);
    EXPECT_EQ(makeShape(loopSubdivPlugin(), octahedron().ints("levels", {2})).mesh->triangleCount(), 128u);
}

TEST(LoopSubdiv, NormalsAreOnTheOtherSideInPbrtFiles) {
    Diagnostics quiet;
    BuildContext context{quiet};
    for (const bool isLenient : {false, true}) {
        context.isLenient = isLenient;
        const TriangleMesh mesh = *loopSubdivPlugin().create(octahedron().set(), context).mesh;
        for (size_t i = 0; i < mesh.vertexCount(); ++i) {
            const float side = dot(mesh.normals[0][i], mesh.positions[0][i]);
            EXPECT_TRUE(isLenient ? side < 0 : side > 0);
        }
    }
}

TEST(LoopSubdiv, KeysDeformTheSurface) {
    std::vector<float> numbers;
    for (const float lift : {0.f, 1.f}) {
        for (const V3f& p : kOctahedronPoints)
            numbers.insert(numbers.end(), {p.x, p.y, p.z + lift});
    }
    ShapeParams params;
    params.ints("indices", {kOctahedron.begin(), kOctahedron.end()}).ints("keys", {2}).points("P", numbers);
    const TriangleMesh mesh = *makeShape(loopSubdivPlugin(), params.ints("nlevels", {1})).mesh;
    ASSERT_EQ(mesh.positions.size(), 2u);
    EXPECT_EQ(mesh.keyTimes, (std::vector<float>{0, 1}));
    EXPECT_NEAR(mesh.positions[1][7].z - mesh.positions[0][7].z, 1, 1e-6f);
}

TEST(LoopSubdiv, ErrorsHaveLocations) {
    const Plugin<Shape> plugin = loopSubdivPlugin();
    expectShapeError(plugin, octahedron().ints("nlevels", {9}), "nlevels", "between 0 and 8, not 9");
    expectShapeError(plugin, octahedron().ints("levels", {-1}), "levels", "between 0 and 8, not -1");
    expectShapeError(plugin, octahedron().strings("scheme", {"catmark"}), "scheme",
                     "\"catmark\" (known: loop)");
    const std::vector<float> triangle{0, 0, 0, 1, 0, 0, 0, 1, 0};
    expectShapeError(plugin, ShapeParams().ints("indices", {0, 2, 2}).points("P", triangle), "indices",
                     "triangle 0 uses a vertex twice");
    expectShapeError(plugin, ShapeParams().ints("indices", {0, 1, 3}).points("P", triangle), "indices",
                     "out of range");
    std::vector<int> many;
    for (int i = 0; i < 1100; ++i)
        many.insert(many.end(), {0, 1, 2});
    expectShapeError(plugin, ShapeParams().ints("indices", many).points("P", triangle).ints("nlevels", {8}),
                     "indices", "would make more than");
}

/// Returns the numbers between the brackets after `key`.
template <class T>
std::vector<T> numbersOf(const std::string& text, const std::string& key) {
    const size_t begin = text.find('[', text.find(key)) + 1;
    std::istringstream words(text.substr(begin, text.find(']', begin) - begin));
    return {std::istream_iterator<T>(words), {}};
}

TEST(LoopSubdiv, KillerooHasOutwardNormals) {
    std::ifstream file(test::pbrtFolder() / "geometry/killeroo.pbrt");
    if (!file)
        GTEST_SKIP() << "the scenes of the paper are not available: set STROBE_SCENES";
    std::stringstream text;
    text << file.rdbuf();
    ShapeParams params;
    params.ints("nlevels", {1}).ints("indices", numbersOf<int>(text.str(), "\"integer indices\""));
    params.points("P", numbersOf<float>(text.str(), "\"point P\""));
    const TriangleMesh mesh = *makeShape(loopSubdivPlugin(), params).mesh;
    EXPECT_EQ(mesh.triangleCount(), 33264u);
    EXPECT_EQ(mesh.vertexCount(), 16899u);
    ASSERT_EQ(mesh.normals.at(0).size(), 16899u);
    size_t reversed = 0; // folds in the control mesh may reverse a few normals
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        const V3f a = mesh.positions[0][mesh.indices[i]];
        const V3f face =
            cross(mesh.positions[0][mesh.indices[i + 1]] - a, mesh.positions[0][mesh.indices[i + 2]] - a);
        for (const size_t corner : {i, i + 1, i + 2}) {
            const V3f n = mesh.normals[0][mesh.indices[corner]];
            ASSERT_TRUE(std::isfinite(length(n)));
            reversed += dot(n, face) <= 0;
        }
    }
    EXPECT_LT(reversed, mesh.indices.size() / 1000) << "of " << mesh.indices.size();
}

} // namespace
} // namespace strobe
