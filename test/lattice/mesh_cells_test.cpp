// The grids of cells that small triangles share: coverage, density, interpolation, separation.
#include "lattice/lattice_soa.h"

#include "core/math/hash.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <set>

namespace strobe {
namespace {

float random(uint64_t a, uint64_t b) { return unitFloat(uint32_t(hashOf(a, b) >> 32)); }

/// n x n squares of side 1, each of two triangles, in the plane through `origin` with orthonormal axes s, t.
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

V3f pointOf(const TriangleMesh& mesh, uint32_t prim, float u, float v) {
    V3f p[3];
    triangleVertices(mesh, prim, 0, p);
    return p[0] * (1 - u - v) + p[1] * u + p[2] * v;
}

/// A mesh's cells, and what they look for triangles in.
struct TracedCells {
    std::vector<Group> groups;
    Tracer tracer;
    MeshCells cells;

    explicit TracedCells(const TriangleMesh& mesh)
        : groups{groupOf(mesh)}, tracer(groups, {}),
          cells(*groups[0].geometries[0].placed.shape.mesh,
                [this](const V3f& p, float radius, const Tracer::PointQueryVisitor& look) {
                    tracer.pointQuery(0, 0, p, radius, look);
                }) {}
    static Group groupOf(const TriangleMesh& mesh) {
        Group group;
        group.geometries.emplace_back();
        group.geometries[0].placed.shape.mesh = std::make_shared<TriangleMesh>(mesh);
        return group;
    }
};

struct Mixture {
    bool among = false;
    int count = 0;
    V3f p{0}; ///< of the places, by weight
    std::vector<MeshPoint> places;
};

Mixture mixtureAt(const TriangleMesh& mesh, const TracedCells& traced, uint32_t prim, float u, float v,
                  float cellArea) {
    Mixture m;
    MeshCell lowest;
    V3f place;
    const MeshCells& cells = traced.cells;
    m.among = cells.surround(prim, u, v, cellArea, lowest, place);
    if (!m.among)
        return m;
    float weights[8], sum = 0;
    LatticeCell::weigh(LatticeCell::Grid, place, weights);
    std::optional<MeshPoint> places[8];
    MeshPointCache known;
    cells.places(lowest, known, places);
    for (int k = 0; k < 8; ++k)
        if (places[k]) {
            EXPECT_GT(weights[k], 0);
            m.p += pointOf(mesh, places[k]->prim, places[k]->u, places[k]->v) * weights[k];
            sum += weights[k];
            m.places.push_back(*places[k]);
        }
    m.p *= 1 / sum;
    m.count = int(m.places.size());
    return m;
}

TEST(MeshCells, HoldOnePlacePerCellOfAPlaneAndInterpolateByPosition) {
    constexpr int kSquares = 160;
    constexpr float kSize = 5, kMargin = 10;
    for (uint64_t turn = 0; turn < 12; ++turn) {
        const V3f n = turn < 3
                          ? normalize(V3f(1, turn > 0, turn > 1)) // no axis is more the main one than another
                          : normalize(V3f(random(turn, 0), random(turn, 1), random(turn, 2)) - V3f(.5f));
        const Frame frame = Frame::fromNormal(n);
        TriangleMesh mesh;
        addPlane(mesh, kSquares, V3f(.3f, .4f, .1f), frame.s, frame.t);
        const TracedCells cells(mesh);
        std::set<std::tuple<uint32_t, float, float>> used;
        double error2 = 0, cellArea = kSize * kSize / .5;
        int hits = 0;
        for (uint32_t prim = 0; prim < mesh.triangleCount(); ++prim) {
            const V3f p = pointOf(mesh, prim, .3f, .3f), q = p - mesh.positions[0][0];
            const float x = dot(q, frame.s), y = dot(q, frame.t), most = kSquares - kMargin;
            if (x < kMargin || y < kMargin || x > most || y > most)
                continue;
            const Mixture m = mixtureAt(mesh, cells, prim, .3f, .3f, float(cellArea));
            ASSERT_TRUE(m.among);
            ASSERT_GT(m.count, 0);
            for (const MeshPoint& place : m.places)
                used.insert({place.prim, place.u, place.v});
            error2 += double(length2(m.p - p)) / (kSize * kSize);
            ++hits;
        }
        // A level's cells have between 1/√2 and √2 of the area asked for; the rim adds half a cell all
        // around.
        const double side = kSquares - 2 * kMargin, asked = side * side / (kSize * kSize);
        EXPECT_GT(double(used.size()), asked / M_SQRT2) << turn;
        EXPECT_LT(double(used.size()), asked * M_SQRT2 * 1.15) << turn;
        // The nearest of a square grid is 0.41 cells away, root mean square; mixed, they are less than half
        // as far.
        EXPECT_LT(std::sqrt(error2 / hits), .2) << turn;
    }
}

TEST(MeshCells, AnyPointOfAnyTriangleHasAPlace) {
    // Slivers, points and triangles of all sizes: none may find eight empty cells.
    TriangleMesh mesh;
    mesh.positions.resize(1);
    for (uint32_t i = 0; i < 3000; ++i) {
        const auto at = [&](uint32_t k) {
            return V3f(random(i, k), random(i, k + 1), random(i, k + 2)) - V3f(.5f);
        };
        const float size = std::exp2(-8 * random(i, 20)), thin = random(i, 21);
        const V3f p = at(0) * 10.f, a = at(3) * size, b = a * thin + at(6) * (size * sqr(thin));
        for (const V3f& vertex : {p, p + a, p + b}) {
            mesh.indices.push_back(uint32_t(mesh.positions[0].size()));
            mesh.positions[0].push_back(vertex);
        }
    }
    const TracedCells cells(mesh);
    int among = 0;
    for (uint32_t prim = 0; prim < mesh.triangleCount(); ++prim)
        for (uint32_t k = 0; k < 64; ++k) {
            float u = random(prim, 2 * k), v = random(prim, 2 * k + 1);
            if (u + v > 1)
                u = 1 - u, v = 1 - v;
            V3f p[3];
            triangleVertices(mesh, prim, 0, p);
            const float area = length(cross(p[1] - p[0], p[2] - p[0])) / 2,
                        size = std::exp2(-6.f + float(k) / 8);
            const Mixture m = mixtureAt(mesh, cells, prim, u, v, sqr(size) / std::max(area, 1e-12f));
            among += m.among;
            ASSERT_TRUE(!m.among || m.count > 0) << prim << ' ' << k;
        }
    EXPECT_GT(among, 50000);
}

TEST(MeshCells, TwoSidesOfAThinThingDoNotMix) {
    TriangleMesh mesh;
    addPlane(mesh, 40, V3f(0), V3f(1, 0, 0), V3f(0, 1, 0));
    const uint32_t front = uint32_t(mesh.triangleCount());
    addPlane(mesh, 40, V3f(0, 0, .1f), V3f(0, 1, 0), V3f(1, 0, 0));
    const TracedCells cells(mesh);
    for (uint32_t prim = 0; prim < mesh.triangleCount(); ++prim)
        for (const MeshPoint& place : mixtureAt(mesh, cells, prim, .2f, .4f, 50).places)
            EXPECT_EQ(place.prim < front, prim < front);
}

TEST(MeshCells, VerticesAreNotPlacedInTrianglesWithoutArea) {
    TriangleMesh mesh;
    mesh.positions = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}}};
    mesh.indices = {0, 1, 1, 0, 1, 4, 0, 1, 2, 0, 2, 3, 4, 4, 4};
    const TracedCells traced(mesh);
    const uint32_t expected[] = {2, 2, 2, 3, 1}; // vertex 4 is of no other
    for (uint32_t vertex = 0; vertex < 5; ++vertex)
        EXPECT_EQ(traced.cells.triangleOf(vertex), expected[vertex]) << vertex;
}

