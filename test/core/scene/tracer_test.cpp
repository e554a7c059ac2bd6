// The tracer and shading must agree on where a moving surface is, and lanes must not know their neighbors.
#include "core/math/hash.h"
#include "core/math/sampling.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>
#include <numeric>
#include <random>

namespace strobe {
namespace {

const char* kHead = "Camera \"perspective\" \"float fov\" 60\nWorldBegin\n";

// An octahedron-like mesh far from the origin, so that rounding shows.
const char* kMesh = "Shape \"loopsubdiv\" \"integer nlevels\" 3 \"integer indices\" "
                    "[0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5] "
                    "\"point P\" [1 0 0  -1 0 0  0 1 0  0 -1 0  0 0 1.5  0 0 -1.5]\n";

std::string movingScene(const std::string& shape, const std::string& header = kHead) {
    return header + "Material \"matte\"\nAttributeBegin\nTranslate 0 0 10\n" + shape + "AttributeEnd\n";
}

const std::string kTurning = std::string("TransformTimes 0 .25 .5 .75 1\n") + kHead;
std::string turningScene(const std::string& shape) {
    std::string text = kTurning + "Material \"matte\"\nAttributeBegin\nTranslate 0 0 10\n";
    for (int i = 1; i < 5; ++i)
        text += "ActiveTransform " + std::to_string(i) + "\nTranslate " + std::to_string(.3 * i) +
                " 0 0\nRotate " + std::to_string(90 * i) + " 1 2 3\n";
    return text + "ActiveTransform All\n" + shape + "AttributeEnd\n";
}

struct Ray1 {
    V3f o, d;
    float time;
};

std::vector<Ray1> randomRays(int n) {
    std::mt19937 rng(7);
    std::uniform_real_distribution<float> u(0, 1);
    std::vector<Ray1> rays;
    for (int i = 0; i < n; ++i) {
        const V3f from = V3f(0, 0, 10) + uniformSphere({u(rng), u(rng)}) * 6.f;
        const V3f to = V3f(0, 0, 10) + uniformSphere({u(rng), u(rng)}) * (1.3f * u(rng));
        rays.push_back({from, normalize(to - from), u(rng)});
    }
    return rays;
}

/// Traces in packets of the given order; out[i] is the hit of rays[i].
std::vector<Hit> trace(const Tracer& tracer, const std::vector<Ray1>& rays, const std::vector<int>& order,
                       int width, bool coherent = false) {
    const ScopedFlushDenormals fast;
    std::vector<Hit> hits(rays.size());
    RayPacket packet;
    for (size_t first = 0; first < order.size(); first += size_t(width)) {
        const int n = int(std::min(order.size() - first, size_t(width)));
        for (int i = 0; i < n; ++i) {
            const Ray1& r = rays[size_t(order[first + size_t(i)])];
            packet.set(i, r.o, r.d, 0, kInfinity, r.time);
        }
        tracer.intersect(packet, n, coherent);
        for (int i = 0; i < n; ++i)
            hits[size_t(order[first + size_t(i)])] = tracer.hit(packet, i);
    }
    return hits;
}

/// In their own order.
std::vector<Hit> trace(const Tracer& tracer, const std::vector<Ray1>& rays) {
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

TEST_P(TracerTest, SurfaceIsWhereTheRayMetIt) {
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

TEST_P(TracerTest, SurfacesSideBySideAreThoseOneByOne) {
    const BuiltScene built = test::build(GetParam());
    const auto rays = randomRays(20000);
    const auto hits = trace(built.scene->tracer(), rays);
    HitSoA lanes;
    V3SoA wo;
    SurfaceSoA surfaces;
    V2SoA duvdx, duvdy;
    float time[kSoAWidth], width[kSoAWidth];
    size_t from[kSoAWidth];
    const auto check = [&](int n) {
        built.scene->rawSurfaces(lanes, time, n, surfaces);
        footprints(surfaces, wo, width, 0, n, duvdx, duvdy);
        for (int i = 0; i < n; ++i) {
            RawSurfacePoint s = surfaces.at(i);
            TextureQuery q;
            footprint(s, rays[from[i]].d, width[i], q);
            EXPECT_EQ(q.duvdx, duvdx.at(i)) << from[i];
            EXPECT_EQ(q.duvdy, duvdy.at(i)) << from[i];
            s.finish();
            EXPECT_TRUE(same(s, built.scene->surface(hits[from[i]], time[i]))) << from[i];
        }
    };
    int n = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
        if (!hits[i])
            continue;
        lanes.set(n, hits[i]), wo.set(n, -rays[i].d);
        from[n] = i, time[n] = rays[i].time, width[n] = float(i % 7) * .01f;
        if (++n >= 1 + int(i % kSoAWidth))
            check(std::exchange(n, 0));
    }
    check(n);
}

TEST_P(TracerTest, LanesAreIndependent) {
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

/// How far a triangle's nearest corner is, as the mesh is at its first key.
float cornerDistance(const TriangleMesh& mesh, uint32_t prim, const V3f& p) {
    float least = kInfinity;
    for (size_t k = 0; k < 3; ++k)
        least = std::min(least, length(mesh.positions[0][mesh.indices[3 * size_t(prim) + k]] - p));
    return least;
}

TEST_P(TracerTest, TrianglesAroundAPointAreShown) {
    const BuiltScene built = test::build(GetParam());
    const Scene& scene = *built.scene;
    std::mt19937 rng(3);
    std::uniform_real_distribution<float> u(0, 1);
    for (uint32_t group = 0; group < scene.groups().size(); ++group)
        for (uint32_t g = 0; g < scene.groups()[group].geometries.size(); ++g) {
            const TriangleMesh* mesh = scene.groups()[group].geometries[g].placed.shape.mesh.get();
            if (!mesh)
                continue;
            size_t all = 0;
            scene.tracer().pointQuery(group, g, V3f(0), kInfinity, [&](uint32_t) {
                ++all;
                return kInfinity;
            });
            EXPECT_EQ(all, mesh->triangleCount());
            for (int i = 0; i < 50; ++i) {
                const V3f p =
                    mesh->positions[0][rng() % mesh->vertexCount()] + uniformSphere({u(rng), u(rng)}) * .2f;
                const float radius = .1f + .4f * u(rng);
                std::vector<bool> shown(mesh->triangleCount());
                scene.tracer().pointQuery(group, g, p, radius, [&](uint32_t prim) {
                    shown[prim] = true;
                    return radius;
                });
                float least = kInfinity, found = radius;
                for (uint32_t prim = 0; prim < mesh->triangleCount(); ++prim) {
                    const float distance = cornerDistance(*mesh, prim, p);
                    least = std::min(least, distance);
                    EXPECT_TRUE(shown[prim] || distance > radius) << prim;
                }
                scene.tracer().pointQuery(group, g, p, radius, [&](uint32_t prim) {
                    return found = std::min(found, cornerDistance(*mesh, prim, p));
                });
                EXPECT_EQ(found, std::min(least, radius));
            }
        }
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, TracerTest,
    testing::Values(
        movingScene(kMesh),
        movingScene("ActiveTransform EndTime\nTranslate .4 .3 .2\nActiveTransform All\n" +
                    std::string(kMesh)),
        turningScene(kMesh), turningScene("Scale 1 .5 .7\nShape \"sphere\" \"float radius\" 1\n"),
        "Option \"string conventions\" \"pbrt-v2\"\n" +
            movingScene("ActiveTransform EndTime\nRotate 50 0 1 0\nScale 1 1.5 1\nActiveTransform All\n" +
                        std::string(kMesh)),
        std::string(kHead) + "ObjectBegin \"a\"\n" + kMesh +
            "ObjectEnd\nAttributeBegin\nTranslate 0 0 10\nScale -1 1 1\n"
            "ActiveTransform EndTime\nRotate 40 1 0 0\nActiveTransform All\nObjectInstance "
            "\"a\"\nAttributeEnd\n",
        movingScene(
            "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"integer keys\" 3 \"point P\" "
            "[-1 -1 0 1 -1 0 1 1 0 -1 1 0  -1 -1 .5 1 -1 .5 1 1 0 -1 1 0  -1 -1 0 1 -1 1 1 1 0 -1 1 0]\n")));

// Far from one, the determinant of an instance's transform, or its cofactors, leave the range of floats.
TEST(TracerScale, NormalsOfTinyAndHugeInstances) {
    const ScopedFlushDenormals fast;
    for (const char* scale : {"1e-10", "1e10"}) {
        const BuiltScene built =
            test::build(std::string(kHead) + "ObjectBegin \"a\"\n" + kMesh + "ObjectEnd\nScale " + scale +
                        " " + scale + " " + scale + "\nObjectInstance \"a\"\n");
        const SurfacePoint s = built.scene->surface({0, 0, 0, 0.2f, 0.3f, 1}, 0);
        EXPECT_NEAR(length(s.ng), 1, 1e-5) << scale;
        EXPECT_NEAR(length(s.ns), 1, 1e-5) << scale;
    }
}

// Several geometries in turn, with texture coordinates, normals and a texture that asks for footprints.
INSTANTIATE_TEST_SUITE_P(
    Mixed, TracerTest,
    testing::Values(
        std::string(kHead) +
        "Texture \"t\" \"rgb\" \"checkerboard\"\nMaterial \"matte\" \"texture Kd\" \"t\"\n"
        "Translate 0 0 10\n" +
        kMesh +
        "AttributeBegin\nReverseOrientation\nTranslate 1 0 0\nShape \"sphere\" \"float phimax\" 300\n"
        "AttributeEnd\nAttributeBegin\nTranslate 0 1 .5\nRotate 60 1 2 0\nShape \"disk\"\nAttributeEnd\n"
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-1 -1 .2 1 -1 .2 1 1 0 -1 1 "
        "0] "
        "\"float uv\" [0 0 2 0 2 3 0 3] \"normal N\" [0 0 1 0 .1 1 .1 0 1 0 0 2]\n"));

TEST(TracerCost, StillSceneHasNoTimeSteps) {
    const BuiltScene still = test::build(movingScene(kMesh));
    EXPECT_EQ(still.scene->tracer().counts().timeSteps, 0u);
    EXPECT_EQ(still.scene->tracer().counts().instances, 0u);
    const BuiltScene nearly = test::build(movingScene(
        "ActiveTransform EndTime\nTranslate 1e-7 0 0\nActiveTransform All\n" + std::string(kMesh)));
    EXPECT_EQ(nearly.scene->tracer().counts().timeSteps, 0u);
    const BuiltScene moving = test::build(
        movingScene("ActiveTransform EndTime\nTranslate .1 0 0\nActiveTransform All\n" + std::string(kMesh)));
    EXPECT_EQ(moving.scene->tracer().counts().timeSteps, 2u);
}

TEST(TracerCost, FrameTimeFreezesEverything) {
    BuildOptions options;
    options.shutter = Shutter{.5f, .5f};
    const BuiltScene frozen = test::build(turningScene(kMesh), options);
    EXPECT_EQ(frozen.scene->tracer().counts().timeSteps, 0u);
}

} // namespace
} // namespace strobe
