// Surface points as structures of arrays, for runs of hits on the same geometry.
#include "core/scene/scene.h"
#include "core/scene/surface_math.h"

namespace strobe {

namespace {

/// Triangles of a mesh in object space.
struct TriangleSoA {
    V3SoA a, b, c;
    V2SoA uvA, uvB, uvC;
    V3SoA normal; ///< interpolated vertex normals
};

void gatherTriangles(const TriangleMesh& mesh, const HitSoA& hits, const float* time, int begin, int end,
                     bool needsUvs, TriangleSoA& out) {
    for (int i = begin; i < end; ++i) {
        const Triangle t = triangleOf(mesh, hits.prim[i], time[i]);
        out.a.set(i, t.a);
        out.b.set(i, t.b);
        out.c.set(i, t.c);
    }
    if (!mesh.normals.empty()) {
        for (int i = begin; i < end; ++i)
            out.normal.set(i, interpolatedNormal(mesh, hits.prim[i], hits.u[i], hits.v[i], time[i]));
    }
    if (needsUvs) {
        for (int i = begin; i < end; ++i) {
            const uint32_t prim = hits.prim[i];
            out.uvA.set(i, triangleUv(mesh, prim, 0, 0));
            out.uvB.set(i, triangleUv(mesh, prim, 1, 0));
            out.uvC.set(i, triangleUv(mesh, prim, 0, 1));
        }
    }
}

STROBE_TARGET_CLONES void computePoints(const TriangleSoA& t, const HitSoA& hits, int begin, int end,
                                        SurfaceSoA& out) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const Triangle triangle{t.a.at(i), t.b.at(i), t.c.at(i)};
        const float u = hits.u[i], v = hits.v[i];
        const V3f p = triangle.point(u, v), n = triangle.normal();
        out.p.x[i] = p.x;
        out.p.y[i] = p.y;
        out.p.z[i] = p.z;
        out.ng.x[i] = n.x;
        out.ng.y[i] = n.y;
        out.ng.z[i] = n.z;
        out.ns.x[i] = n.x;
        out.ns.y[i] = n.y;
        out.ns.z[i] = n.z;
        out.scale[i] = triangle.scale();
        out.uv.x[i] = u + v;
        out.uv.y[i] = v;
    }
}

STROBE_TARGET_CLONES void computeDerivatives(const TriangleSoA& t, int begin, int end, SurfaceSoA& out) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        V3f dpdu, dpdv;
        Triangle{t.a.at(i), t.b.at(i), t.c.at(i)}.derivatives(t.uvA.at(i), t.uvB.at(i), t.uvC.at(i), dpdu,
                                                              dpdv);
        out.dpdu.x[i] = dpdu.x;
        out.dpdu.y[i] = dpdu.y;
        out.dpdu.z[i] = dpdu.z;
        out.dpdv.x[i] = dpdv.x;
        out.dpdv.y[i] = dpdv.y;
        out.dpdv.z[i] = dpdv.z;
    }
}

void meshSurfaces(const TriangleMesh& mesh, const HitSoA& hits, const float* time, int begin, int end,
                  SurfaceSoA& out) {
    TriangleSoA triangles;
    const bool needsDerivatives = out.material[begin]->flags().needsFootprint;
    gatherTriangles(mesh, hits, time, begin, end, needsDerivatives, triangles);
    computePoints(triangles, hits, begin, end, out);
    if (!mesh.normals.empty()) {
        for (int i = begin; i < end; ++i)
            if (const V3f n = triangles.normal.at(i); length2(n) > 0)
                out.ns.set(i, n);
    }
    if (!mesh.uvs.empty()) {
        for (int i = begin; i < end; ++i)
            out.uv.set(i, triangleUv(mesh, hits.prim[i], hits.u[i], hits.v[i]));
    }
    if (needsDerivatives) {
        computeDerivatives(triangles, begin, end, out);
    } else {
        for (float* array : {out.dpdu.x, out.dpdu.y, out.dpdu.z, out.dpdv.x, out.dpdv.y, out.dpdv.z})
            std::fill(array + begin, array + end, 0.f);
    }
}

void quadricSurfaces(const Quadric& quadric, const HitSoA& hits, int begin, int end, SurfaceSoA& out) {
    QuadricPointSoA points{out.p, out.ng, out.dpdu, out.dpdv, out.uv};
    quadric.pointSoA(hits.u, hits.v, begin, end, points);
    std::fill(out.scale + begin, out.scale + end, quadricScale(quadric));
}

