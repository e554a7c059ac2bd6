// The built scene and its surface points.
#pragma once

#include "core/interfaces/camera.h"
#include "core/interfaces/filter.h"
#include "core/interfaces/light.h"
#include "core/interfaces/material.h"
#include "core/interfaces/sampler.h"
#include "core/math/api.h"
#include "core/scene/light_tree.h"
#include "core/scene/surface_ids.h"
#include "core/scene/tracer.h"

#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace STROBE_API strobe {

/// Returns the distance along a ray below which hits are ignored, so that the ray does not hit the surface
/// that it leaves. `offset` is SurfacePoint::offset, `cosine` the ray's cosine with the geometric normal. At
/// the returned distance the ray is `offset` above the tangent plane; for grazing rays it is at most 100
/// offsets. The origin itself is not moved: from a moved origin, a small light would occlude samples near its
/// own limb.
inline float tminFor(float offset, float cosine) { return offset / std::max(std::abs(cosine), 0.01f); }

/// The local geometry, material and light at a point on a surface, in world space (pbrt's SurfaceInteraction,
/// without the ray).
struct SurfacePoint {
    V3f p;
    V3f ng; ///< unit geometric normal on the surface's outer side (see Light::emitted), not the viewer's
    V3f ns; ///< unit shading normal, in the hemisphere of ng
    V2f uv{0};
    V3f dpdu{0}, dpdv{0}; ///< of a mesh: zero unless the material needs a footprint
    float offset = 0;     ///< a bound of the rounding error of p, for `tmin`
    const Material* material = nullptr;
    int light = -1; ///< index into Scene::lights; -1: the surface does not emit
    uint32_t prim = 0;

    /// Returns `tminFor` a ray from p along the unit vector `w`.
    float tmin(const V3f& w) const { return tminFor(offset, dot(w, ng)); }
};

/// A SurfacePoint whose normals are neither normalized nor oriented yet, and whose offset is not set. The
/// remaining steps do not depend on the shape, so that shading takes them for a whole SurfaceSoA at once.
struct RawSurfacePoint : SurfacePoint {
    float scale = 0;       ///< the largest absolute coordinate in the computation of p
    float orientation = 1; ///< -1 if the normals are to be reversed

    /// Completes the point: normalizes and orients the normals and sets the offset.
    void finish() {
        finishNormals(ng, ns, orientation);
        offset = offsetOf(scale, p);
    }
    /// Normalizes both normals. ns defines the outer side of the surface: ng is flipped into its hemisphere.
    static void finishNormals(V3f& ng, V3f& ns, float orientation) {
        ng = normalizeAny(ng);
        ns = normalizeAny(ns);
        const float flip = dot(ng, ns) < 0 ? -orientation : orientation;
        ng *= flip;
        ns *= orientation;
    }
    /// Returns a bound of the rounding error of p, given RawSurfacePoint::scale.
    static float offsetOf(float scale, const V3f& p) {
        return 4e-6f * std::max(std::max(scale, std::abs(p.x)), std::max(std::abs(p.y), std::abs(p.z)));
    }
};

/// RawSurfacePoints as a structure of arrays.
struct SurfaceSoA {
    V3SoA p, ng, ns, dpdu, dpdv;
    V2SoA uv;
    alignas(64) float scale[kSoAWidth], orientation[kSoAWidth];
    const Material* material[kSoAWidth];
    int light[kSoAWidth];
    uint32_t prim[kSoAWidth];

    RawSurfacePoint at(int i) const {
        RawSurfacePoint s;
        s.p = p.at(i);
        s.ng = ng.at(i);
        s.ns = ns.at(i);
        s.uv = uv.at(i);
        s.dpdu = dpdu.at(i);
        s.dpdv = dpdv.at(i);
        s.material = material[i];
        s.light = light[i];
        s.prim = prim[i];
        s.scale = scale[i];
        s.orientation = orientation[i];
        return s;
    }
};

/// A discrete distribution over lights: proportional to power, but with at least 2^-23 (or the uniform
/// probability, if that is less) for every light with power > 0, so that 24-bit random numbers can pick it.
class LightSampler {
  public:
    LightSampler() = default;
    /// Takes the power of each light. If their sum is zero or not finite, the distribution is uniform.
    explicit LightSampler(std::vector<float> powers);
    /// Returns the index of a light, for u uniform in [0,1).
    int pick(float u) const;
    /// Returns the exact probability of picking `light`: the length of its interval of [0,1).
    float probability(int light) const {
        return m_cdf[size_t(light)] - (light > 0 ? m_cdf[size_t(light) - 1] : 0);
    }

  private:
    std::vector<float> m_cdf; ///< the end of each light's interval of [0,1)
};

/// Everything that rendering reads. Immutable after construction; shared by all threads.
class Scene {
  public:
    Scene(std::vector<Group> groups, std::vector<Instance> instances,
          std::vector<std::shared_ptr<const Material>> materials,
          std::vector<std::shared_ptr<const Light>> lights, std::shared_ptr<const Camera> camera,
          Shutter shutter, bool showsBackground = true);

