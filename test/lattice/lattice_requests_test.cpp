// Requests to shade points of the lattice: rays from where the camera sees them.
#include "lattice/surface_lattice.h"

#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

float random(uint64_t a, uint64_t b) { return unitFloat(uint32_t(hashOf(a, b) >> 32)); }

constexpr const char* kStart = "Film \"image\" \"integer xresolution\" 20 \"integer yresolution\" 20\n"
                               "Integrator \"directlighting\"\n";
constexpr const char* kOctahedron =
    "Shape \"trianglemesh\" \"integer indices\" [0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5] "
    "\"point P\" [1 0 0  -1 0 0  0 1 0  0 -1 0  0 0 1  0 0 -1]\n";

struct RequestCase {
    const char* name;
    std::string view, world;
};

/// Points anywhere in the scene, seen at any time.
ShadedPointSoA randomPoints(const Scene& scene, uint64_t seed, int count) {
    ShadedPointSoA points;
    points.count = count;
    for (int i = 0; i < count; ++i) {
        const uint64_t n = seed * kSoAWidth + uint64_t(i);
        const float u = random(n, 0), v = random(n, 1) * (1 - u);
        const uint32_t instances = uint32_t(scene.instances().size());
        const uint32_t instance = instances ? uint32_t(float(instances) * random(n, 2)) : kNone;
        const Hit any{instance, 0, 0, u, v, 0};
        const TriangleMesh* mesh = scene.geometry(any).placed.shape.mesh.get();
        const float prims = mesh ? float(mesh->triangleCount()) : 1;
        points.hit.set(i, {instance, 0, uint32_t(prims * random(n, 3)), u, v, 0});
        points.positive[i] = random(n, 4) < .5f;
        points.time[i] = random(n, 5);
        points.lens.set(i, {random(n, 6), random(n, 7)});
    }
    return points;
}

class LatticeRequests : public testing::TestWithParam<RequestCase> {};

TEST_P(LatticeRequests, ComeFromTheCameraOrGrazeTheSideThatIsAsked) {
    constexpr float kGrazing = .02f;
    const BuiltScene built = test::build(kStart + GetParam().view + "WorldBegin\n" + GetParam().world);
    const Scene& scene = *built.scene;
    const SurfaceLattice lattice(scene, 1, SurfaceLattice::SmallTriangles::Shared);
    SurfaceCache surfaces = lattice.surfaceCache();
    int facing = 0, raised = 0;
    for (uint64_t seed = 0; seed < 40; ++seed) {
        ShadedPointSoA points = randomPoints(scene, seed, kSoAWidth);
        RequestSoA requests;
        lattice.request(points, surfaces, requests, 0);
        for (int i = 0; i < kSoAWidth; ++i) {
            const V2f lens = points.lens.at(i);
            const float time = requests.time[i];
            EXPECT_EQ(time, points.time[i]);
            const Hit hit = requests.hit.at(i), wanted = points.hit.at(i);
            EXPECT_EQ(hit.instance, wanted.instance);
            EXPECT_EQ(hit.prim, wanted.prim);
            EXPECT_EQ(V2f(hit.u, hit.v), V2f(wanted.u, wanted.v));
            const SurfacePoint surface = scene.surface(wanted, time);
            const V3f o = requests.ray.o.at(i), wo = -requests.ray.d.at(i);
            EXPECT_LT(length(o - wo * hit.t - surface.p), 1e-5f * (length(o) + hit.t));
            EXPECT_NEAR(length(wo), 1, 1e-6f);
            const V3f camera = scene.camera().viewpoint(surface.p, lens, time) - surface.p;
            EXPECT_NEAR(hit.t, length(camera), 1e-5f * length(camera));
            const float side = points.positive[i] ? 1.f : -1.f;
            const float cosine = side * dot(surface.ng, normalize(camera));
            if (cosine > kGrazing) {
                EXPECT_LT(length(wo - normalize(camera)), 1e-5f);
                ++facing;
            } else {
                const float along = std::sqrt(1 - sqr(cosine) + sqr(kGrazing)); // the length before it is 1
                EXPECT_NEAR(side * dot(surface.ng, wo) * along, kGrazing, 1e-5f);
                ++raised;
            }
        }
    }
    EXPECT_GT(facing, 300);
    EXPECT_GT(raised, 300);
}

