// Spheres and disks against independent references in extended precision.
#include "shapes/disk.h"
#include "shapes/shape_params.h"
#include "shapes/sphere.h"

#include <functional>
#include <random>

namespace strobe {
namespace {

using Imath::V3d;

using Random = std::mt19937;

float uniform(Random& random) { return std::min(random() * 0x1p-32f, kOneMinusEpsilon); }
float between(Random& random, float a, float b) { return lerp(a, b, uniform(random)); }
V3f inCube(Random& random, float size) {
    return {between(random, -size, size), between(random, -size, size), between(random, -size, size)};
}

/// Clipping of a sphere (a, b: zmin, zmax), or shape of a disk (a, b: innerradius, height).
struct Cut {
    float a, b, phiMax;
};

std::shared_ptr<const Quadric> sphere(float radius, const Cut& cut) {
    const ShapeParams params = ShapeParams()
                                   .floats("radius", {radius})
                                   .floats("zmin", {cut.a})
                                   .floats("zmax", {cut.b})
                                   .floats("phimax", {cut.phiMax});
    return makeShape(spherePlugin(), params).quadric;
}
std::shared_ptr<const Quadric> sphere(float radius) {
    return makeShape(spherePlugin(), ShapeParams().floats("radius", {radius})).quadric;
}
std::shared_ptr<const Quadric> disk(float radius, const Cut& cut) {
    const ShapeParams params = ShapeParams()
                                   .floats("radius", {radius})
                                   .floats("innerradius", {cut.a})
                                   .floats("height", {cut.b})
                                   .floats("phimax", {cut.phiMax});
    return makeShape(diskPlugin(), params).quadric;
}

long double degreesAbout(long double x, long double y) {
    const long double phi = std::atan2(y, x) * 180 / 3.14159265358979323846L;
    return phi < 0 ? phi + 360 : phi;
}

/// A crossing of a line with a shape.
struct Crossing {
    long double t, margin; ///< margin: distance from the nearest edge of the shape; negative outside of it
};
/// Returns all crossings of a line.
using Reference = std::function<std::vector<Crossing>(const V3f& o, const V3f& d)>;

struct Point {
    long double x, y, z;
};
Point along(const V3f& o, const V3f& d, long double t) {
    return {o.x + t * d.x, o.y + t * d.y, o.z + t * d.z};
}
long double sweepMargin(const Point& p, float phiMax) {
    return phiMax >= 360 ? 1.L : (phiMax - degreesAbout(p.x, p.y)) / 360;
}

Reference sphereReference(float r, const Cut& cut) {
    return [=](const V3f& o, const V3f& d) {
        const long double a = (long double)d.x * d.x + (long double)d.y * d.y + (long double)d.z * d.z;
        const long double b = (long double)o.x * d.x + (long double)o.y * d.y + (long double)o.z * d.z;
        const long double c =
            (long double)o.x * o.x + (long double)o.y * o.y + (long double)o.z * o.z - (long double)r * r;
        const long double disc = b * b - a * c;
        std::vector<Crossing> crossings;
        if (disc < 0)
            return crossings;
        for (const long double sign : {-1.L, 1.L}) {
            const long double t = (-b + sign * std::sqrt(disc)) / a;
            const Point p = along(o, d, t);
            const long double low = cut.a <= -r ? 1 : p.z - cut.a, high = cut.b >= r ? 1 : cut.b - p.z;
            crossings.push_back({t, std::min({low, high, sweepMargin(p, cut.phiMax)})});
        }
        return crossings;
    };
}

Reference diskReference(float r, const Cut& cut) {
    return [=](const V3f& o, const V3f& d) {
        const long double t = ((long double)cut.b - o.z) / d.z;
        const Point p = along(o, d, t);
        const long double rho = std::hypot(p.x, p.y), inner = cut.a > 0 ? rho - cut.a : 1;
        return std::vector<Crossing>{{t, std::min({r - rho, inner, sweepMargin(p, cut.phiMax)})}};
    };
}

/// Compares random rays with the reference; some rays are limited by tmin or tmax. Rays whose crossing is
/// within rounding of an edge or of an end of the ray are not compared.
void compareRays(const Quadric& shape, const Reference& reference, float size, int rays, float distance) {
    Random random(7);
    int hits = 0, ambiguous = 0;
    for (int i = 0; i < rays; ++i) {
        const V3f target = inCube(random, size), o = inCube(random, size * distance);
        const V3f d = (target - o) * between(random, 0.1f, 3.f);
        const float tmin = i % 3 ? 0 : between(random, 0, 1);
        const float tmax = i % 5 ? kInfinity : between(random, 0, 2);
        float t = -1, u = -1, v = -1;
        const bool hit = shape.intersect(o, d, tmin, tmax, t, u, v);
        const long double slack = 1e-6L;
        bool expected = false, isAmbiguous = false;
        long double nearest = 0;
        for (const Crossing& c : reference(o, d)) {
            if (std::abs(c.margin) < slack * size || std::abs(c.t - tmin) < slack * (1 + std::abs(c.t)) ||
                std::abs(c.t - tmax) < slack * (1 + std::abs(c.t)))
                isAmbiguous = true;
            else if (!expected && c.margin > 0 && c.t > tmin && c.t < tmax) {
                expected = true;
                nearest = c.t;
            }
        }
        if (isAmbiguous) {
            ++ambiguous;
            continue;
        }
        ASSERT_EQ(hit, expected) << "ray " << i << " from " << o << " to " << target;
        if (!hit)
            continue;
        ++hits;
        ASSERT_NEAR(t, nearest, 1e-6 * std::abs(nearest)) << "ray " << i;
        const Point p = along(o, d, nearest);
        const QuadricPoint q = shape.point(u, v);
        const V3f expectedPoint(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
        ASSERT_LT(length(q.p - expectedPoint), 3e-6f * size) << "ray " << i << " uv " << u << " " << v;
        ASSERT_GE(std::min(u, v), 0.f);
        ASSERT_LE(std::max(u, v), 1.f);
        ASSERT_NEAR(q.uv.x, u, 1e-6f);
        ASSERT_NEAR(q.uv.y, v, 1e-5f);
    }
    EXPECT_GT(hits, rays / 100);
    EXPECT_LT(ambiguous, rays / 100);
}

const Cut kSphereCuts[] = {
    {-9, 9, 360}, {-1.5f, 9, 360}, {-9, 0.5f, 360}, {-0.7f, 1.9f, 200}, {1.2f, 1.6f, 90}};
const Cut kDiskCuts[] = {{0, 0, 360}, {0.7f, 0.3f, 360}, {0, -1, 250}, {1.5f, 1, 60}};

/// Expects intersectSoA to equal intersect to the bit, and inactive rays not to hit.
void comparePackets(const Quadric& shape) {
    constexpr unsigned kPacket = 16;
    float rows[9][kPacket]; // origin, tmin, direction, time, tmax
    Random random(11);
    int hits = 0;
    for (int packet = 0; packet < 1000; ++packet) {
        int valid[kPacket];
        for (unsigned i = 0; i < kPacket; ++i) {
            const V3f o = inCube(random, 5), d = inCube(random, 2) - o;
            const float ray[] = {o.x, o.y, o.z, i % 3 ? 0 : .5f, d.x, d.y, d.z, 0, i % 5 ? kInfinity : 1};
            for (int k = 0; k < 9; ++k)
                rows[k][i] = ray[k];
            valid[i] = random() % 4 ? -1 : 0;
        }
        const unsigned n = packet % 2 ? kPacket : 1 + random() % kPacket;
        const QuadricRaySoA rays(M44f(), rows[0], kPacket, 0, n);
        alignas(64) int32_t hit[QuadricRaySoA::kMax];
        alignas(64) float t[QuadricRaySoA::kMax], u[QuadricRaySoA::kMax], v[QuadricRaySoA::kMax];
        std::copy_n(valid, n, hit);
        shape.intersectSoA(rays, hit, t, u, v);
        for (int i = 0; i < int(n); ++i) {
            float t1, u1, v1;
            const bool expected =
                shape.intersect(rays.o(i), rays.d(i), rays.tmin[i], rays.tmax[i], t1, u1, v1);
            ASSERT_EQ(hit[i] != 0, expected && valid[i]) << "packet " << packet << ", ray " << i;
            if (!hit[i])
                continue;
            ++hits;
            ASSERT_EQ(t[i], t1);
            ASSERT_EQ(u[i], u1);
            ASSERT_EQ(v[i], v1);
        }
    }
    EXPECT_GT(hits, 50);
}

TEST(Sphere, AgreesWithTheReference) {
    for (const Cut& cut : kSphereCuts) {
        SCOPED_TRACE(cut.phiMax);
        compareRays(*sphere(2, cut), sphereReference(2, cut), 2, 50000, 3);
    }
}

TEST(Quadrics, IntersectSoAEqualsIntersect) {
    for (const Cut& cut : kSphereCuts)
        comparePackets(*sphere(2, cut));
    for (const Cut& cut : kDiskCuts)
        comparePackets(*disk(2, cut));
}

TEST(Sphere, AgreesWithTheReferenceForDistantRays) {
    for (const float distance : {1e2f, 1e4f})
        compareRays(*sphere(2), sphereReference(2, {-9, 9, 360}), 2, 50000, distance);
}

TEST(Sphere, AgreesWithTheReferenceForGrazingRays) {
    // Rays that miss or hit the unit sphere by a few millionths, from a distance of 1000 radii.
    const auto shape = sphere(1);
    Random random(3);
    for (int i = 0; i < 10000; ++i) {
        const V3f n = normalize(inCube(random, 1)), side = Frame::fromNormal(n).s;
        for (const float height : {1 - 3e-6f, 1 + 3e-6f}) {
            // The line is parallel to `side` up to rounding only, so the reference decides.
            const V3f o = n * height - side * 1000.f, d = n * height + side * 1000.f - o;
            const auto crossings = sphereReference(1, {-9, 9, 360})(o, d);
            float t, u, v;
            const bool hit = shape->intersect(o, d, 0, kInfinity, t, u, v);
            ASSERT_EQ(hit, !crossings.empty());
            if (hit) {
                ASSERT_NEAR(t, crossings[0].t, 1e-6);
            }
        }
    }
}

TEST(Sphere, RaysFromTheSurfaceAndFromInside) {
    const auto shape = sphere(1);
    float t, u, v;
    ASSERT_TRUE(shape->intersect({0, 0, 0}, {0, 0, 2}, 0, kInfinity, t, u, v));
    EXPECT_FLOAT_EQ(t, 0.5f);
    ASSERT_TRUE(shape->intersect({0, 0, 1}, {0, 0, -1}, 1e-4f, kInfinity, t, u, v));
    EXPECT_FLOAT_EQ(t, 2);
    EXPECT_FALSE(shape->intersect({0, 0, 1}, {0, 0, 1}, 1e-4f, kInfinity, t, u, v));
    EXPECT_FALSE(shape->intersect({0, 0, 3}, {0, 0, -1}, 0, 2, t, u, v)); // tmax is exclusive
    EXPECT_FALSE(shape->intersect({0, 0, 3}, {0, 0, 0}, 0, kInfinity, t, u, v));
    const float nan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_FALSE(shape->intersect({0, nan, 3}, {0, 0, -1}, 0, kInfinity, t, u, v));
}

TEST(Sphere, ClippedHitsAreSkipped) {
    const auto bowl = sphere(1, {-9, 0, 360}); // without the upper half: rays from above hit the inside
    float t, u, v;
    ASSERT_TRUE(bowl->intersect({0.1f, 0, 5}, {0, 0, -1}, 0, kInfinity, t, u, v));
    EXPECT_GT(t, 5.f);
    EXPECT_FALSE(bowl->intersect({0.1f, 0, 5}, {0, 0, -1}, 0, 5.5f, t, u, v));
}

TEST(Disk, AgreesWithTheReference) {
    for (const Cut& cut : kDiskCuts) {
        SCOPED_TRACE(cut.phiMax);
        compareRays(*disk(2, cut), diskReference(2, cut), 2, 50000, 3);
    }
    compareRays(*disk(2, kDiskCuts[0]), diskReference(2, kDiskCuts[0]), 2, 50000, 1e3f);
}

TEST(Disk, ParallelRaysMiss) {
    float t, u, v;
    EXPECT_FALSE(disk(1, {0, 0, 360})->intersect({-3, 0, 0}, {1, 0, 0}, 0, kInfinity, t, u, v));
    EXPECT_FALSE(disk(1, {0, 0, 360})->intersect({-3, 0, 1}, {1, 0, 0}, 0, kInfinity, t, u, v));
}

TEST(Sphere, HasTheParametrizationOfPbrt) {
    struct Row {
        V3f p;
        float u, v;
    };
    for (const Row& row : {Row{{2, 0, 0}, 0, 0.5f},
                           {{0, 2, 0}, 0.25f, 0.5f},
                           {{-2, 0, 0}, 0.5f, 0.5f},
                           {{0, -2, 0}, 0.75f, 0.5f},
                           {{0, 0, -2}, 0, 0},
                           {{0, 0, 2}, 0, 1}}) {
        const QuadricPoint q = sphere(2)->point(row.u, row.v);
        EXPECT_LT(length(q.p - row.p), 1e-6f);
        EXPECT_LT(length(q.n - row.p * 0.5f), 1e-6f);
    }
    const auto cut = sphere(2, {-1, 0, 180});
    EXPECT_LT(length(cut->point(1, 1).p - V3f(-2, 0, 0)), 1e-6f);
    EXPECT_NEAR(cut->point(0.3f, 0).p.z, -1, 1e-6f);
    const V3f middle = cut->point(0.5f, 1).p;
    EXPECT_LT(length(middle - V3f(0, 2, 0)), 1e-6f);
}

TEST(Disk, HasTheParametrizationOfPbrt) {
    const auto whole = disk(2, {0, 3, 360});
    EXPECT_LT(length(whole->point(0, 0).p - V3f(2, 0, 3)), 1e-6f); // v is 0 at the outer edge
    EXPECT_LT(length(whole->point(0.25f, 1).p - V3f(0, 0, 3)), 1e-6f);
    const auto ring = disk(2, {1, 0, 180});
    EXPECT_LT(length(ring->point(0.5f, 0.25f).p - V3f(0, 1.75f, 0)), 1e-6f);
    EXPECT_EQ(ring->point(0.5f, 0.25f).n, V3f(0, 0, 1));
}

/// Compares derivatives with finite differences, and the normal with the cross product of the derivatives.
void checkDerivatives(const Quadric& shape) {
    Random random(11);
    for (int i = 0; i < 1000; ++i) {
        const float u = between(random, 0.05f, 0.95f), v = between(random, 0.05f, 0.95f), h = 1e-2f;
        const QuadricPoint q = shape.point(u, v);
        const V3f du = (shape.point(u + h, v).p - shape.point(u - h, v).p) / (2 * h);
        const V3f dv = (shape.point(u, v + h).p - shape.point(u, v - h).p) / (2 * h);
        ASSERT_LT(length(du - q.dpdu), 2e-3f * length(q.dpdu));
        ASSERT_LT(length(dv - q.dpdv), 2e-3f * length(q.dpdv));
        ASSERT_NEAR(dot(normalize(cross(q.dpdu, q.dpdv)), q.n), 1, 1e-5f);
        ASSERT_NEAR(length(q.n), 1, 1e-6f);
    }
}

TEST(Sphere, DerivativesEqualDifferences) {
    for (const Cut& cut : kSphereCuts)
        checkDerivatives(*sphere(2, cut));
    for (const float v : {0.f, 1.f}) { // not zero at the poles
        EXPECT_GT(length(sphere(2)->point(0.3f, v).dpdu), 0.f);
        EXPECT_GT(length(sphere(2)->point(0.3f, v).dpdv), 0.f);
    }
}

TEST(Disk, DerivativesEqualDifferences) {
    for (const Cut& cut : kDiskCuts)
        checkDerivatives(*disk(2, cut));
    EXPECT_GT(length(disk(2, kDiskCuts[0])->point(0.3f, 1).dpdu), 0.f);
}

/// Chi-square test of samples in 8 x 8 bins of equal area. `toUnitSquare` maps the surface to [0,1)² with
/// equal areas.
void checkSampling(const Quadric& shape, const std::function<V2f(const V3f&)>& toUnitSquare) {
    constexpr int kSide = 8, kSamples = 64000;
    std::vector<int> counts(kSide * kSide);
    Random random(5);
    const Box3f bounds = shape.bounds();
    for (int i = 0; i < kSamples; ++i) {
        const float x = uniform(random), y = uniform(random);
        const QuadricPoint q = shape.samplePoint({x, y});
        const V2f c = toUnitSquare(q.p);
        ASSERT_GE(std::min(c.x, c.y), -1e-5f);
        ASSERT_LE(std::max(c.x, c.y), 1 + 1e-5f);
        for (int axis = 0; axis < 3; ++axis) {
            ASSERT_GE(q.p[axis], bounds.min[axis] - 1e-6f);
            ASSERT_LE(q.p[axis], bounds.max[axis] + 1e-6f);
        }
        // `point` returns the sample for its uv.
        ASSERT_LT(length(shape.point(q.uv.x, q.uv.y).p - q.p), 2e-5f);
        const auto index = [](float f) { return std::clamp(static_cast<int>(f * kSide), 0, kSide - 1); };
        ++counts[index(c.y) * kSide + index(c.x)];
    }
    const double expected = kSamples / double(kSide * kSide);
    double chi2 = 0;
    for (const int n : counts)
        chi2 += (n - expected) * (n - expected) / expected;
    EXPECT_LT(chi2, 63 + 3.7 * std::sqrt(2. * 63)); // 63 degrees of freedom, p below 1e-3
    EXPECT_GT(chi2, 63 - 3.7 * std::sqrt(2. * 63)); // random numbers are not stratified
}

TEST(Sphere, SamplesAreUniformByArea) {
    for (const Cut& cut : kSphereCuts) {
        const float low = std::max(cut.a, -2.f), high = std::min(cut.b, 2.f);
        checkSampling(*sphere(2, cut), [=](const V3f& p) {
            return V2f(static_cast<float>(degreesAbout(p.x, p.y)) / cut.phiMax, (p.z - low) / (high - low));
        });
    }
}

TEST(Disk, SamplesAreUniformByArea) {
    for (const Cut& cut : kDiskCuts) {
        checkSampling(*disk(2, cut), [=](const V3f& p) {
            const float inner2 = cut.a * cut.a;
            return V2f(static_cast<float>(degreesAbout(p.x, p.y)) / cut.phiMax,
                       (p.x * p.x + p.y * p.y - inner2) / (4 - inner2));
        });
    }
}

TEST(Quadrics, AreasAndBoundsEqualClosedForms) {
    EXPECT_NEAR(sphere(2)->area(), 16 * kPi, 1e-4f);
    EXPECT_NEAR(sphere(2, {0, 1, 90})->area(), kPi, 1e-5f);
    EXPECT_NEAR(disk(2, {1, 0, 180})->area(), 1.5f * kPi, 1e-5f);
    EXPECT_EQ(sphere(2)->bounds(), Box3f(V3f(-2), V3f(2)));
    const Box3f cap = sphere(5, {3, 9, 360})->bounds();
    EXPECT_EQ(cap.min.z, 3.f);
    EXPECT_EQ(cap.max.z, 5.f);
    EXPECT_NEAR(cap.max.x, 4, 1e-6f);
    EXPECT_EQ(disk(2, {0, 3, 360})->bounds(), Box3f({-2, -2, 3}, {2, 2, 3}));
}

TEST(Quadrics, WholeSphereRadiusIsZeroForOtherShapes) {
    EXPECT_EQ(sphere(2)->wholeSphereRadius(), 2.f);
    EXPECT_EQ(sphere(2, {-2, 2, 360})->wholeSphereRadius(), 2.f);
    EXPECT_EQ(sphere(2, {-2, 1.9f, 360})->wholeSphereRadius(), 0.f);
    EXPECT_EQ(sphere(2, {-2, 2, 359})->wholeSphereRadius(), 0.f);
    EXPECT_EQ(disk(2, {0, 0, 360})->wholeSphereRadius(), 0.f);
}

TEST(Quadrics, ErrorsHaveLocations) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const Plugin<Shape> sphere = spherePlugin(), disk = diskPlugin();
    for (const float bad : {0.f, -1.f, nan, kInfinity}) {
        expectShapeError(sphere, ShapeParams().floats("radius", {bad}), "radius",
                         "must be positive and finite");
        expectShapeError(disk, ShapeParams().floats("radius", {bad}), "radius",
                         "must be positive and finite");
    }
    for (const float bad : {0.f, -90.f, nan}) {
        expectShapeError(sphere, ShapeParams().floats("phimax", {bad}), "phimax", "above 0 degrees");
        expectShapeError(disk, ShapeParams().floats("phimax", {bad}), "phimax", "above 0 degrees");
    }
    expectShapeError(sphere, ShapeParams().floats("zmin", {0.5f}).floats("zmax", {0.5f}), "zmin",
                     "leave nothing");
    expectShapeError(sphere, ShapeParams().floats("zmin", {1.5f}), "zmin", "leave nothing");
    expectShapeError(sphere, ShapeParams().floats("zmax", {nan}), "zmax", "leave nothing");
    expectShapeError(disk, ShapeParams().floats("innerradius", {1}), "innerradius", "less than \"radius\"");
    expectShapeError(disk, ShapeParams().floats("innerradius", {-0.1f}), "innerradius", "at least 0");
    expectShapeError(disk, ShapeParams().floats("height", {kInfinity}), "height", "must be finite");
}

TEST(Quadrics, PointSoAEqualsPoint) {
    Random random(5);
    for (const auto& quadric : {sphere(2), sphere(.7f, {-.3f, .6f, 250}), disk(1.5f, {.2f, 3, 120})}) {
        float u[kSoAWidth], v[kSoAWidth];
        V3SoA p, n, dpdu, dpdv;
        V2SoA uv;
        QuadricPointSoA out{p, n, dpdu, dpdv, uv};
        for (int i = 0; i < kSoAWidth; ++i) {
            u[i] = uniform(random);
            v[i] = i % 8 ? uniform(random) : float(i / 8 % 2); // includes poles and rims
        }
        for (int begin = 0, end; begin < kSoAWidth; begin = end) {
            end = std::min(kSoAWidth, begin + 1 + begin / 2);
            quadric->pointSoA(u, v, begin, end, out);
        }
        for (int i = 0; i < kSoAWidth; ++i) {
            const QuadricPoint q = quadric->point(u[i], v[i]);
            EXPECT_EQ(q.p, p.at(i)) << i;
            EXPECT_EQ(q.n, n.at(i)) << i;
            EXPECT_EQ(q.dpdu, dpdu.at(i)) << i;
            EXPECT_EQ(q.dpdv, dpdv.at(i)) << i;
            EXPECT_EQ(q.uv, uv.at(i)) << i;
        }
    }
}

} // namespace
} // namespace strobe
