#include "integrators/surface_parts.h"

#include "core/surface_math.h"

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

SurfacePart::SurfacePart(const Scene& scene, uint32_t instance, uint32_t geometry)
    : instance(instance), geometry(geometry), placed(&scene.geometry({instance, geometry}).placed),
      mesh(placed->shape.mesh.get()),
      motion(instance == kNone ? nullptr : scene.instances()[instance].motion.get()),
      keySum(surfaceSum(instance, geometry)),
      isFixed(!(mesh && mesh->deforms()) && (!motion || motion->onlyTranslates())) {
    if (!isFixed)
        return;
    toWorld = motion ? placed->toParent * motion->at(0) : placed->toParent;
    leastArea = !motion ? 1 : leastAreaOf(toWorld);
    if (mesh)
        indices = mesh->indices.data(), positions = mesh->positions[0].data();
    else
        toObject = toWorld.inverse();
}

void SurfacePart::place(Edges& edges, float time) const {
    edges.transform(placed->toParent);
    if (motion)
        edges.transform(motion->at(time));
}

M44f SurfacePart::toWorldAt(float time) const {
    if (isFixed && (!motion || motion->isStill()))
        return toWorld;
    return motion ? placed->toParent * motion->at(time) : placed->toParent;
}

Edges SurfacePart::edgesAt(uint32_t prim, float time) const {
    const Triangle t = triangleOf(*mesh, prim, time);
    Edges edges{t.b - t.a, t.c - t.a};
    if (motion)
        place(edges, time);
    return edges;
}

bool SurfacePart::look(const Hit& hit, const V3f& d, float time, Edges& edges) const {
    const QuadricPoint q = placed->shape.quadric->point(hit.u, hit.v);
    edges = {q.dpdu, q.dpdv};
    if (isFixed) {
        edges.transform(toWorld);
        return dot(transformNormal(toObject, q.n), d) < 0;
    }
    place(edges, time);
    return dot(transformNormal((placed->toParent * motion->at(time)).inverse(), q.n), d) < 0;
}

void SurfacePart::spot(const Hit& hit, float time, V3f& p, V3f& n) const {
    if (!mesh) {
        const QuadricPoint q = placed->shape.quadric->point(hit.u, hit.v);
        const M44f m = toWorldAt(time);
        p = transformPoint(m, q.p), n = transformNormal(isFixed ? toObject : m.inverse(), q.n);
        return;
    }
    const Triangle t = triangleOf(*mesh, hit.prim, time);
    p = t.point(hit.u, hit.v);
    Edges e{t.b - t.a, t.c - t.a};
    if (motion) {
        const M44f m = toWorldAt(time);
        p = transformPoint(m, p), e.transform(m);
    }
    n = cross(e.a, e.b);
}

} // namespace strobe
