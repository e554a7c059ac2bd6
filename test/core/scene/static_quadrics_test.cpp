// StaticQuadrics trace the first quadrics of group 0; Embree traces the others. The results are the same.
#include "core/scene/static_quadrics.h"

#include "core/math/sampling.h"
#include "support/render_text.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

namespace strobe {
namespace {

const std::string kHead = R"(
    Camera "perspective"
    WorldBegin
)";
/// Three quadrics and a triangle; the first quadric is a light.
const std::string kShapes = R"(
    AttributeBegin
      AreaLightSource "diffuse"
      Translate 0 0 3
      Shape "sphere"
    AttributeEnd
    Shape "disk" "float radius" 4
    Shape "sphere" "float radius" 2 "float zmax" 1 "float phimax" 250
    Shape "trianglemesh" "integer indices" [0 1 2] "point P" [-5 -5 1.5  5 -5 1.5  0 5 1.5]
)";

constexpr uint32_t kTriangle = 3; ///< index of the geometry

/// Returns n spheres far from all rays of the tests.
std::string farSpheres(size_t n) {
    std::string text;
    for (size_t i = 0; i < n; ++i)
        text += fmt::format(R"(
            AttributeBegin
              Translate 0 {} 0
              Shape "sphere"
            AttributeEnd
            )",
                            1000 + 3 * i);
    return text;
}

/// Random rays around the center of the scene, half of them with a finite tfar.
RayPacket randomPacket(std::mt19937& rng) {
    std::uniform_real_distribution<float> u(0, 1);
    RayPacket packet;
    for (int i = 0; i < RayPacket::kSize; ++i) {
        const V3f from = uniformSphere({u(rng), u(rng)}) * (8 * u(rng));
        const V3f to = uniformSphere({u(rng), u(rng)}) * (4 * u(rng)) + V3f(0, 0, 1);
        const float tfar = u(rng) < .5f ? kInfinity : 6 * u(rng);
        packet.set(i, from, normalize(to - from), 1e-4f, tfar, .5f);
    }
    return packet;
}

TEST(StaticQuadrics, HitsAndOcclusionsEqualThoseOfEmbree) {
    // The far spheres of the second scene take up all static quadrics, so that Embree traces the others.
    const uint32_t shift = uint32_t(StaticQuadrics::kMax);
    const BuiltScene withStatic = test::build(kHead + kShapes);
    const BuiltScene withEmbree = test::build(kHead + farSpheres(shift) + kShapes);
    EXPECT_EQ(withStatic.scene->tracer().counts().quadrics, 3u);
    EXPECT_EQ(withEmbree.scene->tracer().counts().quadrics, 3u + shift);
    std::mt19937 rng(3);
    std::vector<int> hitsPerGeometry(4);
    int occlusions = 0;
    for (int k = 0; k < 2000; ++k) {
        const RayPacket rays = randomPacket(rng);
        const int n = 1 + k % RayPacket::kSize;
        RayPacket hits = rays, embreeHits = rays, occluded = rays, embreeOccluded = rays;
        withStatic.scene->tracer().intersect(hits, n, false);
        withEmbree.scene->tracer().intersect(embreeHits, n, false);
        withStatic.scene->tracer().occluded(occluded, n);
        withEmbree.scene->tracer().occluded(embreeOccluded, n);
        for (int i = 0; i < n; ++i) {
            ASSERT_EQ(hits.tfar[i], embreeHits.tfar[i]) << k << ' ' << i;
            ASSERT_EQ(occluded.tfar[i] < 0, embreeOccluded.tfar[i] < 0) << k << ' ' << i;
            ASSERT_EQ(occluded.tfar[i] < 0, hits.geom[i] != kNone) << k << ' ' << i;
            occlusions += occluded.tfar[i] < 0;
            if (hits.geom[i] == kNone)
                continue;
            ASSERT_EQ(hits.geom[i] + shift, embreeHits.geom[i]);
            ASSERT_EQ(hits.prim[i], embreeHits.prim[i]);
            ASSERT_EQ(hits.inst[i], embreeHits.inst[i]);
            ASSERT_EQ(hits.u[i], embreeHits.u[i]);
            ASSERT_EQ(hits.v[i], embreeHits.v[i]);
            ++hitsPerGeometry[hits.geom[i]];
        }
        // Inactive rays: on CPUs without AVX-512, Embree writes hits of the triangle to them, too.
        for (int i = n; i < RayPacket::kSize; ++i) {
            ASSERT_TRUE(hits.geom[i] == kNone || hits.geom[i] == kTriangle) << "inactive ray";
            if (hits.geom[i] == kNone) {
                ASSERT_EQ(occluded.tfar[i], rays.tfar[i]) << "inactive ray";
            }
        }
    }
    EXPECT_GT(*std::min_element(hitsPerGeometry.begin(), hitsPerGeometry.end()), 500);
    EXPECT_GT(occlusions, 5000);
}

TEST(StaticQuadrics, RaysToALightIgnoreItsOwnShapeOnly) {
    const BuiltScene built = test::build(kHead + kShapes);
    RayPacket rays;
    for (int i = 0; i < 4; ++i)
        rays.set(i, V3f(.3f, .2f, 9), V3f(0, 0, -1), 0, i < 2 ? 6.5f : 100.f, 0);
    rays.id[1] = RayPacket::idOfLight(0);
    rays.id[3] = RayPacket::idOfLight(0);
    built.scene->tracer().occluded(rays, 4);
    EXPECT_LT(rays.tfar[0], 0) << "a ray without the light's id hits the light";
    EXPECT_EQ(rays.tfar[1], 6.5f) << "a ray with the light's id does not";
    EXPECT_LT(rays.tfar[2], 0);
    EXPECT_LT(rays.tfar[3], 0) << "a triangle and the disk are behind the light";
    rays.set(0, V3f(.3f, .2f, 9), V3f(0, 0, -1), 0, 6.5f, 0);
    rays.id[0] = RayPacket::idOfLight(1);
    built.scene->tracer().occluded(rays, 1);
    EXPECT_LT(rays.tfar[0], 0) << "a ray with another light's id hits the light";
}

TEST(StaticQuadrics, BelongToTheSceneBounds) {
    const BuiltScene built = test::build(kHead + farSpheres(1) + kShapes);
    const Box3f box = built.scene->tracer().bounds();
    EXPECT_NEAR(box.max.y, 1001, .01);
    EXPECT_NEAR(box.max.z, 4, .01);
    EXPECT_NEAR(box.min.z, -2, .01);
}

} // namespace
} // namespace strobe