STROBE_FORCE_INLINE Affine affineAt(const AffineSoA& m, int i) {
    return {m.x.at(i), m.y.at(i), m.z.at(i), m.o.at(i)};
}

STROBE_TARGET_CLONES void transformNormals(const AffineSoA& m, int begin, int end, V3SoA& normals) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const V3f n = affineAt(m, i).normal(normals.at(i));
        normals.x[i] = n.x;
        normals.y[i] = n.y;
        normals.z[i] = n.z;
    }
}

/// Transforms all members but ns.
STROBE_TARGET_CLONES void transformPoints(const AffineSoA& transforms, int begin, int end, SurfaceSoA& out) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const Affine m = affineAt(transforms, i);
        const V3f p = m.point(out.p.at(i)), n = m.normal(out.ng.at(i));
        const V3f dpdu = m.vector(out.dpdu.at(i)), dpdv = m.vector(out.dpdv.at(i));
        out.p.x[i] = p.x;
        out.p.y[i] = p.y;
        out.p.z[i] = p.z;
        out.ng.x[i] = n.x;
        out.ng.y[i] = n.y;
        out.ng.z[i] = n.z;
        out.dpdu.x[i] = dpdu.x;
        out.dpdu.y[i] = dpdu.y;
        out.dpdu.z[i] = dpdu.z;
        out.dpdv.x[i] = dpdv.x;
        out.dpdv.y[i] = dpdv.y;
        out.dpdv.z[i] = dpdv.z;
        out.scale[i] = m.scale(out.scale[i]);
    }
}

void copyNormals(const V3SoA& from, int begin, int end, V3SoA& to) {
    std::copy(from.x + begin, from.x + end, to.x + begin);
    std::copy(from.y + begin, from.y + end, to.y + begin);
    std::copy(from.z + begin, from.z + end, to.z + begin);
}

} // namespace

void Scene::rawSurfaces(const HitSoA& hits, const float* time, int n, SurfaceSoA& out) const {
    std::copy_n(hits.prim, n, out.prim);
    for (int begin = 0, end; begin < n; begin = end) {
        end = begin + 1;
        while (end < n && hits.instance[end] == hits.instance[begin] &&
               hits.geometry[end] == hits.geometry[begin])
            ++end;
        rawSurfacesOfGeometry(hits, time, begin, end, out);
    }
}

/// Writes the raw surface points of hits begin … end-1, which are all on the same geometry.
void Scene::rawSurfacesOfGeometry(const HitSoA& hits, const float* time, int begin, int end,
                                  SurfaceSoA& out) const {
    const Hit first = hits.at(begin);
    const Geometry& geometry = this->geometry(first);
    const PlacedShape& placed = geometry.placed;
    std::fill(out.material + begin, out.material + end, m_materials[size_t(geometry.material)].get());
    std::fill(out.light + begin, out.light + end, lightOf(first));
    std::fill(out.orientation + begin, out.orientation + end, placed.reverseOrientation ? -1.f : 1.f);
    const bool isMesh = placed.shape.mesh != nullptr;
    if (isMesh)
        meshSurfaces(*placed.shape.mesh, hits, time, begin, end, out);
    else
        quadricSurfaces(*placed.shape.quadric, hits, begin, end, out);
    if (!isBaked(first, placed)) {
        AffineSoA transforms;
        if (first.instance != kNone && placed.toParent == M44f()) {
            m_instances[first.instance].motion->atSoA(time, begin, end, transforms);
        } else {
            for (int i = begin; i < end; ++i)
                transforms.set(i, toWorld(first, placed, time[i]));
        }
        transformPoints(transforms, begin, end, out);
        if (isMesh)
            transformNormals(transforms, begin, end, out.ns);
    }
    if (!isMesh)
        copyNormals(out.ng, begin, end, out.ns);
}

STROBE_TARGET_CLONES void footprints(const SurfaceSoA& s, const V3SoA& wo, const float* width, int begin,
                                     int end, V2SoA& duvdx, V2SoA& duvdy) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const V3f w = wo.at(i);
        const Footprint f(s.ng.at(i), s.dpdu.at(i), s.dpdv.at(i), {-w.x, -w.y, -w.z}, width[i]);
        duvdx.x[i] = f.duvdx.x;
        duvdx.y[i] = f.duvdx.y;
        duvdy.x[i] = f.duvdy.x;
        duvdy.y[i] = f.duvdy.y;
    }
}

} // namespace strobe
