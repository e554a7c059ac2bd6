// Mesh cells: coverage, density, interpolation, separation of sides.
#include "lattice/lattice_cell.h"

#include "support/render_text.h"

#include <gtest/gtest.h>

#include <set>

namespace strobe {
namespace {

float random(uint64_t a, uint64_t b) { return unitFloat(uint32_t(hashOf(a, b) >> 32)); }

/// Adds n x n squares of side 1, each of two triangles, in the plane through `origin` with orthonormal axes
/// s, t.
void addPlane(TriangleMesh& mesh, int n, const V3f& origin, const V3f& s, const V3f& t) {
    if (mesh.positions.empty())
        mesh.positions.resize(1);
    const uint32_t first = uint32_t(mesh.positions[0].size()), row = uint32_t(n + 1);
    for (int y = 0; y <= n; ++y)
        for (int x = 0; x <= n; ++x)
            mesh.positions[0].push_back(origin + s * float(x) + t * float(y));
    for (uint32_t y = 0; y < uint32_t(n); ++y)
        for (uint32_t x = 0; x < uint32_t(n); ++x) {
            const uint32_t v = first + y * row + x;
            for (const uint32_t i : {v, v + 1, v + row + 1, v, v + row + 1, v + row})
                mesh.indices.push_back(i);
        }
}

V3f positionOf(const TriangleMesh& mesh, uint32_t prim, float u, float v) {
    V3f p[3];
    triangleVertices(mesh, prim, 0, p);
    return p[0] * (1 - u - v) + p[1] * u + p[2] * v;
}

/// The cells of a mesh, with a tracer for their point queries and a cache of their points.
struct TracedCells {
    std::vector<Group> groups;
    Tracer tracer;
    MeshCells cells;
    MeshPointCache cache;

