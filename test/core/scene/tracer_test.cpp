// The tracer: hits agree with Scene::surface, and do not depend on the other rays of a packet.
#include "core/math/hash.h"
#include "core/math/sampling.h"
#include "support/render_text.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <numeric>
#include <random>

namespace strobe {
namespace {

const std::string kHead = R"(
    Camera "perspective" "float fov" 60
    WorldBegin
)";

/// A subdivided octahedron.
const std::string kMesh = R"(
    Shape "loopsubdiv" "integer nlevels" 3
      "integer indices" [0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5]
      "point P" [1 0 0  -1 0 0  0 1 0  0 -1 0  0 0 1.5  0 0 -1.5]
)";

/// `shape`, translated away from the origin, so that rounding errors show.
std::string distant(const std::string& shape) {
    return kHead + R"(
        Material "matte"
        AttributeBegin
          Translate 0 0 10
        )" +
           shape + "AttributeEnd\n";
}

/// `shape` with `motion` applied at the end of the shutter.
std::string moving(const std::string& motion, const std::string& shape) {
    return distant("ActiveTransform EndTime\n" + motion + "\nActiveTransform All\n" + shape);
}

/// `shape`, with a rotation of 90 degrees and a translation between each two of five keys.
std::string turning(const std::string& shape) {
    std::string keys;
    for (int i = 1; i < 5; ++i)
        keys += fmt::format(R"(
            ActiveTransform {}
            Translate {} 0 0
            Rotate {} 1 2 3
            )",
                            i, .3 * i, 90 * i);
    return "TransformTimes 0 .25 .5 .75 1\n" + distant(keys + "ActiveTransform All\n" + shape);
}

/// An instance of kMesh with `scale`.
std::string scaledInstance(const std::string& scale) {
    return kHead + "ObjectBegin \"a\"" + kMesh + "ObjectEnd\nScale " + scale + "\nObjectInstance \"a\"\n";
}

struct TimedRay {
    V3f o, d;
    float time;
};

std::vector<TimedRay> randomRays(int n) {
    std::mt19937 rng(7);
    std::uniform_real_distribution<float> u(0, 1);
    std::vector<TimedRay> rays;
    for (int i = 0; i < n; ++i) {
        const V3f from = V3f(0, 0, 10) + uniformSphere({u(rng), u(rng)}) * 6.f;
        const V3f to = V3f(0, 0, 10) + uniformSphere({u(rng), u(rng)}) * (1.3f * u(rng));
        rays.push_back({from, normalize(to - from), u(rng)});
    }
    return rays;
}

/// Traces rays in the given order, in packets of `width` rays. Returns the hit of each ray, by its index.
std::vector<Hit> trace(const Tracer& tracer, const std::vector<TimedRay>& rays, const std::vector<int>& order,
                       int width, bool coherent = false) {
    const ScopedFlushDenormals flushDenormals;
    std::vector<Hit> hits(rays.size());
    RayPacket packet;
    for (size_t first = 0; first < order.size(); first += size_t(width)) {
        const int n = int(std::min(order.size() - first, size_t(width)));
        for (int i = 0; i < n; ++i) {
            const TimedRay& r = rays[size_t(order[first + size_t(i)])];
            packet.set(i, r.o, r.d, 0, kInfinity, r.time);
        }
        tracer.intersect(packet, n, coherent);
        for (int i = 0; i < n; ++i)
            hits[size_t(order[first + size_t(i)])] = tracer.hit(packet, i);
    }
    return hits;
}

/// Traces rays in ascending order.
std::vector<Hit> trace(const Tracer& tracer, const std::vector<TimedRay>& rays) {
    std::vector<int> order(rays.size());
    std::iota(order.begin(), order.end(), 0);
    return trace(tracer, rays, order, 16);
}

bool same(const Hit& a, const Hit& b) {
    return a.geometry == b.geometry && a.instance == b.instance &&
           (!a || (a.prim == b.prim && !std::memcmp(&a.u, &b.u, 4) && !std::memcmp(&a.v, &b.v, 4) &&
                   !std::memcmp(&a.t, &b.t, 4)));
}

class TracerTest : public testing::TestWithParam<std::string> {};

TEST_P(TracerTest, SurfacePointsLieOnTheirRays) {
    const BuiltScene built = test::build(GetParam());
    const auto rays = randomRays(20000);
    const auto hits = trace(built.scene->tracer(), rays);
    int count = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
        if (!hits[i])
            continue;
        ++count;
        const SurfacePoint s = built.scene->surface(hits[i], rays[i].time);
        EXPECT_LT(length(s.p - (rays[i].o + rays[i].d * hits[i].t)), 2e-4f) << i;
        EXPECT_NEAR(length(s.ng), 1, 1e-5);
        EXPECT_NEAR(length(s.ns), 1, 1e-5);
        EXPECT_GT(dot(s.ng, s.ns), 0.5f);
    }
    EXPECT_GT(count, 5000);
}

