// The shading requests of lattice points.
#include "lattice/surface_lattice.h"

#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

float random(uint64_t a, uint64_t b) { return unitFloat(uint32_t(hashOf(a, b) >> 32)); }

struct RequestCase {
    const char* name;
    std::string view, world;
    std::string text() const {
        return R"(
Film "image" "integer xresolution" 20 "integer yresolution" 20
Integrator "directlighting"
)" + view + "\nWorldBegin\n" +
               world;
    }
};

/// Returns shades of random points of the scene at random times.
ShadeSoA randomShades(const Scene& scene, uint64_t seed, int count) {
    ShadeSoA shades;
    shades.count = count;
    for (int i = 0; i < count; ++i) {
        const uint64_t n = seed * kSoAWidth + uint64_t(i);
        const float u = random(n, 0), v = random(n, 1) * (1 - u);
        const uint32_t instances = uint32_t(scene.instances().size());
        const uint32_t instance = instances ? uint32_t(float(instances) * random(n, 2)) : kNone;
        const TriangleMesh* mesh = scene.geometry({instance, 0, 0, u, v, 0}).placed.shape.mesh.get();
        const float prims = mesh ? float(mesh->triangleCount()) : 1;
        shades.hit.set(i, {instance, 0, uint32_t(prims * random(n, 3)), u, v, 0});
        shades.isFront[i] = random(n, 4) < .5f;
        shades.time[i] = random(n, 5);
        shades.lens.set(i, {random(n, 6), random(n, 7)});
    }
    return shades;
}

class LatticeRequests : public testing::TestWithParam<RequestCase> {};

TEST_P(LatticeRequests, RaysComeFromTheCameraOrGrazeTheRequestedSide) {
    constexpr float kMinCosine = .02f;
    const BuiltScene built = test::build(GetParam().text());
    const Scene& scene = *built.scene;
    const SurfaceLattice lattice(scene, 1, SurfaceLattice::SmallTriangles::Shared);
    SurfaceCache surfaces = lattice.makeSurfaceCache();
    int facing = 0, raised = 0;
    for (uint64_t seed = 0; seed < 40; ++seed) {
        ShadeSoA shades = randomShades(scene, seed, kSoAWidth);
        RequestSoA requests;
        lattice.writeRequests(shades, surfaces, requests, 0);
        for (int i = 0; i < kSoAWidth; ++i) {
            const float time = requests.time[i];
            EXPECT_EQ(time, shades.time[i]);
            const Hit hit = requests.hit.at(i), expectedHit = shades.hit.at(i);
            EXPECT_EQ(hit.instance, expectedHit.instance);
            EXPECT_EQ(hit.prim, expectedHit.prim);
            EXPECT_EQ(V2f(hit.u, hit.v), V2f(expectedHit.u, expectedHit.v));
            const SurfacePoint surface = scene.surface(expectedHit, time);
            const V3f o = requests.ray.o.at(i), wo = -requests.ray.d.at(i);
            EXPECT_LT(length(o - wo * hit.t - surface.p), 1e-5f * (length(o) + hit.t));
            EXPECT_NEAR(length(wo), 1, 1e-6f);
            const V3f toCamera = scene.camera().viewpoint(surface.p, shades.lens.at(i), time) - surface.p;
            EXPECT_NEAR(hit.t, length(toCamera), 1e-5f * length(toCamera));
            const float side = shades.isFront[i] ? 1.f : -1.f;
            const float cosine = side * dot(surface.ng, normalize(toCamera));
            if (cosine > kMinCosine) {
                EXPECT_LT(length(wo - normalize(toCamera)), 1e-5f);
                ++facing;
            } else {
                const float lengthBeforeNormalizing = std::sqrt(1 - sqr(cosine) + sqr(kMinCosine));
                EXPECT_NEAR(side * dot(surface.ng, wo) * lengthBeforeNormalizing, kMinCosine, 1e-5f);
                ++raised;
            }
        }
    }
    EXPECT_GT(facing, 300);
    EXPECT_GT(raised, 300);
}