TEST_P(LatticeRequests, DoNotDependOnTheLane) {
    const BuiltScene built = test::build(kStart + GetParam().view + "WorldBegin\n" + GetParam().world);
    const SurfaceLattice lattice(*built.scene, 1, SurfaceLattice::SmallTriangles::Shared);
    SurfaceCache surfaces = lattice.surfaceCache();
    ShadedPointSoA points = randomPoints(*built.scene, 7, kSoAWidth);
    RequestSoA together;
    lattice.request(points, surfaces, together, 0);
    for (int i = 0; i < kSoAWidth; ++i) {
        const int at = (i * 7 + 3) % kSoAWidth;
        ShadedPointSoA one;
        one.count = 1;
        one.hit.set(0, points.hit.at(i)), one.positive[0] = points.positive[i];
        one.time[0] = points.time[i], one.lens.set(0, points.lens.at(i));
        RequestSoA alone;
        lattice.request(one, surfaces, alone, at);
        EXPECT_EQ(alone.ray.o.at(at), together.ray.o.at(i));
        EXPECT_EQ(alone.ray.d.at(at), together.ray.d.at(i));
        EXPECT_EQ(alone.hit.t[at], together.hit.t[i]);
        EXPECT_EQ(alone.spread[at], together.spread[i]);
    }
}

/// Of the pixel where the point is seen: at the film's corners, a wide camera's are much smaller.
TEST(LatticeRequestCones, AreAsWideAsABlockThere) {
    const BuiltScene built = test::build(
        kStart +
        std::string("LookAt 0 0 3 0 0 0 0 1 0\nCamera \"perspective\" \"float fov\" 150\nWorldBegin\n"
                    "Texture \"lines\" \"color\" \"checkerboard\" \"float uscale\" 50\n"
                    "Material \"matte\" \"texture Kd\" \"lines\"\n") +
        kOctahedron);
    constexpr float kBlock = 3;
    const Scene& scene = *built.scene;
    const SurfaceLattice lattice(scene, kBlock, SurfaceLattice::SmallTriangles::Shared);
    SurfaceCache surfaces = lattice.surfaceCache();
    ShadedPointSoA points = randomPoints(scene, 1, kSoAWidth);
    RequestSoA requests;
    lattice.request(points, surfaces, requests, 0);
    for (int i = 0; i < kSoAWidth; ++i) {
        const auto seen = scene.camera().project(points.p.at(i), points.time[i]);
        ASSERT_TRUE(seen);
        const RayCone pixel = scene.camera().cone(seen->film);
        EXPECT_NEAR(requests.spread[i], kBlock * pixel.spread, 1e-4f * pixel.spread);
        EXPECT_NEAR(requests.width[i], kBlock * pixel.width, 1e-4f * pixel.width);
    }
}

const std::string kAhead = "LookAt 0 -10 2 0 0 0 0 0 1\nCamera \"perspective\" \"float fov\" 24\n";
const std::string kMoves = "ActiveTransform EndTime\nTranslate .7 0 .4\n",
                  kTurns = kMoves + "Rotate 50 0 1 1\n", kAlways = "ActiveTransform All\nScale 1 1.5 .8\n";

INSTANTIATE_TEST_SUITE_P(
    Scenes, LatticeRequests,
    testing::Values(
        RequestCase{"Mesh", kAhead, kOctahedron},
        RequestCase{"Lens", kAhead + "\"float lensradius\" .5 \"float focaldistance\" 8\n", kOctahedron},
        RequestCase{"MovingCamera", kMoves + kAlways + kAhead, kOctahedron},
        RequestCase{"Orthographic", "LookAt 0 -9 2 0 0 0 0 0 1\nCamera \"orthographic\"\n", kOctahedron},
        RequestCase{"Translating", kAhead, kMoves + kAlways + kOctahedron},
        RequestCase{"Turning", kAhead, kTurns + kAlways + kOctahedron},
        RequestCase{"Sphere", kAhead, kAlways + "Shape \"sphere\"\n"},
        RequestCase{"TranslatingSphere", kAhead, kMoves + kAlways + "Shape \"sphere\"\n"},
        RequestCase{"TurningSphere", kAhead, kTurns + kAlways + "Shape \"sphere\"\n"},
        RequestCase{"Instances", kAhead,
                    std::string("ObjectBegin \"o\"\n") + kOctahedron +
                        "ObjectEnd\nObjectInstance \"o\"\nTranslate 2 0 0\nObjectInstance \"o\"\n" + kMoves +
                        kAlways + "ObjectInstance \"o\"\n" + kTurns + "ObjectInstance \"o\"\n"}),
    [](const auto& info) { return info.param.name; });

} // namespace
} // namespace strobe