bool same(const SurfacePoint& a, const SurfacePoint& b) {
    return a.p == b.p && a.ng == b.ng && a.ns == b.ns && a.uv == b.uv && a.dpdu == b.dpdu &&
           a.dpdv == b.dpdv && a.offset == b.offset && a.material == b.material && a.light == b.light &&
           a.prim == b.prim;
}

TEST_P(TracerTest, SoASurfacePointsEqualScalarOnes) {
    const BuiltScene built = test::build(GetParam());
    const auto rays = randomRays(20000);
    const auto hits = trace(built.scene->tracer(), rays);
    HitSoA chunk;
    V3SoA wo;
    SurfaceSoA surfaces;
    V2SoA duvdx, duvdy;
    float time[kSoAWidth], width[kSoAWidth];
    size_t rayIndex[kSoAWidth];
    const auto check = [&](int n) {
        built.scene->rawSurfaces(chunk, time, n, surfaces);
        footprints(surfaces, wo, width, 0, n, duvdx, duvdy);
        for (int i = 0; i < n; ++i) {
            RawSurfacePoint s = surfaces.at(i);
            TextureQuery q;
            footprint(s, rays[rayIndex[i]].d, width[i], q);
            EXPECT_EQ(q.duvdx, duvdx.at(i)) << rayIndex[i];
            EXPECT_EQ(q.duvdy, duvdy.at(i)) << rayIndex[i];
            s.finish();
            EXPECT_TRUE(same(s, built.scene->surface(hits[rayIndex[i]], time[i]))) << rayIndex[i];
        }
    };
    int n = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
        if (!hits[i])
            continue;
        chunk.set(n, hits[i]);
        wo.set(n, -rays[i].d);
        rayIndex[n] = i;
        time[n] = rays[i].time;
        width[n] = float(i % 7) * .01f;
        if (++n >= 1 + int(i % kSoAWidth))
            check(std::exchange(n, 0));
    }
    check(n);
}

TEST_P(TracerTest, HitsDoNotDependOnThePacket) {
    const BuiltScene built = test::build(GetParam());
    const auto rays = randomRays(50000);
    std::vector<int> order(rays.size());
    std::iota(order.begin(), order.end(), 0);
    const auto reference = trace(built.scene->tracer(), rays, order, 16);
    const auto narrow = trace(built.scene->tracer(), rays, order, 1);
    const auto coherent = trace(built.scene->tracer(), rays, order, 16, true);
    std::shuffle(order.begin(), order.end(), std::mt19937(3));
    const auto shuffled = trace(built.scene->tracer(), rays, order, 16);
    for (size_t i = 0; i < rays.size(); ++i) {
        EXPECT_TRUE(same(reference[i], narrow[i])) << i;
        EXPECT_TRUE(same(reference[i], shuffled[i])) << i;
        EXPECT_TRUE(same(reference[i], coherent[i])) << i;
    }
}

/// Returns the distance from p to the nearest vertex of a triangle at the first key.
float vertexDistance(const TriangleMesh& mesh, uint32_t prim, const V3f& p) {
    float least = kInfinity;
    for (size_t k = 0; k < 3; ++k)
        least = std::min(least, length(mesh.positions[0][mesh.indices[3 * size_t(prim) + k]] - p));
    return least;
}

void checkPointQuery(const Tracer& tracer, uint32_t group, uint32_t geometry, const TriangleMesh& mesh,
                     const V3f& p, float radius) {
    std::vector<bool> visited(mesh.triangleCount());
    tracer.pointQuery(group, geometry, p, radius, [&](uint32_t prim) {
        visited[prim] = true;
        return radius;
    });
    float nearest = kInfinity;
    for (uint32_t prim = 0; prim < mesh.triangleCount(); ++prim) {
        const float distance = vertexDistance(mesh, prim, p);
        nearest = std::min(nearest, distance);
        EXPECT_TRUE(visited[prim] || distance > radius) << prim;
    }
    // A shrinking radius finds the nearest vertex.
    float found = radius;
    tracer.pointQuery(group, geometry, p, radius, [&](uint32_t prim) {
        found = std::min(found, vertexDistance(mesh, prim, p));
        return found;
    });
    EXPECT_EQ(found, std::min(nearest, radius));
}

