// The built scene: immutable, shared by all threads.
#pragma once

#include "core/interfaces/camera.h"
#include "core/interfaces/filter.h"
#include "core/interfaces/light.h"
#include "core/interfaces/material.h"
#include "core/interfaces/sampler.h"
#include "core/scene/tracer.h"

#include <memory>
#include <span>
#include <vector>

namespace strobe {

/// Where a ray is clear of the surface that it leaves, given SurfacePoint::offset and the ray's cosine with
/// the geometric normal. Rays start at the surface itself, not beside it: from a shifted origin, light
/// samples near the limb of a small light would be hidden by the light.
inline float tminFor(float offset, float cosine) { return offset / std::max(std::abs(cosine), 0.01f); }

/// A point on the scene's surface, as shading needs it. World space.
struct SurfacePoint {
    V3f p;
    V3f ng; ///< unit geometric normal: the surface's own side (see Light::emitted), not turned to the viewer
    V3f ns; ///< unit shading normal, in ng's hemisphere
    V2f uv{0};
    V3f dpdu{0}, dpdv{0}; ///< only where the material needs a footprint or the mesh has tangents, else zero
    float offset = 0;     ///< a distance from the surface that surely clears its rounding errors
    const Material* material = nullptr;
    int light = -1; ///< index into Scene::lights when the surface shines
    uint32_t prim = 0;

    /// Where a ray that leaves p towards `w` is clear of the surface.
    float tmin(const V3f& w) const { return tminFor(offset, dot(w, ng)); }
};

/// A SurfacePoint whose normals are not yet of unit length, nor turned, and whose offset is missing: what is
/// left to do is the same for every point, and done side by side where there are many.
struct RawSurfacePoint : SurfacePoint {
    float scale = 0;       ///< of the numbers that the position was computed from
    float orientation = 1; ///< -1: the normals are to be turned round

    /// Completes the point.
    void finish() { finishNormals(ng, ns, orientation), offset = offsetOf(scale, p); }
    static void finishNormals(V3f& ng, V3f& ns, float orientation) {
        ng = normalizeAny(ng), ns = normalizeAny(ns);
        const float turn =
            dot(ng, ns) < 0 ? -orientation : orientation; // vertex normals say which side is which
        ng *= turn, ns *= orientation;
    }
    static float offsetOf(float scale, const V3f& p) {
        return 4e-6f * std::max(std::max(scale, std::abs(p.x)), std::max(std::abs(p.y), std::abs(p.z)));
    }
};

/// RawSurfacePoints side by side.
struct SurfaceSoA {
    V3SoA p, ng, ns, dpdu, dpdv;
    V2SoA uv;
    alignas(64) float scale[kSoAWidth], orientation[kSoAWidth];
    const Material* material[kSoAWidth];
    int light[kSoAWidth];
    uint32_t prim[kSoAWidth];

    RawSurfacePoint at(int i) const {
        RawSurfacePoint s;
        s.p = p.at(i), s.ng = ng.at(i), s.ns = ns.at(i), s.uv = uv.at(i);
        s.dpdu = dpdu.at(i), s.dpdv = dpdv.at(i);
        s.material = material[i], s.light = light[i], s.prim = prim[i];
        s.scale = scale[i], s.orientation = orientation[i];
        return s;
    }
};

/// A small discrete distribution over lights, by power.
class LightSampler {
  public:
    LightSampler() = default;
    explicit LightSampler(std::vector<float> powers);
    /// The light for u in [0,1).
    int pick(float u) const;
    /// How much of [0,1) picks it, exactly. Above 0 if its power is.
    float probability(int light) const {
        return m_cdf[size_t(light)] - (light > 0 ? m_cdf[size_t(light) - 1] : 0);
    }

  private:
    std::vector<float> m_cdf; ///< where each light's part of [0,1) ends
};

/// Everything that rendering reads. Members are filled by the builder, then const.
class Scene {
  public:
    Scene(std::vector<Group> groups, std::vector<Instance> instances,
          std::vector<std::shared_ptr<const Material>> materials,
          std::vector<std::shared_ptr<const Light>> lights, std::shared_ptr<const Camera> camera,
          Shutter shutter);

