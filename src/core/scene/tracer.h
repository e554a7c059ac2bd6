// Ray tracing: packets of rays against the scene's geometry. Implemented by the one file that knows Embree.
#pragma once

#include "core/interfaces/camera.h"
#include "core/interfaces/geometry.h"

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace strobe {

inline constexpr uint32_t kNone = ~0u;

/// What a ray met, as plain numbers; meaningful whatever ray found it.
struct Hit {
    uint32_t instance = kNone; ///< index into Scene::instances, or kNone for geometry of the world itself
    uint32_t geometry = kNone; ///< index into its group's geometries; kNone: nothing was hit
    uint32_t prim = 0;         ///< triangle
    float u = 0, v = 0;        ///< barycentrics of the second and third vertex, or Quadric's numbers
    float t = 0;               ///< distance along the ray that found it

    explicit operator bool() const { return geometry != kNone; }
};

/// Hits side by side.
struct HitSoA {
    alignas(64) uint32_t instance[kSoAWidth], geometry[kSoAWidth], prim[kSoAWidth];
    alignas(64) float u[kSoAWidth], v[kSoAWidth], t[kSoAWidth];
    Hit at(int i) const { return {instance[i], geometry[i], prim[i], u[i], v[i], t[i]}; }
    void set(int i, const Hit& h) {
        instance[i] = h.instance, geometry[i] = h.geometry, prim[i] = h.prim;
        u[i] = h.u, v[i] = h.v, t[i] = h.t;
    }
};

/// Sixteen rays in Embree's structure-of-arrays layout, with room for their hits. Lanes are independent: what
/// is found does not depend on which rays share a packet (measured, and tested: it is what makes images
/// independent of tiles and threads).
struct alignas(64) RayPacket {
    static constexpr int kSize = 16;
    // Zeros: Embree with assertions (Debian's, under valgrind) was seen to look at lanes not asked for.
    float ox[kSize]{}, oy[kSize]{}, oz[kSize]{}, tnear[kSize]{};
    float dx[kSize]{}, dy[kSize]{}, dz[kSize]{}, time[kSize]{};
    float tfar[kSize]{};
    uint32_t mask[kSize];
    uint32_t id[kSize]{}; ///< of occlusion rays: 0, or idOfLight where they end
    uint32_t flags[kSize]{};
    float ngx[kSize], ngy[kSize], ngz[kSize];
    float u[kSize], v[kSize];
    uint32_t prim[kSize], geom[kSize], inst[kSize];
    uint32_t spare[kSize]; ///< Embree 4 may write another number per hit here

    RayPacket() { std::fill(mask, mask + kSize, ~0u); }
    /// Of a ray to a sample of a light that hides none of its samples: it does not ask the light's own shape.
    static uint32_t idOfLight(int light) { return uint32_t(light) + 1; }
    void set(int lane, const V3f& o, const V3f& d, float tmin, float tmax, float rayTime) {
        ox[lane] = o.x, oy[lane] = o.y, oz[lane] = o.z, tnear[lane] = tmin;
        dx[lane] = d.x, dy[lane] = d.y, dz[lane] = d.z, time[lane] = rayTime;
        tfar[lane] = tmax;
        geom[lane] = kNone, inst[lane] = kNone;
    }
    /// Sixteen camera rays, from lane `first` of `rays` on.
    void setCamera(const CameraRaySoA& rays, const float* times, int first);
};

/// One shape of a group.
struct Geometry {
    PlacedShape placed;
    int material = 0;
    int light = -1;     ///< of the world's own geometry; instances keep their own list
    std::string name{}; ///< see ObjectNames
};

/// Geometry that moves (or is repeated) as one: an Embree scene of its own.
struct Group {
    std::vector<Geometry> geometries;
};

struct Instance {
    uint32_t group;
    std::shared_ptr<const Motion> motion;
    std::vector<int> lights; ///< per geometry of the group; empty: none shines
    std::string name{};      ///< see ObjectNames
};

/// What the acceleration structures hold: for the test that cost follows need.
struct TracerCounts {
    size_t triangles = 0, quadrics = 0, instances = 0;
    size_t timeSteps = 0;          ///< of geometries and instances that move; still ones carry none
    size_t filteredGeometries = 0; ///< with a cut-out test
};

/// Acceleration structures over the world's geometry and instances of groups; immutable, thread-safe.
class Tracer {
  public:
    /// Refers to the groups and their meshes: they must outlive the tracer. groups[0] is the world's own
    /// geometry.
    Tracer(const std::vector<Group>& groups, const std::vector<Instance>& instances);
    ~Tracer();
    Tracer(const Tracer&) = delete;
    Tracer& operator=(const Tracer&) = delete;

    /// Nearest hits of lanes 0 … n-1. `coherent`: the rays start together and point the same way (camera
    /// rays).
    void intersect(RayPacket& packet, int n, bool coherent) const;
    /// For lanes 0 … n-1: sets tfar negative where anything lies before tfar.
    void occluded(RayPacket& packet, int n) const;
    /// The hit of a lane after `intersect`.
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

    /// Those of all lanes; they become the lanes of `out` from `first` on.
    void hits(const RayPacket& packet, HitSoA& out, int first) const;

    /// Told of a triangle; answers how far the next may be and still matter: no farther than before.
    using PointQueryVisitor = std::function<float(uint32_t prim)>;
    /// Shows all triangles of a mesh, as it is at its first key, that come within `radius` of a point of its
    /// group's space, and perhaps others. Their order is anyone's guess.
    void pointQuery(uint32_t group, uint32_t geometry, const V3f& p, float radius,
                    const PointQueryVisitor& look) const;

    Box3f bounds() const;
    const TracerCounts& counts() const;

    enum class Query { Coherent, Nearest, Occluded };
    /// Shows every packet before it is traced: how benchmarks learn which rays the renderer traces. To be set
    /// (or unset, by an empty function) while nothing renders; rendering is then on one thread.
    using Observer = std::function<void(const RayPacket& packet, int n, Query query)>;
    void observe(Observer observer) const { m_observer = std::move(observer); }

  private:
    struct Impl;
    std::unique_ptr<Impl> m_impl;
    uint32_t m_firstInstance = 0; ///< geometries of the world come before instances
    mutable Observer m_observer;
};

/// Flush-to-zero and denormals-are-zero on the calling thread while it lives: Embree's advice for threads
/// that trace. Put back afterwards, so that what a program computes next does not depend on having rendered
/// before.
class ScopedFlushDenormals {
  public:
    ScopedFlushDenormals();
    ~ScopedFlushDenormals();
    ScopedFlushDenormals(const ScopedFlushDenormals&) = delete;
    ScopedFlushDenormals& operator=(const ScopedFlushDenormals&) = delete;

  private:
    unsigned m_before = 0;
};

} // namespace strobe
