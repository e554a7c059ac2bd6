// Rays and hits on their way between lanes and packets.
#include "core/scene/tracer.h"

namespace strobe {

namespace {

// All rows in one loop: a copy of each by itself would be a call.
STROBE_TARGET_CLONES void putRays(const CameraRaySoA& rays, const float* times, int first, RayPacket& out) {
    STROBE_IVDEP
    for (int i = 0; i < RayPacket::kSize; ++i) {
        const int k = first + i;
        out.ox[i] = rays.o.x[k], out.oy[i] = rays.o.y[k], out.oz[i] = rays.o.z[k];
        out.dx[i] = rays.d.x[k], out.dy[i] = rays.d.y[k], out.dz[i] = rays.d.z[k];
        out.time[i] = times[k], out.tnear[i] = 0, out.tfar[i] = kInfinity;
        out.geom[i] = out.inst[i] = kNone;
    }
}

STROBE_TARGET_CLONES void takeHits(const RayPacket& b, uint32_t firstInstance, HitSoA& out, int first) {
    const Hit none;
    STROBE_IVDEP
    for (int i = 0; i < RayPacket::kSize; ++i) {
        const bool any = b.geom[i] != kNone;
        const int k = first + i;
        out.instance[k] = b.inst[i] == kNone ? kNone : b.inst[i] - firstInstance;
        out.geometry[k] = b.geom[i];
        out.prim[k] = any ? b.prim[i] : none.prim;
        out.u[k] = any ? b.u[i] : none.u;
        out.v[k] = any ? b.v[i] : none.v;
        out.t[k] = any ? b.tfar[i] : none.t;
    }
}

} // namespace

void RayPacket::setCamera(const CameraRaySoA& rays, const float* times, int first) {
    putRays(rays, times, first, *this);
}

void Tracer::hits(const RayPacket& packet, HitSoA& out, int first) const {
    takeHits(packet, m_firstInstance, out, first);
}

} // namespace strobe
