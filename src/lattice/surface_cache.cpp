#include "lattice/surface_cache.h"

#include "core/scene/surface_math.h"

namespace strobe {

namespace {

/// No area becomes smaller than this many times itself. The largest singular value is at most the root of the
/// largest sum of magnitudes in a row of the matrix times itself transposed.
float leastAreaOf(const M44f& m) {
    const V3f rows[] = {
        {m[0][0], m[0][1], m[0][2]}, {m[1][0], m[1][1], m[1][2]}, {m[2][0], m[2][1], m[2][2]}};
    float most = 0;
    for (const V3f& row : rows)
        most = std::max(most, absDot(row, rows[0]) + absDot(row, rows[1]) + absDot(row, rows[2]));
    return most > 0 ? std::abs(determinant3(m)) / std::sqrt(most) : 0;
}

} // namespace

LatticeSurface::LatticeSurface(const Scene& scene, uint32_t instance, uint32_t geometry,
                               const CellsOfGroups& ofGroups)
    : instance(instance), geometry(geometry), placed(&scene.geometry({instance, geometry}).placed),
      mesh(placed->shape.mesh.get()),
      motion(instance == kNone ? nullptr : scene.instances()[instance].motion.get()),
      keySum(surfaceSum(instance, geometry)), cells(cellsOf(ofGroups, scene, instance, geometry)),
      isFixed(!(mesh && mesh->deforms()) && (!motion || motion->onlyTranslates())) {
    if (!isFixed)
        return;
    toWorld = motion ? placed->toParent * motion->at(0) : placed->toParent;
    if (cells)
        leastBlock2 = .999f * cells->vertexArea() * (!motion ? 1 : leastAreaOf(toWorld));
    if (mesh)
        indices = mesh->indices.data(), positions = mesh->positions[0].data();
    else
        toObject = toWorld.inverse();
}

void LatticeSurface::place(Edges& edges, float time) const {
    edges.transform(placed->toParent);
    if (motion)
        edges.transform(motion->at(time));
}

M44f LatticeSurface::toWorldAt(float time) const {
    if (isFixed && (!motion || motion->isStatic()))
        return toWorld;
    return motion ? placed->toParent * motion->at(time) : placed->toParent;
}

Edges LatticeSurface::edgesAt(uint32_t prim, float time) const {
    const Triangle t = triangleOf(*mesh, prim, time);
    Edges edges{t.b - t.a, t.c - t.a};
    if (motion)
        place(edges, time);
    return edges;
}

bool LatticeSurface::look(const Hit& hit, const V3f& d, float time, Edges& edges) const {
    const QuadricPoint q = placed->shape.quadric->point(hit.u, hit.v);
    edges = {q.dpdu, q.dpdv};
    if (isFixed) {
        edges.transform(toWorld);
        return dot(transformNormal(toObject, q.n), d) < 0;
    }
    place(edges, time);
    return dot(transformNormal((placed->toParent * motion->at(time)).inverse(), q.n), d) < 0;
}

namespace {

struct TriangleSoA {
    V3SoA a, b, c;
};

STROBE_TARGET_CLONES void findSpots(const TriangleSoA& t, const HitSoA& hits, int begin, int end, V3SoA& p,
                                    V3SoA& n) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const Triangle triangle{t.a.at(i), t.b.at(i), t.c.at(i)};
        const V3f at = triangle.point(hits.u[i], hits.v[i]), normal = triangle.normal();
        p.x[i] = at.x, p.y[i] = at.y, p.z[i] = at.z;
        n.x[i] = normal.x, n.y[i] = normal.y, n.z[i] = normal.z;
    }
}

/// The same for triangles in motion.
STROBE_TARGET_CLONES void findSpots(const TriangleSoA& t, const AffineSoA& m, const HitSoA& hits, int begin,
                                    int end, V3SoA& p, V3SoA& n) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const Triangle triangle{t.a.at(i), t.b.at(i), t.c.at(i)};
        const Affine toWorld(m.x.at(i), m.y.at(i), m.z.at(i), m.o.at(i));
        const V3f at = toWorld.point(triangle.point(hits.u[i], hits.v[i]));
        const V3f normal =
            cross(toWorld.vector(triangle.b - triangle.a), toWorld.vector(triangle.c - triangle.a));
        p.x[i] = at.x, p.y[i] = at.y, p.z[i] = at.z;
        n.x[i] = normal.x, n.y[i] = normal.y, n.z[i] = normal.z;
    }
}

} // namespace

void LatticeSurface::spots(const HitSoA& hits, const float* time, int begin, int end, V3SoA& p,
                           V3SoA& n) const {
    if (!mesh) {
        for (int i = begin; i < end; ++i)
            spotQuadric(hits.at(i), time[i], p, n, i);
        return;
    }
    TriangleSoA t;
    for (int i = begin; i < end; ++i) {
        const Triangle one = triangleOf(*mesh, hits.prim[i], time[i]);
        t.a.set(i, one.a), t.b.set(i, one.b), t.c.set(i, one.c);
    }
    if (!motion)
        return findSpots(t, hits, begin, end, p, n);
    AffineSoA m;
    if (placed->toParent == M44f())
        motion->atSoA(time, begin, end, m);
    else
        for (int i = begin; i < end; ++i)
            m.set(i, toWorldAt(time[i]));
    findSpots(t, m, hits, begin, end, p, n);
}

void LatticeSurface::spotQuadric(const Hit& hit, float time, V3SoA& p, V3SoA& n, int i) const {
    const QuadricPoint q = placed->shape.quadric->point(hit.u, hit.v);
    const M44f m = toWorldAt(time);
    p.set(i, transformPoint(m, q.p)), n.set(i, transformNormal(isFixed ? toObject : m.inverse(), q.n));
}

} // namespace strobe
