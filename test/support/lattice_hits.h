// Hits of random rays on random things, and the cells of the lattice that these lie in.
#pragma once

#include "core/math/hash.h"
#include "lattice/surface_lattice.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <array>

namespace strobe::test {

inline float random(uint64_t a, uint64_t b) { return unitFloat(uint32_t(hashOf(a, b) >> 32)); }

inline constexpr const char* kView =
    "Film \"image\" \"integer xresolution\" 200 \"integer yresolution\" 200\n"
    "Sampler \"sobol\"\nIntegrator \"directlighting\"\nLookAt 0 -10 0 0 0 0 0 0 1\n"
    "Camera \"perspective\" \"float fov\" 24\nWorldBegin\n";

inline constexpr const char* kOctahedron =
    "\"integer indices\" [0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5] "
    "\"point P\" [1 0 0  -1 0 0  0 1 0  0 -1 0  0 0 1  0 0 -1]\n";

inline std::string subdivided(int levels) {
    return "Shape \"loopsubdiv\" \"integer nlevels\" " + std::to_string(levels) + " " + kOctahedron;
}

/// Triangles of all proportions, from equilateral to slivers, facing anywhere.
inline std::string randomTriangles(int count, float size, bool normals = false) {
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

/// What random rays of the camera meet, at random times, in a square of the film.
inline std::vector<VisibilitySample> randomHits(const Scene& scene, int count, const V2f& from = V2f(0),
                                                float edge = 200) {
    std::vector<VisibilitySample> samples;
    RayPacket block;
    for (uint64_t i = 0; i < uint64_t(count); ++i) {
        VisibilitySample s{};
        s.film = from + V2f(random(i, 0), random(i, 1)) * edge;
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

/// The cell of one hit, found by itself, and its weights.
struct Located : LatticeCell {
    float weights[kPoints]{};
};

inline Located locate(const Scene& scene, const SurfaceLattice& lattice, const VisibilitySample& s) {
    LatticeSoA lanes;
    lanes.add(s.hit, s.ray.d, s.ray.time, scene.camera().cone(s.film));
    SurfaceCache surfaces = lattice.surfaceCache();
    lattice.locate(lanes, surfaces);
    Located located{SurfaceLattice::cellAt(lanes, 0)};
    LatticeCell::weigh(located.kind, lanes.place.at(0), located.weights);
    return located;
}

inline std::array<LatticePoint, LatticeCell::kPoints> pointsAround(const SurfaceLattice& lattice,
                                                                   const LatticeCell& cell) {
    static thread_local MeshPointCache known;
    std::array<LatticePoint, LatticeCell::kPoints> points;
    lattice.points(cell, known, points.data());
    SurfaceCache surfaces = lattice.surfaceCache();
    HitSoA hit;
    hit.set(0, {cell.face.instance, cell.face.geometry, cell.prim, 0, 0, 0});
    for (LatticePoint& point : points)
        if (point && point.isVertex) {
            const MeshPoint place = surfaces.of(hit, 0).placeOf(point.prim);
            point = {place.prim, place.u, place.v, false, point.keySum};
        }
    return points;
}

} // namespace strobe::test