    explicit TracedCells(const TriangleMesh& mesh)
        : groups{groupOf(mesh)}, tracer(groups, {}),
          cells(*groups[0].geometries[0].placed.shape.mesh,
                [this](const V3f& p, float radius, const Tracer::PointQueryVisitor& visitor) {
                    tracer.pointQuery(0, 0, p, radius, visitor);
                }) {}
    static Group groupOf(const TriangleMesh& mesh) {
        Group group;
        group.geometries.emplace_back();
        group.geometries[0].placed.shape.mesh = std::make_shared<TriangleMesh>(mesh);
        return group;
    }
};

/// The points from which a position is interpolated.
struct Surroundings {
    bool isUsable = false; ///< MeshCells::surround
    V3f interpolated{0};   ///< the position, from those of the points
    std::vector<MeshPoint> points;
};

Surroundings surroundingsOf(const TriangleMesh& mesh, TracedCells& traced, uint32_t prim, float u, float v,
                            float cellArea) {
    Surroundings result;
    MeshCell lowest;
    V3f coords;
    result.isUsable = traced.cells.surround(prim, u, v, cellArea, lowest, coords);
    if (!result.isUsable)
        return result;
    float weights[8], weightSum = 0;
    LatticeCell::computeWeights(LatticeCell::Grid, coords, weights);
    std::optional<MeshPoint> points[8];
    traced.cells.findPoints(lowest, traced.cache, points);
    for (int k = 0; k < 8; ++k) {
        if (points[k]) {
            EXPECT_GT(weights[k], 0);
            result.interpolated += positionOf(mesh, points[k]->prim, points[k]->u, points[k]->v) * weights[k];
            weightSum += weights[k];
            result.points.push_back(*points[k]);
        }
    }
    result.interpolated *= 1 / weightSum;
    return result;
}

TEST(MeshCells, APlaneHasOnePointPerCellAreaAndInterpolatesPositions) {
    constexpr int kSquares = 160;
    constexpr float kCellSize = 5, kMargin = 10;
    constexpr float kCellArea = kCellSize * kCellSize / .5f; // in areas of a triangle
    for (uint64_t orientation = 0; orientation < 12; ++orientation) {
        // Normals with one, two and three equal components have no unique main direction; then random
        // normals.
        const V3f n =
            orientation < 3
                ? normalize(V3f(1, orientation > 0, orientation > 1))
                : normalize(V3f(random(orientation, 0), random(orientation, 1), random(orientation, 2)) -
                            V3f(.5f));
        const Frame frame = Frame::fromNormal(n);
        TriangleMesh mesh;
        addPlane(mesh, kSquares, V3f(.3f, .4f, .1f), frame.s, frame.t);
        TracedCells traced(mesh);
        std::set<std::tuple<uint32_t, float, float>> points;
        double error2 = 0;
        int positions = 0;
        for (uint32_t prim = 0; prim < mesh.triangleCount(); ++prim) {
            const V3f p = positionOf(mesh, prim, .3f, .3f), fromOrigin = p - mesh.positions[0][0];
            const float x = dot(fromOrigin, frame.s), y = dot(fromOrigin, frame.t), end = kSquares - kMargin;
            if (x < kMargin || y < kMargin || x > end || y > end)
                continue;
            const Surroundings s = surroundingsOf(mesh, traced, prim, .3f, .3f, kCellArea);
            ASSERT_TRUE(s.isUsable);
            ASSERT_FALSE(s.points.empty());
            for (const MeshPoint& point : s.points)
                points.insert({point.prim, point.u, point.v});
            error2 += double(length2(s.interpolated - p)) / (kCellSize * kCellSize);
            ++positions;
        }
        // The cells of a level have between 1/√2 and √2 of the requested area; the border adds half a cell on
        // each side.
        const double side = kSquares - 2 * kMargin, requestedPoints = side * side / (kCellSize * kCellSize);
        EXPECT_GT(double(points.size()), requestedPoints / M_SQRT2) << orientation;
        EXPECT_LT(double(points.size()), requestedPoints * M_SQRT2 * 1.15) << orientation;
        // The nearest point of a square grid is 0.41 cells away (root mean square); the interpolated position
        // is less than half as far.
        EXPECT_LT(std::sqrt(error2 / positions), .2) << orientation;
    }
}

/// Triangles of all sizes, from equilateral to slivers and points.
TriangleMesh degenerateTriangles() {
    TriangleMesh mesh;
    mesh.positions.resize(1);
    for (uint32_t i = 0; i < 3000; ++i) {
        const auto randomVector = [&](uint32_t k) {
            return V3f(random(i, k), random(i, k + 1), random(i, k + 2)) - V3f(.5f);
        };
        const float size = std::exp2(-8 * random(i, 20)), thinness = random(i, 21);
        const V3f p = randomVector(0) * 10.f, a = randomVector(3) * size;
        const V3f b = a * thinness + randomVector(6) * (size * sqr(thinness));
        for (const V3f& vertex : {p, p + a, p + b}) {
            mesh.indices.push_back(uint32_t(mesh.positions[0].size()));
            mesh.positions[0].push_back(vertex);
        }
    }
    return mesh;
}

TEST(MeshCells, AnyPositionIsSurroundedByAPoint) {
    const TriangleMesh mesh = degenerateTriangles();
    TracedCells traced(mesh);
    int usable = 0;
    for (uint32_t prim = 0; prim < mesh.triangleCount(); ++prim) {
        V3f p[3];
        triangleVertices(mesh, prim, 0, p);
        const float area = length(cross(p[1] - p[0], p[2] - p[0])) / 2;
        for (uint32_t k = 0; k < 64; ++k) {
            float u = random(prim, 2 * k), v = random(prim, 2 * k + 1);
            if (u + v > 1) {
                u = 1 - u;
                v = 1 - v;
            }
            const float cellSize = std::exp2(-6.f + float(k) / 8);
            const Surroundings s =
                surroundingsOf(mesh, traced, prim, u, v, sqr(cellSize) / std::max(area, 1e-12f));
            usable += s.isUsable;
            ASSERT_TRUE(!s.isUsable || !s.points.empty()) << prim << ' ' << k;
        }
    }
    EXPECT_GT(usable, 50000);
}

TEST(MeshCells, SidesOfAThinObjectDoNotSharePoints) {
    TriangleMesh mesh;
    addPlane(mesh, 40, V3f(0), V3f(1, 0, 0), V3f(0, 1, 0));
    const uint32_t frontCount = uint32_t(mesh.triangleCount());
    addPlane(mesh, 40, V3f(0, 0, .1f), V3f(0, 1, 0), V3f(1, 0, 0));
    TracedCells traced(mesh);
    for (uint32_t prim = 0; prim < mesh.triangleCount(); ++prim)
        for (const MeshPoint& point : surroundingsOf(mesh, traced, prim, .2f, .4f, 50).points)
            EXPECT_EQ(point.prim < frontCount, prim < frontCount);
}

TEST(MeshCells, TrianglesOfVerticesHaveAnAreaIfPossible) {
    TriangleMesh mesh;
    mesh.positions = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}}};
    mesh.indices = {0, 1, 1, 0, 1, 4, 0, 1, 2, 0, 2, 3, 4, 4, 4};
    TracedCells traced(mesh);
    const uint32_t expected[] = {2, 2, 2, 3, 1}; // vertex 4 has triangles of zero area only
    for (uint32_t vertex = 0; vertex < 5; ++vertex)
        EXPECT_EQ(traced.cells.triangleOf(vertex), expected[vertex]) << vertex;
}

