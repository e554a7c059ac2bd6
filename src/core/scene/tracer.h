// Ray tracing: packets of rays against the scene's geometry. Implemented in embree_tracer.cpp.
#pragma once

#include "core/interfaces/camera.h"
#include "core/interfaces/geometry.h"
#include "core/math/api.h"

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace STROBE_API strobe {

inline constexpr uint32_t kNone = ~0u;

/// The surface point that a ray hit, as indices and barycentrics. All but t are independent of the ray.
struct Hit {
    uint32_t instance = kNone; ///< index into Scene::instances; kNone: geometry outside of instances
    uint32_t geometry = kNone; ///< index into Group::geometries; kNone: the ray missed
    uint32_t prim = 0;         ///< index of the triangle; 0 for a quadric
    float u = 0, v = 0;        ///< barycentrics of the second and third vertex; arguments of Quadric::point
    float t = 0;               ///< distance along the ray

    explicit operator bool() const { return geometry != kNone; }
};

/// Hits as a structure of arrays.
struct HitSoA {
    alignas(64) uint32_t instance[kSoAWidth], geometry[kSoAWidth], prim[kSoAWidth];
    alignas(64) float u[kSoAWidth], v[kSoAWidth], t[kSoAWidth];
    Hit at(int i) const { return {instance[i], geometry[i], prim[i], u[i], v[i], t[i]}; }
    void set(int i, const Hit& h) {
        instance[i] = h.instance;
        geometry[i] = h.geometry;
        prim[i] = h.prim;
        u[i] = h.u;
        v[i] = h.v;
        t[i] = h.t;
    }
};

/// Sixteen rays and their hits in the layout of RTCRayHit16. The hit of a ray does not depend on the other
/// rays of the packet (tested): images therefore do not depend on tiles and threads.
struct alignas(64) RayPacket {
    static constexpr int kSize = 16;
    // Initialized: Embree with assertions (Debian's build, under valgrind) reads inactive rays, too.
    float ox[kSize]{}, oy[kSize]{}, oz[kSize]{}, tnear[kSize]{};
    float dx[kSize]{}, dy[kSize]{}, dz[kSize]{}, time[kSize]{};
    float tfar[kSize]{};
    uint32_t mask[kSize];
    uint32_t id[kSize]{}; ///< of camera rays kCameraId, of occlusion rays idOfLight or 0, of others 0
    uint32_t flags[kSize]{};
    float ngx[kSize], ngy[kSize], ngz[kSize];
    float u[kSize], v[kSize];
    uint32_t prim[kSize], geom[kSize], inst[kSize];
    uint32_t instPrim[kSize]; ///< written by Embree 4, if it has instance arrays

    RayPacket() { std::fill(mask, mask + kSize, ~0u); }
    /// Returns the id of occlusion rays towards a light that cannot self-occlude (Light::cannotSelfOcclude):
    /// StaticQuadrics skip the light's own shape, which saves time only.
    static uint32_t idOfLight(int light) { return uint32_t(light) + 1; }
    /// The id of rays that do not hit the culled sides of meshes. setCamera does not set it.
    static constexpr uint32_t kCameraId = kNone - 1;
    /// Sets one ray and clears its hit.
    void set(int lane, const V3f& o, const V3f& d, float tmin, float tmax, float rayTime) {
        ox[lane] = o.x;
        oy[lane] = o.y;
        oz[lane] = o.z;
        tnear[lane] = tmin;
        dx[lane] = d.x;
        dy[lane] = d.y;
        dz[lane] = d.z;
        time[lane] = rayTime;
        tfar[lane] = tmax;
        geom[lane] = kNone;
        inst[lane] = kNone;
    }
    /// Sets all rays to the camera rays first … first+15.
    void setCamera(const CameraRaySoA& rays, const float* times, int first);
};

/// One shape of a group.
struct Geometry {
    PlacedShape placed;
    int material = 0;
    int light = -1;     ///< index into Scene::lights, outside of instances (see Instance::lights)
    std::string name{}; ///< see ObjectNames
    /// Absorption coefficients of the media inside and outside of the surface, per unit length of world
    /// space.
    Rgb absorptionInside{0}, absorptionOutside{0};
};

/// Geometry that is instanced together: one Embree scene. Group 0 is the geometry outside of instances.
struct Group {
    std::vector<Geometry> geometries;
};

struct Instance {
    uint32_t group; ///< index into Scene::groups
    std::shared_ptr<const Motion> motion;
    std::vector<int> lights; ///< index into Scene::lights or -1, per geometry; empty: none emits
    std::string name{};      ///< see ObjectNames
};

/// The content of the acceleration structures. Tests check that a scene pays only for what it uses.
struct TracerCounts {
    size_t triangles = 0;
    size_t quadrics = 0;
    size_t instances = 0;
    size_t timeSteps = 0;          ///< of moving geometries and instances; static ones have none
    size_t filteredGeometries = 0; ///< geometries with an alpha test or a culled side
};

/// Acceleration structures over the geometry of group 0 and the instances. Immutable, thread-safe.
class Tracer {
  public:
    /// Refers to the groups and their meshes, which must outlive the tracer. Throws Error if Embree fails,
    /// and std::bad_alloc if memory is exhausted.
    Tracer(const std::vector<Group>& groups, const std::vector<Instance>& instances);
    ~Tracer();
    Tracer(const Tracer&) = delete;
    Tracer& operator=(const Tracer&) = delete;

    /// Finds the nearest hits of rays 0 … n-1. `coherent`: origins and directions are similar (camera rays).
    void intersect(RayPacket& packet, int n, bool coherent) const;
    /// Sets tfar to -infinity for those of rays 0 … n-1 that hit anything between tnear and tfar.
    void occluded(RayPacket& packet, int n) const;
    /// Returns the hit of ray `lane` after `intersect`.
    Hit hit(const RayPacket& packet, int lane) const {
        if (packet.geom[lane] == kNone)
            return {};
        const uint32_t inst = packet.inst[lane];
        return {inst == kNone ? kNone : inst - m_firstInstance,
                packet.geom[lane],
                packet.prim[lane],
                packet.u[lane],
                packet.v[lane],
                packet.tfar[lane]};
    }
    /// Writes the hits of all 16 rays after `intersect` to elements first … first+15 of `out`.
    void hits(const RayPacket& packet, HitSoA& out, int first) const;

    /// Called with a triangle. Returns the radius for the rest of the query: at most the radius so far.
    using PointQueryVisitor = std::function<float(uint32_t prim)>;
    /// Visits all triangles of a mesh, at its first key, within `radius` of the point p (in the space of the
    /// group), and possibly others. The order is unspecified.
    void pointQuery(uint32_t group, uint32_t geometry, const V3f& p, float radius,
                    const PointQueryVisitor& visit) const;

    Box3f bounds() const;
    const TracerCounts& counts() const;

    enum class Query { Coherent, Nearest, Occluded };
    /// Called with every packet before it is traced; benchmarks record the renderer's rays with it. Not
    /// thread-safe: set or remove it (by an empty function) while nothing renders, then render on one thread.
    using Observer = std::function<void(const RayPacket& packet, int n, Query query)>;
    void observe(Observer observer) const { m_observer = std::move(observer); }

  private:
    struct Impl;
    std::unique_ptr<Impl> m_impl;
    uint32_t m_firstInstance = 0; ///< Embree's id of instance 0: ids of group 0's geometries are smaller
    mutable Observer m_observer;
};

/// Sets flush-to-zero and denormals-are-zero on the calling thread, as Embree recommends for threads that
/// trace. The destructor restores the previous mode, so that rendering has no effect on later computations.
class ScopedFlushDenormals {
  public:
    ScopedFlushDenormals();
    ~ScopedFlushDenormals();
    ScopedFlushDenormals(const ScopedFlushDenormals&) = delete;
    ScopedFlushDenormals& operator=(const ScopedFlushDenormals&) = delete;

  private:
    unsigned m_previousMode = 0;
};

} // namespace strobe