TEST_P(TracerTest, PointQueriesVisitAllTrianglesWithinTheRadius) {
    const BuiltScene built = test::build(GetParam());
    const Scene& scene = *built.scene;
    std::mt19937 rng(3);
    std::uniform_real_distribution<float> u(0, 1);
    for (uint32_t group = 0; group < scene.groups().size(); ++group)
        for (uint32_t g = 0; g < scene.groups()[group].geometries.size(); ++g) {
            const TriangleMesh* mesh = scene.groups()[group].geometries[g].placed.shape.mesh.get();
            if (!mesh)
                continue;
            size_t visits = 0;
            scene.tracer().pointQuery(group, g, V3f(0), kInfinity, [&](uint32_t) {
                ++visits;
                return kInfinity;
            });
            EXPECT_EQ(visits, mesh->triangleCount());
            for (int i = 0; i < 50; ++i) {
                const V3f p =
                    mesh->positions[0][rng() % mesh->vertexCount()] + uniformSphere({u(rng), u(rng)}) * .2f;
                checkPointQuery(scene.tracer(), group, g, *mesh, p, .1f + .4f * u(rng));
            }
        }
}

const std::string kDeformingQuad = R"(
    Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "integer keys" 3
      "point P" [-1 -1  0  1 -1  0  1 1 0  -1 1 0
                 -1 -1 .5  1 -1 .5  1 1 0  -1 1 0
                 -1 -1  0  1 -1  1  1 1 0  -1 1 0]
)";
const std::string kMovingInstance = kHead + "ObjectBegin \"a\"" + kMesh + R"(
    ObjectEnd
    AttributeBegin
      Translate 0 0 10
      Scale -1 1 1
      ActiveTransform EndTime
      Rotate 40 1 0 0
      ActiveTransform All
      ObjectInstance "a"
    AttributeEnd
)";
/// Several geometries, with texture coordinates, vertex normals and a material that needs footprints.
const std::string kMixedGeometries = kHead + R"(
    Texture "t" "rgb" "checkerboard"
    Material "matte" "texture Kd" "t"
    Translate 0 0 10
)" + kMesh + R"(
    AttributeBegin
      ReverseOrientation
      Translate 1 0 0
      Shape "sphere" "float phimax" 300
    AttributeEnd
    AttributeBegin
      Translate 0 1 .5
      Rotate 60 1 2 0
      Shape "disk"
    AttributeEnd
    Shape "trianglemesh" "integer indices" [0 1 2 0 2 3]
      "point P" [-1 -1 .2  1 -1 .2  1 1 0  -1 1 0]
      "float uv" [0 0  2 0  2 3  0 3] "normal N" [0 0 1  0 .1 1  .1 0 1  0 0 2]
)";

INSTANTIATE_TEST_SUITE_P(Scenes, TracerTest,
                         testing::Values(distant(kMesh), moving("Translate .4 .3 .2", kMesh), turning(kMesh),
                                         turning(R"(
                        Scale 1 .5 .7
                        Shape "sphere" "float radius" 1
                        )"),
                                         R"(Option "string conventions" "pbrt-v2")" +
                                             moving("Rotate 50 0 1 0\nScale 1 1.5 1", kMesh),
                                         kMovingInstance, distant(kDeformingQuad), kMixedGeometries));

// The determinant of such a transform, or its cofactors, are outside of the range of floats.
TEST(TracerScale, NormalsOfTinyAndHugeInstancesAreUnit) {
    const ScopedFlushDenormals flushDenormals;
    for (const char* scale : {"1e-10 1e-10 1e-10", "1e10 1e10 1e10"}) {
        const BuiltScene built = test::build(scaledInstance(scale));
        const SurfacePoint s = built.scene->surface({0, 0, 0, 0.2f, 0.3f, 1}, 0);
        EXPECT_NEAR(length(s.ng), 1, 1e-5) << scale;
        EXPECT_NEAR(length(s.ns), 1, 1e-5) << scale;
    }
}

size_t timeSteps(const std::string& text, const BuildOptions& options = {}) {
    return test::build(text, options).scene->tracer().counts().timeSteps;
}

TEST(TracerCost, StaticScenesHaveNoTimeSteps) {
    const BuiltScene still = test::build(distant(kMesh));
    EXPECT_EQ(still.scene->tracer().counts().timeSteps, 0u);
    EXPECT_EQ(still.scene->tracer().counts().instances, 0u);
    EXPECT_EQ(timeSteps(moving("Translate 1e-7 0 0", kMesh)), 0u) << "keys that are nearly equal";
    EXPECT_EQ(timeSteps(moving("Translate .1 0 0", kMesh)), 2u);
}

TEST(TracerCost, AnInstantaneousShutterMakesScenesStatic) {
    BuildOptions options;
    options.shutter = Shutter{.5f, .5f};
    EXPECT_EQ(timeSteps(turning(kMesh), options), 0u);
}

} // namespace
} // namespace strobe
