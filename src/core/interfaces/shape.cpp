#include "core/interfaces/shape.h"

#include "core/math/soa.h"

namespace strobe {

namespace {

STROBE_TARGET_CLONES void toObjectSpace(const M44f& m, const float* rows, size_t packet, QuadricRaySoA& out) {
    STROBE_IVDEP
    for (int i = 0; i < out.n; ++i) {
        const V3f o = transformPoint(m, {rows[i], rows[packet + i], rows[2 * packet + i]});
        const V3f d = transformVector(m, {rows[4 * packet + i], rows[5 * packet + i], rows[6 * packet + i]});
        out.ox[i] = o.x;
        out.oy[i] = o.y;
        out.oz[i] = o.z;
        out.dx[i] = d.x;
        out.dy[i] = d.y;
        out.dz[i] = d.z;
        out.tmin[i] = rows[3 * packet + i];
        out.tmax[i] = rows[8 * packet + i];
    }
}

} // namespace

QuadricRaySoA::QuadricRaySoA(const M44f& toObject, const float* rows, unsigned packet, unsigned first,
                             unsigned count)
    : n(int(count)) {
    toObjectSpace(toObject, rows + first, packet, *this);
}

void Quadric::intersectSoA(const QuadricRaySoA& rays, int32_t* hit, float* t, float* u, float* v) const {
    for (int i = 0; i < rays.n; ++i)
        hit[i] = hit[i] && intersect(rays.o(i), rays.d(i), rays.tmin[i], rays.tmax[i], t[i], u[i], v[i]);
}

void Quadric::pointSoA(const float* u, const float* v, int begin, int end, QuadricPointSoA& out) const {
    for (int i = begin; i < end; ++i) {
        const QuadricPoint q = point(u[i], v[i]);
        out.p.set(i, q.p);
        out.n.set(i, q.n);
        out.dpdu.set(i, q.dpdu);
        out.dpdv.set(i, q.dpdv);
        out.uv.set(i, q.uv);
    }
}

void Quadric::samplePointSoA(const V2SoA& u, int n, V3SoA& p, V3SoA& normal) const {
    for (int i = 0; i < n; ++i) {
        const QuadricPoint q = samplePoint(u.at(i));
        p.set(i, q.p);
        normal.set(i, q.n);
    }
}

} // namespace strobe
