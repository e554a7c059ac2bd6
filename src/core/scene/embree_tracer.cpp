// The tracer on top of Embree 3 or 4; no other file includes Embree.
#include "core/scene/alpha_test.h"
#include "core/scene/static_quadrics.h"
#include "core/util/error.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <cstddef>
#include <mutex>
#include <new>
#include <utility>

#if defined(__x86_64__)
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

namespace strobe {

static_assert(sizeof(RayPacket) >= sizeof(RTCRayHit16) &&
              offsetof(RayPacket, geom) == offsetof(RTCRayHit16, hit.geomID) &&
              offsetof(RayPacket, inst) == offsetof(RTCRayHit16, hit.instID) &&
              offsetof(RayPacket, tfar) == offsetof(RTCRayHit16, ray.tfar));

#if defined(__x86_64__)
ScopedFlushDenormals::ScopedFlushDenormals() : m_previousMode(_mm_getcsr()) {
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
}
ScopedFlushDenormals::~ScopedFlushDenormals() { _mm_setcsr(m_previousMode); }
#else
ScopedFlushDenormals::ScopedFlushDenormals() = default;
ScopedFlushDenormals::~ScopedFlushDenormals() = default;
#endif

namespace {

/// The user data of a geometry, for Embree's callbacks.
struct CallbackData {
    const PlacedShape* placed;
    M44f toObject; ///< the group's space to object space
    uint32_t seed; ///< of the alpha test: different for each geometry
};

V3f rayOrigin(RTCRayN* ray, unsigned n, unsigned i) {
    return {RTCRayN_org_x(ray, n, i), RTCRayN_org_y(ray, n, i), RTCRayN_org_z(ray, n, i)};
}
V3f rayDirection(RTCRayN* ray, unsigned n, unsigned i) {
    return {RTCRayN_dir_x(ray, n, i), RTCRayN_dir_y(ray, n, i), RTCRayN_dir_z(ray, n, i)};
}

/// Calls onHit(i, t, u, v) for those of Embree's n rays that hit the quadric.
template <class OnHit>
void intersectQuadric(const CallbackData& data, const int* valid, RTCRayN* ray, unsigned n,
                      const OnHit& onHit) {
    intersectPacket(*data.placed->shape.quadric, data.toObject, valid, reinterpret_cast<const float*>(ray), n,
                    onHit);
}

void quadricIntersect(const RTCIntersectFunctionNArguments* args) {
    const auto& data = *static_cast<const CallbackData*>(args->geometryUserPtr);
    RTCRayN* ray = RTCRayHitN_RayN(args->rayhit, args->N);
    RTCHitN* hit = RTCRayHitN_HitN(args->rayhit, args->N);
    intersectQuadric(data, args->valid, ray, args->N, [&](unsigned i, float t, float u, float v) {
        RTCRayN_tfar(ray, args->N, i) = t;
        RTCHitN_u(hit, args->N, i) = u;
        RTCHitN_v(hit, args->N, i) = v;
        RTCHitN_primID(hit, args->N, i) = args->primID;
        RTCHitN_geomID(hit, args->N, i) = args->geomID;
        RTCHitN_instID(hit, args->N, i, 0) = args->context->instID[0];
    });
}

void quadricOccluded(const RTCOccludedFunctionNArguments* args) {
    const auto& data = *static_cast<const CallbackData*>(args->geometryUserPtr);
    intersectQuadric(data, args->valid, args->ray, args->N, [&](unsigned i, float, float, float) {
        RTCRayN_tfar(args->ray, args->N, i) = -kInfinity;
    });
}

void quadricBounds(const RTCBoundsFunctionArguments* args) {
    const auto& data = *static_cast<const CallbackData*>(args->geometryUserPtr);
    const Box3f box = quadricBounds(*data.placed);
    *args->bounds_o = {box.min.x, box.min.y, box.min.z, 0, box.max.x, box.max.y, box.max.z, 0};
}

/// Rejects hits that fail the alpha test.
void alphaFilter(const RTCFilterFunctionNArguments* args) {
    const auto& data = *static_cast<const CallbackData*>(args->geometryUserPtr);
    const unsigned n = args->N;
    for (unsigned i = 0; i < n; ++i)
        if (args->valid[i] == -1 &&
            !passesAlphaTest(*data.placed->shape.mesh, data.seed, RTCHitN_primID(args->hit, n, i),
                             RTCHitN_u(args->hit, n, i), RTCHitN_v(args->hit, n, i),
                             rayOrigin(args->ray, n, i), rayDirection(args->ray, n, i)))
            args->valid[i] = 0;
}

/// Rejects hits of camera rays on the culled side, and those that fail the alpha test. The ray and the normal
/// are in the space of the group.
void cullFilter(const RTCFilterFunctionNArguments* args) {
    const auto& mesh = *static_cast<const CallbackData*>(args->geometryUserPtr)->placed->shape.mesh;
    const unsigned n = args->N;
    for (unsigned i = 0; i < n; ++i) {
        if (args->valid[i] != -1 || RTCRayN_id(args->ray, n, i) != RayPacket::kCameraId)
            continue;
        const V3f normal(RTCHitN_Ng_x(args->hit, n, i), RTCHitN_Ng_y(args->hit, n, i),
                         RTCHitN_Ng_z(args->hit, n, i)); // towards the front
        const bool isFront = dot(normal, rayDirection(args->ray, n, i)) < 0;
        if (isFront == (mesh.culledSide == TriangleMesh::Side::Front))
            args->valid[i] = 0;
    }
    if (!mesh.isOpaque())
        alphaFilter(args);
}

} // namespace

struct Tracer::Impl {
    RTCDevice device = nullptr;
    const std::vector<Group>& groups;
    std::vector<RTCScene> scenes; ///< one per group; scenes[0] also has the static instances
    /// Moving geometry and instances. A scene of their own, which only packets that intersect movingBounds
    /// traverse, so that motion costs nothing elsewhere.
    RTCScene movingScene = nullptr;
    Box3f movingBounds;
    StaticQuadrics staticQuadrics; ///< the first quadrics of group 0
    std::vector<std::unique_ptr<CallbackData>> callbackData;
    size_t geometriesOfGroup0 = 0;
    TracerCounts counts;
    std::string error;
    bool isOutOfMemory = false;
    std::mutex errorMutex;

