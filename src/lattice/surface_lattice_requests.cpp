// SurfaceLattice: the shading requests of lattice points.
#include "lattice/surface_lattice.h"

namespace strobe {

namespace {

/// Writes requests `first` … first + shades.count - 1: rays from the viewpoints to the points.
STROBE_TARGET_CLONES void writeRays(const ShadeSoA& shades, RequestSoA& out, int first) {
    // A point beyond the silhouette is shaded as if seen at a grazing angle from the side that the samples
    // see.
    constexpr float kMinCosine = 0.02f;
    const int n = shades.count;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const V3f normal = normalizeAny(shades.n.at(i)) * (shades.isFront[i] ? 1.f : -1.f);
        const V3f p = shades.p.at(i), toPoint = p - shades.viewpoint.at(i);
        const float t = length(toPoint);
        const V3f toViewer = normalize(-toPoint);
        const float cosine = dot(toViewer, normal);
        const V3f raised = normalize(toViewer + normal * (kMinCosine - cosine));
        const V3f wo(cosine < kMinCosine ? raised.x : toViewer.x, cosine < kMinCosine ? raised.y : toViewer.y,
                     cosine < kMinCosine ? raised.z : toViewer.z);
        const int k = first + i;
        out.ray.o.x[k] = p.x + wo.x * t;
        out.ray.o.y[k] = p.y + wo.y * t;
        out.ray.o.z[k] = p.z + wo.z * t;
        out.ray.d.x[k] = -wo.x;
        out.ray.d.y[k] = -wo.y;
        out.ray.d.z[k] = -wo.z;
        out.hit.instance[k] = shades.hit.instance[i];
        out.hit.geometry[k] = shades.hit.geometry[i];
        out.hit.prim[k] = shades.hit.prim[i];
        out.hit.u[k] = shades.hit.u[i];
        out.hit.v[k] = shades.hit.v[i];
        out.hit.t[k] = t;
        out.time[k] = shades.time[i];
        out.width[k] = shades.cone.width[i];
        out.spread[k] = shades.cone.spread[i];
    }
}

} // namespace

void SurfaceLattice::writeRequests(ShadeSoA& shades, SurfaceCache& surfaces, RequestSoA& requests,
                                   int first) const {
    for (int begin = 0, end; begin < shades.count; begin = end) {
        const LatticeSurface& surface = surfaces.surfaceOf(shades.hit, begin);
        end = begin + 1;
        while (end < shades.count && surface.isHitBy(shades.hit, end))
            ++end;
        for (int i = begin; i < end; ++i) {
            if (shades.isVertex[i]) {
                const MeshPoint point = surface.meshPointOf(shades.hit.prim[i]);
                shades.hit.prim[i] = point.prim;
                shades.hit.u[i] = point.u;
                shades.hit.v[i] = point.v;
            }
        }
        surface.computePoints(shades.hit, shades.time, begin, end, shades.p, shades.n);
    }
    m_scene.camera().viewpointSoA(shades.p, shades.lens, shades.time, shades.count, shades.viewpoint);
    computeCones(shades);
    writeRays(shades, requests, first);
}

/// Textures are filtered over a block, which the shade represents, but at least over a pixel.
void SurfaceLattice::computeCones(ShadeSoA& shades) const {
    if (!m_scene.needsFootprint()) {
        std::fill_n(shades.cone.width, shades.count, 0.f);
        std::fill_n(shades.cone.spread, shades.count, 0.f);
        return;
    }
    const Camera& camera = m_scene.camera();
    V2SoA film;
    for (int i = 0; i < shades.count; ++i)
        film.set(i, camera.project(shades.p.at(i), shades.time[i]).value_or(FilmPoint{}).film);
    camera.coneSoA(film, shades.count, shades.cone.width, shades.cone.spread);
    const float scale = std::max(m_blockSize, 1.f);
    for (int i = 0; i < shades.count; ++i) {
        shades.cone.width[i] *= scale;
        shades.cone.spread[i] *= scale;
    }
}

} // namespace strobe