    const Tracer& tracer() const { return *m_tracer; }
    const Camera& camera() const { return *m_camera; }
    const std::vector<std::shared_ptr<const Light>>& lights() const { return m_lights; }
    const std::vector<std::shared_ptr<const Material>>& materials() const { return m_materials; }
    /// Indices of the environment lights (Light::isEnvironment).
    const std::vector<int>& environments() const { return m_environments; }
    /// Whether camera rays that miss the scene see the environment lights; else they see black.
    bool showsBackground() const { return m_showsBackground; }
    /// The distribution of lights by power.
    const LightSampler& lightSampler() const { return m_lightSampler; }
    /// The uniform distribution of the lights with power > 0.
    const LightSampler& uniformLightSampler() const { return m_uniformLightSampler; }
    /// Returns the number of emitters of all lights: see Light::emitterCount.
    size_t emitterCount() const { return m_emitterCount; }
    /// Returns the light tree with these settings, which is built by the first call. Valid as long as the
    /// scene.
    const LightTree& lightTree(const LightTreeSettings& settings) const;
    /// Returns the numbers of the surfaces, which the first call finds. Valid as long as the scene.
    const SurfaceIds& surfaceIds() const;
    const Shutter& shutter() const { return m_shutter; }
    /// True when the camera or any shape changes while the shutter is open.
    bool moves() const { return m_moves; }
    /// True when some material reads the texture footprint of rays.
    bool needsFootprint() const { return m_needsFootprint; }
    /// True when some surface bounds an absorbing medium.
    bool hasMedia() const { return m_hasMedia; }
    /// Returns the geometry that was hit. `hit` must not be empty.
    const Geometry& geometry(const Hit& hit) const {
        const uint32_t group = hit.instance == kNone ? 0 : m_instances[hit.instance].group;
        return m_groups[group].geometries[hit.geometry];
    }
    const std::vector<Group>& groups() const { return m_groups; }
    const std::vector<Instance>& instances() const { return m_instances; }

    /// Returns the surface point of `hit` at shutter fraction `time`. `hit` must not be empty.
    SurfacePoint surface(const Hit& hit, float time) const {
        RawSurfacePoint s = rawSurface(hit, time);
        s.finish();
        return s;
    }
    /// Returns the same point before RawSurfacePoint::finish.
    RawSurfacePoint rawSurface(const Hit& hit, float time) const;
    /// Writes the raw surface points of hits 0 … n-1 at shutter fractions `time`. No hit may be empty.
    /// Consecutive hits on the same geometry are processed together.
    void rawSurfaces(const HitSoA& hits, const float* time, int n, SurfaceSoA& out) const;
    /// True if some mesh is larger than a first-level cache: `prefetch` then pays off.
    bool hasLargeMeshes() const { return m_hasLargeMeshes; }
    /// Prefetches the indices and the vertices of the triangles that were hit. Empty hits are skipped.
    void prefetch(std::span<const Hit> hits) const;
    /// Writes dp/du and dp/dv at `hit` in world space, as normal maps expect them: if the mesh has tangents
    /// and does not deform, dp/du is the interpolated tangent. Zero where texture coordinates are degenerate.
    void tangents(const Hit& hit, float time, V3f& dpdu, V3f& dpdv) const;
    /// True if the surface that was hit emits light. `hit` must not be empty.
    bool emits(const Hit& hit) const { return lightOf(hit) >= 0; }
    /// Returns the radiance that the emitting surface point `s` at `hit` sends along the unit direction `w`.
    Rgb emitted(const SurfacePoint& s, const Hit& hit, const V3f& w) const;
    /// Returns the radiance that all environment lights contribute to a ray in the unit direction d that
    /// misses the scene.
    Rgb environment(const V3f& d) const;

  private:
    bool anythingMoves() const;
    static void meshSurface(const PlacedShape& placed, const Hit& hit, float time, RawSurfacePoint& s);
    void rawSurfacesOfGeometry(const HitSoA& hits, const float* time, int begin, int end,
                               SurfaceSoA& out) const;
    /// Returns the light that the surface at `hit` belongs to, or -1.
    int lightOf(const Hit& hit) const {
        if (hit.instance == kNone)
            return geometry(hit).light;
        const std::vector<int>& lights = m_instances[hit.instance].lights;
        return lights.empty() ? -1 : lights[hit.geometry];
    }
    /// True if the vertices are in world space already, as those of meshes outside of instances.
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
    LightSampler m_lightSampler, m_uniformLightSampler;
    size_t m_emitterCount = 0;
    float m_radius; ///< of the bounding sphere
    mutable std::mutex m_lightTreeMutex;
    mutable std::vector<std::pair<LightTreeSettings, std::unique_ptr<const LightTree>>> m_lightTrees;
    mutable std::once_flag m_surfacesAreFound;
    mutable std::unique_ptr<const SurfaceIds> m_surfaceIds;
    std::shared_ptr<const Camera> m_camera;
    Shutter m_shutter;
    bool m_showsBackground;
    bool m_moves = false;
    bool m_needsFootprint = false;
    bool m_hasLargeMeshes = false;
    bool m_hasMedia = false;
    std::unique_ptr<const Tracer> m_tracer;
};

/// Writes the texture footprint on a surface of a ray cone to q.duvdx and q.duvdy. `d` is the unit ray
/// direction, `width` the cone's width at the surface, perpendicular to d. s.ng may have any length.
void footprint(const SurfacePoint& s, const V3f& d, float width, TextureQuery& q);
/// Writes the footprints of points begin … end-1 for rays along -wo.
void footprints(const SurfaceSoA& s, const V3SoA& wo, const float* width, int begin, int end, V2SoA& duvdx,
                V2SoA& duvdy);

} // namespace strobe