    explicit Impl(const std::vector<Group>& groups) : groups(groups) {
        device = rtcNewDevice(
            "tessellation_cache_size=1"); // in MB; the default is 128, but nothing is tessellated
        if (!device)
            throw Error("Embree could not be started");
        rtcSetDeviceErrorFunction(
            device,
            [](void* self, RTCError code, const char* text) {
                auto& impl = *static_cast<Impl*>(self);
                const std::lock_guard lock(impl.errorMutex);
                impl.error = text;
                impl.isOutOfMemory |= code == RTC_ERROR_OUT_OF_MEMORY;
            },
            this);
    }
    ~Impl() {
        for (RTCScene scene : scenes)
            rtcReleaseScene(scene);
        if (movingScene)
            rtcReleaseScene(movingScene);
        rtcReleaseDevice(device);
    }

    RTCGeometry makeMesh(const Geometry& geometry) {
        const TriangleMesh& mesh = *geometry.placed.shape.mesh;
        RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        if (mesh.deforms()) {
            rtcSetGeometryTimeStepCount(g, unsigned(mesh.positions.size()));
            counts.timeSteps += mesh.positions.size();
        }
        for (size_t key = 0; key < mesh.positions.size(); ++key) {
            rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, unsigned(key), RTC_FORMAT_FLOAT3,
                                       mesh.positions[key].data(), 0, sizeof(V3f), mesh.vertexCount());
        }
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.indices.data(), 0,
                                   3 * sizeof(uint32_t), mesh.triangleCount());
        counts.triangles += mesh.triangleCount();
        const bool culls = mesh.culledSide != TriangleMesh::Side::None;
        if (culls || !mesh.isOpaque()) {
            rtcSetGeometryIntersectFilterFunction(g, culls ? cullFilter : alphaFilter);
            rtcSetGeometryOccludedFilterFunction(g, mesh.isOpaque() ? nullptr : alphaFilter);
            ++counts.filteredGeometries;
        }
        return g;
    }

    RTCGeometry makeQuadric() {
        RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryUserPrimitiveCount(g, 1);
        rtcSetGeometryBoundsFunction(g, quadricBounds, nullptr);
        rtcSetGeometryIntersectFunction(g, quadricIntersect);
        rtcSetGeometryOccludedFunction(g, quadricOccluded);
        ++counts.quadrics;
        return g;
    }

    static bool deforms(const Geometry& geometry) {
        return geometry.placed.shape.mesh && geometry.placed.shape.mesh->deforms();
    }

    /// Returns the scene for geometry of group 0 and for instances; creates movingScene at its first use.
    RTCScene topLevelScene(bool moves) {
        if (!moves)
            return scenes[0];
        if (!movingScene)
            movingScene = rtcNewScene(device);
        return movingScene;
    }

    void addGroup(const Group& group) {
        const bool isGroup0 = scenes.empty();
        scenes.push_back(rtcNewScene(device));
        unsigned id = 0;
        for (const Geometry& geometry : group.geometries) {
            if (isGroup0 && geometry.placed.shape.quadric && !staticQuadrics.isFull()) {
                staticQuadrics.add(geometry, id++);
                ++counts.quadrics;
                continue;
            }
            callbackData.push_back(std::make_unique<CallbackData>(CallbackData{
                &geometry.placed, geometry.placed.toParent.inverse(), uint32_t(callbackData.size())}));
            RTCGeometry g = geometry.placed.shape.mesh ? makeMesh(geometry) : makeQuadric();
            rtcSetGeometryUserData(g, callbackData.back().get());
            attach(isGroup0 ? topLevelScene(deforms(geometry)) : scenes.back(), g, id++);
        }
        if (isGroup0)
            geometriesOfGroup0 = group.geometries.size();
    }

    void addInstance(const Instance& instance, unsigned id) {
        RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(g, scenes[instance.group]);
        const Motion& motion = *instance.motion;
        if (!motion.isStatic()) {
            rtcSetGeometryTimeStepCount(g, unsigned(motion.keyCount()));
            counts.timeSteps += motion.keyCount();
        }
        for (int i = 0; i < motion.keyCount(); ++i) {
            if (motion.usesRotation())
                setQuaternionKey(g, i, motion.quaternionKey(i));
            else
                rtcSetGeometryTransform(g, unsigned(i), RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR,
                                        motion.matrixKey(i).getValue());
        }
        attach(topLevelScene(!motion.isStatic()), g, id);
        ++counts.instances;
    }

    static void setQuaternionKey(RTCGeometry g, int key, const Decomposed& d) {
        RTCQuaternionDecomposition q;
        rtcInitQuaternionDecomposition(&q);
        q.scale_x = d.stretch[0][0];
        q.scale_y = d.stretch[1][1];
        q.scale_z = d.stretch[2][2];
        q.skew_xy = d.stretch[1][0];
        q.skew_xz = d.stretch[2][0];
        q.skew_yz = d.stretch[2][1];
        q.quaternion_r = d.rotation.r;
        q.quaternion_i = d.rotation.v.x;
        q.quaternion_j = d.rotation.v.y;
        q.quaternion_k = d.rotation.v.z;
        q.translation_x = d.translation.x;
        q.translation_y = d.translation.y;
        q.translation_z = d.translation.z;
        rtcSetGeometryTransformQuaternion(g, unsigned(key), &q);
    }

    static void attach(RTCScene scene, RTCGeometry g, unsigned id) {
        rtcCommitGeometry(g);
        rtcAttachGeometryByID(scene, g, id);
        rtcReleaseGeometry(g);
    }

    static Box3f boundsOf(RTCScene scene) {
        RTCBounds b;
        rtcGetSceneBounds(scene, &b);
        return {{b.lower_x, b.lower_y, b.lower_z}, {b.upper_x, b.upper_y, b.upper_z}};
    }

    void throwOnError() const {
        if (isOutOfMemory)
            throw std::bad_alloc();
        if (!error.empty())
            throw Error("Embree: " + error);
    }
};