TEST(MsaaCache, APoleOfTrianglesWithoutAreaIsNotBlack) {
    constexpr int kRings = 16, kAround = 32;
    std::string points, indices; // two triangles a square: those at the pole have two corners there
    for (int i = 0; i <= kRings; ++i)
        for (int k = 0; k <= kAround; ++k) {
            const float theta = .5f * kPi * float(i) / kRings, phi = 2 * kPi * float(k) / kAround;
            const V3f p(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
            const V3f at = i == 0 ? V3f(0, 0, 1) : p;
            points += std::to_string(at.x) + " " + std::to_string(at.y) + " " + std::to_string(at.z) + " ";
        }
    for (int i = 0; i < kRings; ++i)
        for (int k = 0; k < kAround; ++k) {
            const int a = i * (kAround + 1) + k, b = a + kAround + 1;
            for (const int index : {a, a + 1, b, b, a + 1, b + 1})
                indices += std::to_string(index) + " ";
        }
    const std::string scene = "LookAt 0 0 9 0 0 0 0 1 0\nCamera \"perspective\" \"float fov\" 12\n"
                              "Film \"image\" \"integer xresolution\" 24 \"integer yresolution\" 24\n"
                              "Integrator \"directlighting\"\nWorldBegin\n"
                              "LightSource \"distant\" \"point3 from\" [0 0 2]\n"
                              "Shape \"trianglemesh\" \"point3 P\" [" +
                              points + "] \"normal N\" [" + points + "] \"integer indices\" [" + indices +
                              "]\n";
    const auto image = [&](const char* integrator) {
        BuildOptions options;
        options.integrator = integrator;
        return test::render(test::build(scene, options)).image.pixels;
    };
    const auto truth = image("supersample"), shared = image("msaa-cache");
    for (size_t i = 0; i < truth.size(); ++i)
        EXPECT_NEAR(shared[i].x, truth[i].x, .02f) << i;
}

TEST(MeshCells, LargeTrianglesAndFineCellsAreLeftToTheVertices) {
    TriangleMesh mesh;
    addPlane(mesh, 20, V3f(0), V3f(1, 0, 0), V3f(0, 1, 0));
    const uint32_t vertex = uint32_t(mesh.positions[0].size());
    for (const V3f& p : {V3f(0, 0, 5), V3f(60, 0, 5), V3f(0, 1, 5)})
        mesh.positions[0].push_back(p);
    for (uint32_t k = 0; k < 3; ++k)
        mesh.indices.push_back(vertex + k);
    const TracedCells cells(mesh);
    EXPECT_FALSE(mixtureAt(mesh, cells, 7, .3f, .3f, .5f).among);
    EXPECT_TRUE(mixtureAt(mesh, cells, 7, .3f, .3f, 50).among);
    EXPECT_FALSE(mixtureAt(mesh, cells, 800, .3f, .3f, 1).among);
}

TEST(MsaaCache, TrianglesBeyondAllNeedShadeNoMore) {
    double shades[2];
    for (const int levels : {5, 7}) {
        const std::string text =
            "Film \"image\" \"integer xresolution\" 40 \"integer yresolution\" 40\n"
            "Sampler \"sobol\" \"integer pixelsamples\" 16\nIntegrator \"directlighting\"\n"
            "LookAt 0 0 -4 0 0 0 0 1 0\nCamera \"perspective\" \"float fov\" 35\nWorldBegin\n"
            "LightSource \"distant\"\nMaterial \"matte\"\nShape \"loopsubdiv\" \"integer nlevels\" " +
            std::to_string(levels) +
            " \"integer indices\" [0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5] "
            "\"point P\" [1 0 0  -1 0 0  0 1 0  0 -1 0  0 0 1.5  0 0 -1.5]\n";
        BuildOptions options;
        options.integrator = "msaa-cache";
        // One thread: two may shade the same place at the same moment, now and then.
        shades[levels == 7] = double(test::render(test::build(text, options), 0, 1).stats.total.shades);
    }
    // 8,192 triangles are already more than the picture needs, 131,072 far more. A twentieth is left for what
    // the finer surface is larger.
    EXPECT_LE(shades[1], 1.05 * shades[0]);
}

} // namespace
} // namespace strobe
