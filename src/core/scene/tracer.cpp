// Conversion between SoA chunks and ray packets.
#include "core/scene/tracer.h"

namespace strobe {

namespace {

// One loop over all arrays: a loop per array would become a call of memcpy each.
STROBE_TARGET_CLONES void writeRays(const CameraRaySoA& rays, const float* times, int first, RayPacket& out) {
    STROBE_IVDEP
    for (int i = 0; i < RayPacket::kSize; ++i) {
        const int k = first + i;
        out.ox[i] = rays.o.x[k];
        out.oy[i] = rays.o.y[k];
        out.oz[i] = rays.o.z[k];
        out.dx[i] = rays.d.x[k];
        out.dy[i] = rays.d.y[k];
        out.dz[i] = rays.d.z[k];
        out.time[i] = times[k];
        out.tnear[i] = 0;
        out.tfar[i] = kInfinity;
        out.geom[i] = kNone;
        out.inst[i] = kNone;
    }
}

STROBE_TARGET_CLONES void readHits(const RayPacket& packet, uint32_t firstInstance, HitSoA& out, int first) {
    const Hit miss;
    STROBE_IVDEP
    for (int i = 0; i < RayPacket::kSize; ++i) {
        const bool isHit = packet.geom[i] != kNone;
        const int k = first + i;
        out.instance[k] = packet.inst[i] == kNone ? kNone : packet.inst[i] - firstInstance;
        out.geometry[k] = packet.geom[i];
        out.prim[k] = isHit ? packet.prim[i] : miss.prim;
        out.u[k] = isHit ? packet.u[i] : miss.u;
        out.v[k] = isHit ? packet.v[i] : miss.v;
        out.t[k] = isHit ? packet.tfar[i] : miss.t;
    }
}

} // namespace

void RayPacket::setCamera(const CameraRaySoA& rays, const float* times, int first) {
    writeRays(rays, times, first, *this);
}

void Tracer::hits(const RayPacket& packet, HitSoA& out, int first) const {
    readHits(packet, m_firstInstance, out, first);
}

} // namespace strobe