Tracer::Tracer(const std::vector<Group>& groups, const std::vector<Instance>& instances)
    : m_impl(std::make_unique<Impl>(groups)) {
    for (const Group& group : groups)
        m_impl->addGroup(group);
    for (size_t i = 1; i < m_impl->scenes.size(); ++i)
        rtcCommitScene(m_impl->scenes[i]);
    m_firstInstance = uint32_t(m_impl->geometriesOfGroup0);
    for (size_t i = 0; i < instances.size(); ++i)
        m_impl->addInstance(instances[i], unsigned(m_impl->geometriesOfGroup0 + i));
    rtcCommitScene(m_impl->scenes[0]);
    if (m_impl->movingScene) {
        rtcCommitScene(m_impl->movingScene);
        const Box3f box = Impl::boundsOf(m_impl->movingScene);
        const V3f margin(1e-5f * length(box.max - box.min)); // so that no geometry lies in a face of the box
        m_impl->movingBounds = {box.min - margin, box.max + margin};
    }
    m_impl->throwOnError();
}

Tracer::~Tracer() = default;

namespace {

#if RTC_VERSION_MAJOR >= 4
void intersectScene(RTCScene scene, const PacketMask& mask, RayPacket& packet, bool coherent) {
    RTCIntersectArguments args;
    rtcInitIntersectArguments(&args);
    args.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    rtcIntersect16(mask.active, scene, reinterpret_cast<RTCRayHit16*>(&packet), &args);
}
void occludedScene(RTCScene scene, const PacketMask& mask, RayPacket& packet) {
    RTCOccludedArguments args;
    rtcInitOccludedArguments(&args);
    rtcOccluded16(mask.active, scene, reinterpret_cast<RTCRay16*>(&packet), &args);
}
#else
void intersectScene(RTCScene scene, const PacketMask& mask, RayPacket& packet, bool coherent) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    rtcIntersect16(mask.active, scene, &context, reinterpret_cast<RTCRayHit16*>(&packet));
}
void occludedScene(RTCScene scene, const PacketMask& mask, RayPacket& packet) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded16(mask.active, scene, &context, reinterpret_cast<RTCRay16*>(&packet));
}
#endif

} // namespace