TEST_P(LatticeRequests, DoNotDependOnTheirIndex) {
    const BuiltScene built = test::build(GetParam().text());
    const SurfaceLattice lattice(*built.scene, 1, SurfaceLattice::SmallTriangles::Shared);
    SurfaceCache surfaces = lattice.makeSurfaceCache();
    ShadeSoA shades = randomShades(*built.scene, 7, kSoAWidth);
    RequestSoA together;
    lattice.writeRequests(shades, surfaces, together, 0);
    for (int i = 0; i < kSoAWidth; ++i) {
        const int k = (i * 7 + 3) % kSoAWidth;
        ShadeSoA single;
        single.count = 1;
        single.hit.set(0, shades.hit.at(i));
        single.isFront[0] = shades.isFront[i];
        single.time[0] = shades.time[i];
        single.lens.set(0, shades.lens.at(i));
        RequestSoA separate;
        lattice.writeRequests(single, surfaces, separate, k);
        EXPECT_EQ(separate.ray.o.at(k), together.ray.o.at(i));
        EXPECT_EQ(separate.ray.d.at(k), together.ray.d.at(i));
        EXPECT_EQ(separate.hit.t[k], together.hit.t[i]);
        EXPECT_EQ(separate.spread[k], together.spread[i]);
    }
}

const std::string kOctahedron = R"(
Shape "trianglemesh" "integer indices" [0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5]
  "point P" [1 0 0  -1 0 0  0 1 0  0 -1 0  0 0 1  0 0 -1]
)";

/// The cone is that of the pixel where the point is seen. With a wide camera, pixels at the corners are much
/// smaller.
TEST(LatticeRequestCones, AreAsWideAsABlockAtThePoint) {
    constexpr float kBlockSize = 3;
    const RequestCase wide{"Wide", R"(
LookAt 0 0 3  0 0 0  0 1 0
Camera "perspective" "float fov" 150
)",
                           R"(
Texture "lines" "color" "checkerboard" "float uscale" 50
Material "matte" "texture Kd" "lines"
)" + kOctahedron};
    const BuiltScene built = test::build(wide.text());
    const Scene& scene = *built.scene;
    const SurfaceLattice lattice(scene, kBlockSize, SurfaceLattice::SmallTriangles::Shared);
    SurfaceCache surfaces = lattice.makeSurfaceCache();
    ShadeSoA shades = randomShades(scene, 1, kSoAWidth);
    RequestSoA requests;
    lattice.writeRequests(shades, surfaces, requests, 0);
    for (int i = 0; i < kSoAWidth; ++i) {
        const auto film = scene.camera().project(shades.p.at(i), shades.time[i]);
        ASSERT_TRUE(film);
        const RayCone pixel = scene.camera().cone(film->film);
        EXPECT_NEAR(requests.spread[i], kBlockSize * pixel.spread, 1e-4f * pixel.spread);
        EXPECT_NEAR(requests.width[i], kBlockSize * pixel.width, 1e-4f * pixel.width);
    }
}

const std::string kPerspective = R"(
LookAt 0 -10 2  0 0 0  0 0 1
Camera "perspective" "float fov" 24
)";
const std::string kOrthographic = R"(
LookAt 0 -9 2  0 0 0  0 0 1
Camera "orthographic"
)";
const std::string kTranslating = "ActiveTransform EndTime\nTranslate .7 0 .4\n";
const std::string kRotating = kTranslating + "Rotate 50 0 1 1\n";
const std::string kScaled = "ActiveTransform All\nScale 1 1.5 .8\n";
const std::string kSphere = "Shape \"sphere\"\n";
const std::string kInstances = R"(ObjectBegin "o"
)" + kOctahedron + R"(ObjectEnd
ObjectInstance "o"
Translate 2 0 0
ObjectInstance "o"
)" + kTranslating + kScaled + R"(
ObjectInstance "o"
)" + kRotating + R"(
ObjectInstance "o"
)";

INSTANTIATE_TEST_SUITE_P(
    Scenes, LatticeRequests,
    testing::Values(RequestCase{"Mesh", kPerspective, kOctahedron},
                    RequestCase{"Lens", kPerspective + R"("float lensradius" .5 "float focaldistance" 8)",
                                kOctahedron},
                    RequestCase{"MovingCamera", kTranslating + kScaled + kPerspective, kOctahedron},
                    RequestCase{"Orthographic", kOrthographic, kOctahedron},
                    RequestCase{"Translating", kPerspective, kTranslating + kScaled + kOctahedron},
                    RequestCase{"Rotating", kPerspective, kRotating + kScaled + kOctahedron},
                    RequestCase{"Sphere", kPerspective, kScaled + kSphere},
                    RequestCase{"TranslatingSphere", kPerspective, kTranslating + kScaled + kSphere},
                    RequestCase{"RotatingSphere", kPerspective, kRotating + kScaled + kSphere},
                    RequestCase{"Instances", kPerspective, kInstances}),
    [](const auto& info) { return info.param.name; });

} // namespace
} // namespace strobe