TEST(MeshCells, LargeTrianglesAndSmallCellsAreNotUsable) {
    TriangleMesh mesh;
    addPlane(mesh, 20, V3f(0), V3f(1, 0, 0), V3f(0, 1, 0));
    const uint32_t vertex = uint32_t(mesh.positions[0].size());
    for (const V3f& p : {V3f(0, 0, 5), V3f(60, 0, 5), V3f(0, 1, 5)})
        mesh.positions[0].push_back(p);
    for (uint32_t k = 0; k < 3; ++k)
        mesh.indices.push_back(vertex + k);
    TracedCells traced(mesh);
    EXPECT_FALSE(surroundingsOf(mesh, traced, 7, .3f, .3f, .5f).isUsable);
    EXPECT_TRUE(surroundingsOf(mesh, traced, 7, .3f, .3f, 50).isUsable);
    EXPECT_FALSE(surroundingsOf(mesh, traced, 800, .3f, .3f, 1).isUsable);
}

/// A hemisphere of squares of two triangles. Triangles at the pole have two vertices there, and zero area.
std::string hemisphereWithPole() {
    constexpr int kRings = 16, kSegments = 32;
    std::string points, indices;
    for (int i = 0; i <= kRings; ++i) {
        for (int k = 0; k <= kSegments; ++k) {
            const float theta = .5f * kPi * float(i) / kRings, phi = 2 * kPi * float(k) / kSegments;
            const V3f onSphere(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                               std::cos(theta));
            const V3f p = i == 0 ? V3f(0, 0, 1) : onSphere;
            points += std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + " ";
        }
    }
    for (int i = 0; i < kRings; ++i) {
        for (int k = 0; k < kSegments; ++k) {
            const int a = i * (kSegments + 1) + k, b = a + kSegments + 1;
            for (const int index : {a, a + 1, b, b, a + 1, b + 1})
                indices += std::to_string(index) + " ";
        }
    }
    return R"(Shape "trianglemesh" "point3 P" [)" + points + R"(] "normal N" [)" + points +
           R"(] "integer indices" [)" + indices + "]\n";
}

TEST(MsaaCache, APoleWithTrianglesOfZeroAreaIsNotBlack) {
    const std::string scene = R"(
LookAt 0 0 9  0 0 0  0 1 0
Camera "perspective" "float fov" 12
Film "image" "integer xresolution" 24 "integer yresolution" 24
Integrator "directlighting"
WorldBegin
LightSource "distant" "point3 from" [0 0 2]
)" + hemisphereWithPole();
    const auto render = [&](const char* integrator) {
        BuildOptions options;
        options.integrator = integrator;
        return test::render(test::build(scene, options)).image.pixels;
    };
    const auto reference = render("supersample"), shared = render("msaa-cache");
    for (size_t i = 0; i < reference.size(); ++i)
        EXPECT_NEAR(shared[i].x, reference[i].x, .02f) << i;
}

TEST(MsaaCache, TrianglesSmallerThanBlocksDoNotAddShades) {
    double shades[2];
    for (const int levels : {5, 7}) {
        const std::string text = R"(
Film "image" "integer xresolution" 40 "integer yresolution" 40
Sampler "sobol" "integer pixelsamples" 16
Integrator "directlighting"
LookAt 0 0 -4  0 0 0  0 1 0
Camera "perspective" "float fov" 35
WorldBegin
LightSource "distant"
Material "matte"
Shape "loopsubdiv" "integer nlevels" )" +
                                 std::to_string(levels) + R"(
  "integer indices" [0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5]
  "point P" [1 0 0  -1 0 0  0 1 0  0 -1 0  0 0 1.5  0 0 -1.5]
)";
        BuildOptions options;
        options.integrator = "msaa-cache";
        // One thread, because two may shade the same point at the same time.
        shades[levels == 7] = double(test::render(test::build(text, options), 0, 1).stats.total.shades);
    }
    // 8,192 triangles are more than the image needs already; 131,072 are far more. The finer surface may be
    // larger by a twentieth.
    EXPECT_LE(shades[1], 1.05 * shades[0]);
}

} // namespace
} // namespace strobe
