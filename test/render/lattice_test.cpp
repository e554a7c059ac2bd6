// The lattice of shading points: how far its points are, what it interpolates exactly, and its keys.
#include "integrators/surface_lattice.h"

#include "core/hash.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <map>
#include <unordered_map>

namespace strobe {
namespace {

float random(uint64_t a, uint64_t b) { return unitFloat(uint32_t(hashOf(a, b) >> 32)); }

constexpr const char* kView = "Film \"image\" \"integer xresolution\" 200 \"integer yresolution\" 200\n"
                              "Sampler \"sobol\"\nIntegrator \"directlighting\"\nLookAt 0 -10 0 0 0 0 0 0 1\n"
                              "Camera \"perspective\" \"float fov\" 24\nWorldBegin\n";

constexpr const char* kOctahedron =
    "\"integer indices\" [0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5] "
    "\"point P\" [1 0 0  -1 0 0  0 1 0  0 -1 0  0 0 1  0 0 -1]\n";

std::string subdivided(int levels) {
    return "Shape \"loopsubdiv\" \"integer nlevels\" " + std::to_string(levels) + " " + kOctahedron;
}

/// Triangles of all proportions, from equilateral to slivers, facing anywhere.
std::string randomTriangles(int count, float size, bool normals = false) {
    std::string indices, points, directions;
    const auto put = [](std::string& text, const V3f& p) {
        for (int k = 0; k < 3; ++k)
            text += std::to_string(p[k]) + " ";
    };
    const auto anywhere = [](uint64_t i, uint64_t k) {
        return V3f(random(i, k), random(i, k + 1), random(i, k + 2)) * 2.f - V3f(1);
    };
    for (uint64_t i = 0; i < uint64_t(count); ++i) {
        const float thin = std::exp2(-8 * random(i, 20));
        const V3f p = anywhere(i, 0) * 1.5f, a = anywhere(i, 3) * size, b = a * random(i, 21);
        put(points, p), put(points, p + a), put(points, p + b + anywhere(i, 6) * (size * thin));
        for (uint64_t k = 0; k < 3; ++k) {
            indices += std::to_string(3 * i + (k + i) % 3) + " "; // any edge may be the short one
            put(directions, anywhere(i, 9));
        }
    }
    return "Shape \"trianglemesh\" \"integer indices\" [" + indices + "] \"point P\" [" + points + "]" +
           (normals ? " \"normal N\" [" + directions + "]" : "") + "\n";
}

/// What random rays of the camera meet, at random times.
std::vector<VisibilitySample> randomHits(const Scene& scene, int count) {
    std::vector<VisibilitySample> samples;
    RayBlock block;
    for (uint64_t i = 0; i < uint64_t(count); ++i) {
        VisibilitySample s{};
        s.film = V2f(random(i, 0), random(i, 1)) * 200.f;
        const CameraSample camera{s.film, V2f(random(i, 2), random(i, 3)), random(i, 4)};
        scene.camera().rays(&camera, 1, &s.ray);
        block.set(0, s.ray.o, s.ray.d, s.ray.tmin, kInfinity, s.ray.time);
        scene.tracer().intersect(block, 1, false);
        s.hit = scene.tracer().hit(block, 0);
        if (s.hit)
            samples.push_back(s);
    }
    return samples;
}

V3f placeOf(const Scene& scene, const LatticeFace& face, const LatticePoint& p, float time) {
    return scene.surface({face.instance, face.geometry, p.prim, p.u, p.v, 0}, time).p;
}

struct Reach {
    double most = 0; ///< in blocks
    size_t hits = 0, beyond = 0;
    size_t kinds[5] = {};
};

/// How many blocks away the points around `samples` are, as their rays see them; and that weights are weights.
Reach reachOf(const Scene& scene, float blockSize, const std::vector<VisibilitySample>& samples) {
    const SurfaceLattice lattice(scene, blockSize, SurfaceLattice::SmallTriangles::Shared);
    Reach reach;
    for (const VisibilitySample& s : samples) {
        const LatticeCell cell = lattice.locate(s, 0);
        LatticePoint points[LatticeCell::kPoints];
        lattice.points(cell, 0, points);
        const RayCone cone = scene.camera().cone(s.film);
        const double block = double(blockSize) * double(cone.width + s.hit.t * cone.spread);
        const V3f at = scene.surface(s.hit, s.ray.time).p;
        double sum = 0, most = 0;
        bool any = false;
        for (int k = 0; k < cell.count; ++k) {
            EXPECT_GE(cell.weights[k], 0);
            sum += double(cell.weights[k]);
            if (!points[k].key)
                continue;
            any = true;
            const V3f away = placeOf(scene, cell.face, points[k], s.ray.time) - at;
            most = std::max(most, double(length(away - s.ray.d * dot(away, s.ray.d))) / block);
        }
        EXPECT_TRUE(any);
        EXPECT_NEAR(sum, 1, 2e-6);
        ++reach.hits, ++reach.kinds[cell.kind];
        reach.beyond += most > double(SurfaceLattice::kReach);
        reach.most = std::max(reach.most, most);
    }
    return reach;
}

struct ReachCase {
    const char* name;
    std::string world;
};

class LatticeReach : public testing::TestWithParam<ReachCase> {};

TEST_P(LatticeReach, IsAsDocumented) {
    const BuiltScene built = test::build(kView + GetParam().world);
    const auto hits = randomHits(*built.scene, 60000);
    ASSERT_GT(hits.size(), 2000u);
    for (const float blockSize : {.25f, 1.f, 4.f}) {
        const Reach reach = reachOf(*built.scene, blockSize, hits);
        printf("%-14s block %.2f: most %.3f beyond %zu of %zu, kinds %zu %zu %zu %zu %zu\n", GetParam().name,
               double(blockSize), reach.most, reach.beyond, reach.hits, reach.kinds[0], reach.kinds[1],
               reach.kinds[2], reach.kinds[3], reach.kinds[4]);
        EXPECT_LE(reach.most, double(SurfaceLattice::kReach) * 1.001) << blockSize;
    }
}

const std::string kTurning = "ActiveTransform EndTime\nTranslate .4 0 .2\nRotate 70 1 2 3\nActiveTransform All\n";

std::string instanced(const std::string& shape) {
    return "ObjectBegin \"o\"\n" + shape + "ObjectEnd\nAttributeBegin\nTranslate -1 0 0\nRotate 30 1 1 0\n" +
           "Scale .7 .7 .7\nObjectInstance \"o\"\nAttributeEnd\nTranslate 1 1 0\n" + kTurning +
           "ObjectInstance \"o\"\n";
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, LatticeReach,
    testing::Values(ReachCase{"LargeTriangles", randomTriangles(60, 1.5f)},
                    ReachCase{"LargeWithNormals", randomTriangles(60, 1.5f, true)},
                    ReachCase{"SmallTriangles", randomTriangles(3000, .1f)},
                    ReachCase{"Floor", "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" "
                                       "[-9 -9 -1 9 -9 -1 9 900 -1 -9 900 -1]\n"},
                    ReachCase{"Sphere", "Rotate 40 1 0 0\nShape \"sphere\" \"float radius\" 1.8\n"},
                    ReachCase{"SphereFromSide", "Shape \"sphere\" \"float radius\" 1.8\n"},
                    ReachCase{"Disk", "Translate 0 0 -.5\nRotate 5 1 0 0\nShape \"disk\" \"float radius\" 2\n"},
                    ReachCase{"FineMesh", subdivided(8)},
                    ReachCase{"Instances", instanced(subdivided(7))},
                    ReachCase{"InstancesOfQuadrics", instanced("Shape \"sphere\"\n")},
                    ReachCase{"MovingCoarse", kTurning + subdivided(2)},
                    ReachCase{"MovingFine", kTurning + subdivided(7)},
                    ReachCase{"StretchedFine", "Scale 2 1 .3\n" + kTurning + subdivided(7)}),
    [](const auto& info) { return info.param.name; });

} // namespace
} // namespace strobe