    const Tracer& tracer() const { return *m_tracer; }
    const Camera& camera() const { return *m_camera; }
    const std::vector<std::shared_ptr<const Light>>& lights() const { return m_lights; }
    const std::vector<std::shared_ptr<const Material>>& materials() const { return m_materials; }
    /// Indices of the lights that have radiance at infinity.
    const std::vector<int>& environments() const { return m_environments; }
    const LightSampler& lightSampler() const { return m_lightSampler; }
    const Shutter& shutter() const { return m_shutter; }
    /// True when the camera or any shape changes while the shutter is open.
    bool moves() const;
    /// True when some material looks at the ray footprint.
    bool needsFootprint() const { return m_needsFootprint; }
    const Geometry& geometry(const Hit& hit) const {
        const uint32_t group = hit.instance == kNone ? 0 : m_instances[hit.instance].group;
        return m_groups[group].geometries[hit.geometry];
    }
    const std::vector<Group>& groups() const { return m_groups; }
    const std::vector<Instance>& instances() const { return m_instances; }

    /// The surface where `hit` is, at shutter fraction `time`. `hit` must not be empty.
    SurfacePoint surface(const Hit& hit, float time) const {
        RawSurfacePoint s = rawSurface(hit, time);
        s.finish();
        return s;
    }
    RawSurfacePoint rawSurface(const Hit& hit, float time) const;
    /// The same of hits 0 … n-1, none of them empty; quicker where neighbors are on the same geometry.
    void rawSurfaces(const HitSoA& hits, const float* time, int n, SurfaceSoA& out) const;
    /// Whether its meshes are more than a processor's nearest cache holds.
    bool hasLargeMeshes() const { return m_hasLargeMeshes; }
    /// Asks for the memory that the surfaces of some hits, or of none, are read from: it arrives while others
    /// are worked on. Worth its time where meshes are large.
    void prefetch(std::span<const Hit> hits) const;
    /// dp/du and dp/dv there, in world space, as normal maps mean them: the direction of the first is that of
    /// the mesh's tangents where it has them and does not deform. Zero where texture coordinates are
    /// degenerate.
    void tangents(const Hit& hit, float time, V3f& dpdu, V3f& dpdv) const;
    /// Radiance of all environments arriving from direction d.
    Rgb environment(const V3f& d) const;

  private:
    static void meshSurface(const PlacedShape& placed, const Hit& hit, float time, RawSurfacePoint& s);
    void surfacesOfOne(const HitSoA& hits, const float* time, int begin, int end, SurfaceSoA& out) const;
    /// The light that shines there, or -1.
    int lightOf(const Hit& hit) const {
        if (hit.instance == kNone)
            return geometry(hit).light;
        const std::vector<int>& lights = m_instances[hit.instance].lights;
        return lights.empty() ? -1 : lights[hit.geometry];
    }
    /// Meshes of the world are: their points need no transform.
    static bool isBaked(const Hit& hit, const PlacedShape& placed) {
        return hit.instance == kNone && placed.shape.mesh;
    }
    M44f toWorld(const Hit& hit, const PlacedShape& placed, float time) const {
        return hit.instance == kNone ? placed.toParent
                                     : placed.toParent * m_instances[hit.instance].motion->at(time);
    }

    std::vector<Group> m_groups;
    std::vector<Instance> m_instances;
    std::vector<std::shared_ptr<const Material>> m_materials;
    std::vector<std::shared_ptr<const Light>> m_lights;
    std::vector<int> m_environments;
    LightSampler m_lightSampler;
    std::shared_ptr<const Camera> m_camera;
    Shutter m_shutter;
    bool m_needsFootprint = false, m_hasLargeMeshes = false;
    std::unique_ptr<const Tracer> m_tracer;
};

/// The texture footprint of a ray cone `width` wide (perpendicular to ray direction d) on a surface, whose
/// normal may be of any length: fills duvdx and duvdy of `q`.
void footprint(const SurfacePoint& s, const V3f& d, float width, TextureQuery& q);
/// The same of points `begin` to `end`, for rays along -wo.
void footprints(const SurfaceSoA& s, const V3SoA& wo, const float* width, int begin, int end, V2SoA& duvdx,
                V2SoA& duvdy);

} // namespace strobe
