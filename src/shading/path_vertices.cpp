// From paths and what they meet to vertices with their BSDFs ready.
#include "shading/path_worker.h"

namespace strobe {

TextureQuery PathWorker::queryAt(const SurfacePoint& s, const Hit& hit) {
    TextureQuery q;
    q.uv = s.uv;
    q.p = s.p;
    q.prim = s.prim;
    q.barycentrics = V2f(hit.u, hit.v);
    return q;
}

/// Adds what the paths meet that shines, and makes vertices of those that may go on.
void PathWorker::load(std::span<const uint32_t> paths) {
    prefetch(paths);
    size_t missed = 0;
    int n = 0;
    for (uint32_t i : paths) {
        Path& path = m_paths[i];
        path.lightIsDirect = path.stage == PathStage::Camera;
        if (!path.hit)
            m_missed[missed++] = i;
        else
            gather(i, path, n++);
    }
    addEnvironment(std::span(m_missed).first(missed));
    m_scene.rawSurfaces(m_hits, m_v.time, n, m_surface);
    m_counters->surfaces += uint64_t(n);
    for (int i = 0; i < n; ++i)
        if (m_surface.light[i] >= 0)
            addEmission(m_v.path[i], m_surface.at(i));
    m_v.count = m_bounce < m_settings.maxDepth ? n : 0;
    if (m_v.count > 0)
        prepare(true);
}

void PathWorker::prefetch(std::span<const uint32_t> paths) const {
    if (!m_scene.hasLargeMeshes())
        return;
    Hit hits[kSoAWidth];
    for (size_t i = 0; i < paths.size(); ++i)
        hits[i] = m_paths[paths[i]].hit;
    m_scene.prefetch(std::span(hits).first(paths.size()));
}

/// A path that meets a surface becomes vertex i, but for its surface.
void PathWorker::gather(uint32_t index, Path& path, int i) {
    path.cone.width += path.hit.t * path.cone.spread;
    m_hits.set(i, path.hit);
    m_width[i] = path.cone.width;
    m_v.path[i] = index, m_v.time[i] = path.ray.time;
    m_v.wo.set(i, -path.ray.d), m_v.beta.set(i, path.beta);
}

/// Fills what is left of m_v to fill before it is finished, or only what is needed for albedos.
void PathWorker::prepare(bool forLight) {
    const int n = m_v.count;
    const SurfaceSoA& s = m_surface;
    const TextureQuerySoA q{s.uv, s.p, m_duvdx, m_duvdy, s.prim, m_hits.u, m_hits.v};
    for (int begin = 0, end; begin < n; begin = end) {
        const Material& material = *s.material[begin];
        const MaterialFlags& flags = material.flags();
        for (end = begin; end < n && s.material[end] == &material; ++end)
            m_v.bsdf[end].material = &material, m_v.material[end] = &material;
        std::fill(m_v.isSmooth + begin, m_v.isSmooth + end, flags.smooth);
        std::fill(m_v.transmits + begin, m_v.transmits + end, flags.transmissive ? 1.f : 0.f);
        findFootprints(material, begin, end);
        material.prepareSoA(q, begin, end, m_v.bsdf);
        if (forLight && flags.shadingNormal != ShadingNormal::AsIs)
            for (int i = begin; i < end; ++i)
                adjustNormal(i, q.at(i));
        if (forLight && m_bounce == 0 && flags.textured)
            divideByAlbedo(material, begin, end);
    }
    m_v.setSurfaces(s);
}

void PathWorker::findFootprints(const Material& material, int begin, int end) {
    if (material.flags().needsFootprint) {
        footprints(m_surface, m_v.wo, m_width, begin, end, m_duvdx, m_duvdy);
        m_counters->footprints += uint64_t(end - begin);
    } else {
        for (float* row : {m_duvdx.x, m_duvdx.y, m_duvdy.x, m_duvdy.y})
            std::fill(row + begin, row + end, 0.f);
    }
}

/// See LightComponent::Indirect.
void PathWorker::divideByAlbedo(const Material& material, int begin, int end) {
    constexpr float kBlack = 1e-4f; // what is black gives nothing to carry elsewhere
    for (int i = begin; i < end; ++i) {
        Path& path = m_paths[m_v.path[i]];
        if (path.component != LightComponent::Indirect)
            continue;
        const Rgb a = material.albedo(m_v.bsdf[i]);
        path.beta = {a.x > kBlack ? 1 / a.x : 0, a.y > kBlack ? 1 / a.y : 0, a.z > kBlack ? 1 / a.z : 0};
        m_v.beta.set(i, path.beta);
    }
}

/// What those paths ask for that ask for an albedo.
void PathWorker::addAlbedos() {
    sortByMaterial(m_albedos);
    for (size_t first = 0; first < m_albedos.size(); first += kSoAWidth) {
        const auto paths = std::span(m_albedos).subspan(first);
        const int n = int(std::min<size_t>(kSoAWidth, paths.size()));
        prefetch(paths.first(size_t(n)));
        for (int i = 0; i < n; ++i)
            gather(paths[size_t(i)], m_paths[paths[size_t(i)]], i);
        m_scene.rawSurfaces(m_hits, m_v.time, n, m_surface);
        m_counters->surfaces += uint64_t(n);
        m_v.count = n;
        prepare(false);
        for (int i = 0; i < n; ++i)
            m_paths[m_v.path[i]].radiance = m_v.material[i]->albedo(m_v.bsdf[i]);
    }
}

/// Gives the surface of vertex i the shading normal that its material wants, and finishes its normals.
void PathWorker::adjustNormal(int i, const TextureQuery& q) {
    const Material& material = *m_v.material[i];
    const V3f d = -m_v.wo.at(i);
    V3f ng = m_surface.ng.at(i), n = m_surface.ns.at(i);
    RawSurfacePoint::finishNormals(ng, n, m_surface.orientation[i]);
    if (material.flags().shadingNormal == ShadingNormal::Mapped) {
        V3f dpdu, dpdv;
        m_scene.tangents(m_hits.at(i), m_v.time[i], dpdu, dpdv);
        const V3f t = normalize(dpdu - n * dot(n, dpdu)), b = cross(n, t), local = material.tangentNormal(q);
        n = t * local.x + b * std::copysign(local.y, local.y * dot(b, dpdv)) + n * local.z;
    }
    // It stays above the surface, and faces the viewer's side: else no light that the lobes see would count.
    constexpr float kLeast = 0.01f;
    const V3f wo = dot(d, ng) > 0 ? d : -d;
    n = normalize(n);
    for (const V3f& towards : {ng, wo})
        if (const float c = dot(n, towards); c < kLeast)
            n = normalize(n + towards * (kLeast - c));
    m_surface.ng.set(i, ng), m_surface.ns.set(i, n), m_surface.orientation[i] = 1;
}

} // namespace strobe