void Tracer::intersect(RayPacket& packet, int n, bool coherent) const {
    if (m_observer)
        m_observer(packet, n, coherent ? Query::Coherent : Query::Nearest);
    PacketMask mask(n);
    intersectScene(m_impl->scenes[0], mask, packet, coherent);
    // Never with the coherent flag: Embree 3.13's coherent traversal rounds differently for moving instances,
    // so that hits would depend on the other rays of the packet.
    if (m_impl->movingScene && mask.keepIntersecting(packet, m_impl->movingBounds))
        intersectScene(m_impl->movingScene, mask, packet, false);
    m_impl->staticQuadrics.intersect(packet, PacketMask(n));
}

void Tracer::occluded(RayPacket& packet, int n) const {
    if (m_observer)
        m_observer(packet, n, Query::Occluded);
    PacketMask mask(n);
    occludedScene(m_impl->scenes[0], mask, packet);
    if (m_impl->movingScene && mask.keepIntersecting(packet, m_impl->movingBounds))
        occludedScene(m_impl->movingScene, mask, packet);
    m_impl->staticQuadrics.occluded(packet, PacketMask(n));
}

namespace {

struct PointQueryData {
    uint32_t geometry;
    const Tracer::PointQueryVisitor& visit;
};

/// Embree's point query callback. Returns whether the radius of the query has changed.
bool visitPrimitive(RTCPointQueryFunctionArguments* args) {
    const auto& data = *static_cast<const PointQueryData*>(args->userPtr);
    if (args->context->instStackSize > 0 || args->geomID != data.geometry)
        return false;
    const float oldRadius = std::exchange(args->query->radius, data.visit(args->primID));
    return args->query->radius < oldRadius;
}

} // namespace

void Tracer::pointQuery(uint32_t group, uint32_t geometry, const V3f& p, float radius,
                        const PointQueryVisitor& visit) const {
    const bool isMoving = group == 0 && Impl::deforms(m_impl->groups[0].geometries[geometry]);
    PointQueryData data{geometry, visit};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    RTCPointQuery query{p.x, p.y, p.z, 0, radius};
    rtcPointQuery(isMoving ? m_impl->movingScene : m_impl->scenes[group], &query, &context, visitPrimitive,
                  &data);
}

Box3f Tracer::bounds() const {
    Box3f box = Impl::boundsOf(m_impl->scenes[0]);
    if (m_impl->movingScene)
        box.extendBy(m_impl->movingBounds);
    m_impl->staticQuadrics.extend(box);
    return box;
}

const TracerCounts& Tracer::counts() const { return m_impl->counts; }

} // namespace strobe
