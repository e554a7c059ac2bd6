// The first quadrics of the world are traced beside Embree, the others in it: nobody may tell which.
#include "core/math/sampling.h"
#include "core/scene/static_quadrics.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <random>

namespace strobe {
namespace {

const char* kHead = "Camera \"perspective\"\nWorldBegin\n";
const char* kThree =
    "AttributeBegin\nAreaLightSource \"diffuse\"\nTranslate 0 0 3\nShape \"sphere\"\nAttributeEnd\n"
    "Shape \"disk\" \"float radius\" 4\n"
    "Shape \"sphere\" \"float radius\" 2 \"float zmax\" 1 \"float phimax\" 250\n"
    "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [-5 -5 1.5  5 -5 1.5  0 5 1.5]\n";

/// Far from all rays.
std::string others(size_t n) {
    std::string text;
    for (size_t i = 0; i < n; ++i)
        text += "AttributeBegin\nTranslate 0 " + std::to_string(1000 + 3 * i) +
                " 0\nShape \"sphere\"\nAttributeEnd\n";
    return text;
}

struct Block : RayPacket {
    /// Rays about the middle of the scene, of which some end in it.
    explicit Block(std::mt19937& rng) {
        std::uniform_real_distribution<float> u(0, 1);
        for (int i = 0; i < kSize; ++i) {
            const V3f from = uniformSphere({u(rng), u(rng)}) * (8 * u(rng));
            const V3f to = uniformSphere({u(rng), u(rng)}) * (4 * u(rng)) + V3f(0, 0, 1);
            const float far = u(rng) < .5f ? kInfinity : 6 * u(rng);
            set(i, from, normalize(to - from), 1e-4f, far, .5f);
        }
    }
};

TEST(StaticQuadrics, AreHitAsThoseInEmbree) {
    const BuiltScene few = test::build(kHead + std::string(kThree));
    const uint32_t shift = uint32_t(StaticQuadrics::kMax);
    const BuiltScene many = test::build(kHead + others(shift) + kThree);
    EXPECT_EQ(few.scene->tracer().counts().quadrics, 3u);
    EXPECT_EQ(many.scene->tracer().counts().quadrics, 3u + shift);
    std::mt19937 rng(3);
    std::vector<int> met(4);
    int blocked = 0;
    for (int k = 0; k < 2000; ++k) {
        const Block rays(rng);
        const int n = 1 + k % RayPacket::kSize;
        RayPacket a = rays, b = rays, c = rays, d = rays;
        few.scene->tracer().intersect(a, n, false);
        many.scene->tracer().intersect(b, n, false);
        few.scene->tracer().occluded(c, n);
        many.scene->tracer().occluded(d, n);
        for (int i = 0; i < n; ++i) {
            ASSERT_EQ(a.tfar[i], b.tfar[i]) << k << ' ' << i;
            ASSERT_EQ(c.tfar[i] < 0, d.tfar[i] < 0) << k << ' ' << i;
            ASSERT_EQ(c.tfar[i] < 0, a.geom[i] != kNone) << k << ' ' << i;
            blocked += c.tfar[i] < 0;
            if (a.geom[i] == kNone)
                continue;
            ASSERT_EQ(a.geom[i] + shift, b.geom[i]);
            ASSERT_EQ(a.prim[i], b.prim[i]);
            ASSERT_EQ(a.inst[i], b.inst[i]);
            ASSERT_EQ(a.u[i], b.u[i]);
            ASSERT_EQ(a.v[i], b.v[i]);
            ++met[a.geom[i]];
        }
        for (int i = n; i < RayPacket::kSize; ++i) {
            ASSERT_EQ(a.geom[i], kNone) << "not asked for";
            ASSERT_EQ(c.tfar[i], rays.tfar[i]) << "not asked for";
        }
    }
    EXPECT_GT(*std::min_element(met.begin(), met.end()), 500);
    EXPECT_GT(blocked, 5000);
}

TEST(StaticQuadrics, ARayToALightAsksAllShapesButItsOwn) {
    const BuiltScene built = test::build(kHead + std::string(kThree));
    RayPacket rays;
    for (int i = 0; i < 4; ++i)
        rays.set(i, V3f(.3f, .2f, 9), V3f(0, 0, -1), 0, i < 2 ? 6.5f : 100.f, 0);
    rays.id[1] = rays.id[3] = RayPacket::idOfLight(0);
    built.scene->tracer().occluded(rays, 4);
    EXPECT_LT(rays.tfar[0], 0) << "the lamp is in its way";
    EXPECT_EQ(rays.tfar[1], 6.5f) << "it ends at the lamp";
    EXPECT_LT(rays.tfar[2], 0);
    EXPECT_LT(rays.tfar[3], 0) << "a triangle and the disk lie beyond";
    rays.set(0, V3f(.3f, .2f, 9), V3f(0, 0, -1), 0, 6.5f, 0);
    rays.id[0] = RayPacket::idOfLight(1);
    built.scene->tracer().occluded(rays, 1);
    EXPECT_LT(rays.tfar[0], 0) << "another light's ray";
}

TEST(StaticQuadrics, AreWithinTheBounds) {
    const BuiltScene built = test::build(kHead + others(1) + kThree);
    const Box3f box = built.scene->tracer().bounds();
    EXPECT_NEAR(box.max.y, 1001, .01);
    EXPECT_NEAR(box.max.z, 4, .01);
    EXPECT_NEAR(box.min.z, -2, .01);
}

} // namespace
} // namespace strobe
