// Hits of random rays on random shapes, and their cells of the lattice.
#pragma once

#include "core/math/hash.h"
#include "lattice/surface_lattice.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <array>

namespace strobe::test {

/// Returns a random number in [0,1) that is a function of a and b.
inline float random(uint64_t a, uint64_t b) { return unitFloat(uint32_t(hashOf(a, b) >> 32)); }

/// A scene up to WorldBegin.
inline const std::string kView = R"(
Film "image" "integer xresolution" 200 "integer yresolution" 200
Sampler "sobol"
Integrator "directlighting"
LookAt 0 -10 0  0 0 0  0 0 1
Camera "perspective" "float fov" 24
WorldBegin
)";

inline const std::string kOctahedron = R"(
"integer indices" [0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5]
"point P" [1 0 0  -1 0 0  0 1 0  0 -1 0  0 0 1  0 0 -1]
)";

/// A subdivided octahedron of 8 * 4^levels triangles.
inline std::string subdivided(int levels) {
    return R"(Shape "loopsubdiv" "integer nlevels" )" + std::to_string(levels) + kOctahedron;
}

/// Triangles of all proportions, from equilateral to slivers, of all orientations.
inline std::string randomTriangles(int count, float size, bool hasNormals = false) {
    std::string indices, points, normals;
    const auto append = [](std::string& text, const V3f& p) {
        for (int k = 0; k < 3; ++k)
            text += std::to_string(p[k]) + " ";
    };
    const auto randomVector = [](uint64_t i, uint64_t k) {
        return V3f(random(i, k), random(i, k + 1), random(i, k + 2)) * 2.f - V3f(1);
    };
    for (uint64_t i = 0; i < uint64_t(count); ++i) {
        const float thinness = std::exp2(-8 * random(i, 20));
        const V3f p = randomVector(i, 0) * 1.5f, a = randomVector(i, 3) * size, b = a * random(i, 21);
        append(points, p);
        append(points, p + a);
        append(points, p + b + randomVector(i, 6) * (size * thinness));
        for (uint64_t k = 0; k < 3; ++k) {
            indices += std::to_string(3 * i + (k + i) % 3) + " "; // any edge may be the short one
            append(normals, randomVector(i, 9));
        }
    }
    std::string text =
        R"(Shape "trianglemesh" "integer indices" [)" + indices + R"(] "point P" [)" + points + "]";
    if (hasNormals)
        text += R"( "normal N" [)" + normals + "]";
    return text + "\n";
}

/// Returns the hits among `count` camera rays at random times, in a square of the film.
inline std::vector<VisibilitySample> randomHits(const Scene& scene, int count, const V2f& corner = V2f(0),
                                                float edge = 200) {
    std::vector<VisibilitySample> samples;
    RayPacket packet;
    for (uint64_t i = 0; i < uint64_t(count); ++i) {
        VisibilitySample s{};
        s.film = corner + V2f(random(i, 0), random(i, 1)) * edge;
        const CameraSample camera{s.film, V2f(random(i, 2), random(i, 3)), random(i, 4)};
        scene.camera().rays(&camera, 1, &s.ray);
        packet.set(0, s.ray.o, s.ray.d, s.ray.tmin, kInfinity, s.ray.time);
        scene.tracer().intersect(packet, 1, false);
        s.hit = scene.tracer().hit(packet, 0);
        if (s.hit)
            samples.push_back(s);
    }
    return samples;
}

inline void push_back(LatticeHitSoA& hits, const Scene& scene, const VisibilitySample& s) {
    hits.push_back(s.hit, s.ray.d, s.ray.time, scene.camera().cone(s.film));
}

/// A cell and the weights of its points for a hit.
struct WeightedCell : LatticeCell {
    float weights[kMaxPoints]{};
};

/// Locates one hit by itself.
inline WeightedCell locate(const Scene& scene, const SurfaceLattice& lattice, const VisibilitySample& s) {
    LatticeHitSoA hits;
    push_back(hits, scene, s);
    SurfaceCache surfaces = lattice.makeSurfaceCache();
    lattice.locate(hits, surfaces);
    WeightedCell cell{SurfaceLattice::cellOf(hits, 0)};
    LatticeCell::computeWeights(cell.kind, hits.coords.at(0), cell.weights);
    return cell;
}

/// Returns the points of a cell, with vertices turned into positions on a triangle.
inline std::array<LatticePoint, LatticeCell::kMaxPoints> pointsOf(const SurfaceLattice& lattice,
                                                                  const LatticeCell& cell) {
    static thread_local MeshPointCache cache;
    std::array<LatticePoint, LatticeCell::kMaxPoints> points;
    lattice.findPoints(cell, cache, points.data());
    SurfaceCache surfaces = lattice.makeSurfaceCache();
    HitSoA hit;
    hit.set(0, {cell.side.instance, cell.side.geometry, cell.prim, 0, 0, 0});
    for (LatticePoint& point : points) {
        if (point && point.isVertex) {
            const MeshPoint p = surfaces.surfaceOf(hit, 0).meshPointOf(point.prim);
            point = {p.prim, p.u, p.v, false, point.keySum};
        }
    }
    return points;
}

} // namespace strobe::test
