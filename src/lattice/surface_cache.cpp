#include "lattice/surface_cache.h"

#include "core/scene/surface_math.h"

namespace strobe {

namespace {

/// Returns a lower bound of the factor by which m scales areas: the determinant over a bound of the largest
/// singular value. That is at most the square root of the largest row sum of magnitudes of m times its
/// transpose.
float minAreaScale(const M44f& m) {
    const V3f rows[] = {
        {m[0][0], m[0][1], m[0][2]}, {m[1][0], m[1][1], m[1][2]}, {m[2][0], m[2][1], m[2][2]}};
    float maxSum = 0;
    for (const V3f& row : rows)
        maxSum = std::max(maxSum, absDot(row, rows[0]) + absDot(row, rows[1]) + absDot(row, rows[2]));
    return maxSum > 0 ? std::abs(determinant3(m)) / std::sqrt(maxSum) : 0;
}

} // namespace

LatticeSurface::LatticeSurface(const Scene& scene, uint32_t instance, uint32_t geometry,
                               const MeshCellsOfGroups& cellsOfGroups)
    : instance(instance), geometry(geometry), placed(&scene.geometry({instance, geometry}).placed),
      mesh(placed->shape.mesh.get()),
      motion(instance == kNone ? nullptr : scene.instances()[instance].motion.get()),
      keySum(surfaceKeySum(instance, geometry)), cells(meshCellsOf(cellsOfGroups, scene, instance, geometry)),
      hasFixedDirections(!(mesh && mesh->deforms()) && (!motion || motion->onlyTranslates())) {
    if (!hasFixedDirections)
        return;
    toWorld = motion ? placed->toParent * motion->at(0) : placed->toParent;
    if (cells)
        minBlockArea = .999f * cells->vertexArea() * (!motion ? 1 : minAreaScale(toWorld));
    if (mesh) {
        indices = mesh->indices.data();
        positions = mesh->positions[0].data();
    } else {
        toObject = toWorld.inverse();
    }
}

M44f LatticeSurface::toWorldAt(float time) const {
    if (hasFixedDirections && (!motion || motion->isStatic()))
        return toWorld;
    return motion ? placed->toParent * motion->at(time) : placed->toParent;
}

namespace {

void transformToWorld(Edges& edges, const PlacedShape& placed, const Motion* motion, float time) {
    edges.transform(placed.toParent);
    if (motion)
        edges.transform(motion->at(time));
}

} // namespace

Edges LatticeSurface::worldEdgesAt(uint32_t prim, float time) const {
    const Triangle t = triangleOf(*mesh, prim, time);
    Edges edges{t.b - t.a, t.c - t.a};
    if (motion)
        transformToWorld(edges, *placed, motion, time);
    return edges;
}

bool LatticeSurface::computeQuadricEdges(const Hit& hit, const V3f& d, float time, Edges& edges) const {
    const QuadricPoint q = placed->shape.quadric->point(hit.u, hit.v);
    edges = {q.dpdu, q.dpdv};
    if (hasFixedDirections) {
        edges.transform(toWorld);
        return dot(transformNormal(toObject, q.n), d) < 0;
    }
    transformToWorld(edges, *placed, motion, time);
    return dot(transformNormal((placed->toParent * motion->at(time)).inverse(), q.n), d) < 0;
}

namespace {

struct TriangleSoA {
    V3SoA a, b, c;
};

/// Computes the points and normals of static triangles.
STROBE_TARGET_CLONES void computeTrianglePoints(const TriangleSoA& t, const HitSoA& hits, int begin, int end,
                                                V3SoA& p, V3SoA& n) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const Triangle triangle{t.a.at(i), t.b.at(i), t.c.at(i)};
        const V3f point = triangle.point(hits.u[i], hits.v[i]), normal = triangle.normal();
        p.x[i] = point.x;
        p.y[i] = point.y;
        p.z[i] = point.z;
        n.x[i] = normal.x;
        n.y[i] = normal.y;
        n.z[i] = normal.z;
    }
}

/// Computes the points and normals of triangles with transforms.
STROBE_TARGET_CLONES void computeTrianglePoints(const TriangleSoA& t, const AffineSoA& m, const HitSoA& hits,
                                                int begin, int end, V3SoA& p, V3SoA& n) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const Triangle triangle{t.a.at(i), t.b.at(i), t.c.at(i)};
        const Affine toWorld(m.x.at(i), m.y.at(i), m.z.at(i), m.o.at(i));
        const V3f point = toWorld.point(triangle.point(hits.u[i], hits.v[i]));
        const V3f normal =
            cross(toWorld.vector(triangle.b - triangle.a), toWorld.vector(triangle.c - triangle.a));
        p.x[i] = point.x;
        p.y[i] = point.y;
        p.z[i] = point.z;
        n.x[i] = normal.x;
        n.y[i] = normal.y;
        n.z[i] = normal.z;
    }
}

} // namespace

void LatticeSurface::computePoints(const HitSoA& hits, const float* time, int begin, int end, V3SoA& p,
                                   V3SoA& n) const {
    if (!mesh) {
        for (int i = begin; i < end; ++i)
            computeQuadricPoint(hits.at(i), time[i], p, n, i);
        return;
    }
    TriangleSoA triangles;
    for (int i = begin; i < end; ++i) {
        const Triangle triangle = triangleOf(*mesh, hits.prim[i], time[i]);
        triangles.a.set(i, triangle.a);
        triangles.b.set(i, triangle.b);
        triangles.c.set(i, triangle.c);
    }
    if (!motion) {
        computeTrianglePoints(triangles, hits, begin, end, p, n);
        return;
    }
    AffineSoA m;
    if (placed->toParent == M44f()) {
        motion->atSoA(time, begin, end, m);
    } else {
        for (int i = begin; i < end; ++i)
            m.set(i, toWorldAt(time[i]));
    }
    computeTrianglePoints(triangles, m, hits, begin, end, p, n);
}

void LatticeSurface::computeQuadricPoint(const Hit& hit, float time, V3SoA& p, V3SoA& n, int i) const {
    const QuadricPoint q = placed->shape.quadric->point(hit.u, hit.v);
    const M44f m = toWorldAt(time);
    p.set(i, transformPoint(m, q.p));
    n.set(i, transformNormal(hasFixedDirections ? toObject : m.inverse(), q.n));
}

} // namespace strobe
