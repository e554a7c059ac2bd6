#include "bench/embree_scene.h"

#include "core/util/error.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <Imath/ImathMatrixAlgo.h>

namespace strobe::bench {

namespace {

/// The user data of a quadric for Embree's callbacks.
struct QuadricData {
    const PlacedShape* placed;
    M44f toObject;
};

/// Calls onHit(i, t, u, v) for each of Embree's n rays that hits the quadric.
template <class OnHit>
void intersectQuadric(const void* user, const int* valid, RTCRayN* ray, unsigned n, const OnHit& onHit) {
    const auto& data = *static_cast<const QuadricData*>(user);
    intersectPacket(*data.placed->shape.quadric, data.toObject, valid, reinterpret_cast<const float*>(ray), n,
                    onHit);
}

void intersectQuadrics(const RTCIntersectFunctionNArguments* args) {
    RTCRayN* ray = RTCRayHitN_RayN(args->rayhit, args->N);
    RTCHitN* hit = RTCRayHitN_HitN(args->rayhit, args->N);
    intersectQuadric(args->geometryUserPtr, args->valid, ray, args->N,
                     [&](unsigned i, float t, float u, float v) {
                         RTCRayN_tfar(ray, args->N, i) = t;
                         RTCHitN_u(hit, args->N, i) = u;
                         RTCHitN_v(hit, args->N, i) = v;
                         RTCHitN_primID(hit, args->N, i) = args->primID;
                         RTCHitN_geomID(hit, args->N, i) = args->geomID;
                         RTCHitN_instID(hit, args->N, i, 0) = args->context->instID[0];
                     });
}

void occludeQuadric(const RTCOccludedFunctionNArguments* args) {
    intersectQuadric(
        args->geometryUserPtr, args->valid, args->ray, args->N,
        [&](unsigned i, float, float, float) { RTCRayN_tfar(args->ray, args->N, i) = -kInfinity; });
}

void boundQuadric(const RTCBoundsFunctionArguments* args) {
    const PlacedShape& placed = *static_cast<const QuadricData*>(args->geometryUserPtr)->placed;
    const Box3f box = placed.shape.quadric->bounds();
    Box3f out;
    for (int i = 0; i < 8; ++i)
        out.extendBy(
            transformPoint(placed.toParent, {(i & 1 ? box.max : box.min).x, (i & 2 ? box.max : box.min).y,
                                             (i & 4 ? box.max : box.min).z}));
    *args->bounds_o = {out.min.x, out.min.y, out.min.z, 0, out.max.x, out.max.y, out.max.z, 0};
}

/// Returns the time of a key as a fraction of the shutter.
float keyTime(int key, int keys) { return keys > 1 ? float(key) / float(keys - 1) : 0.5f; }

/// Decomposes a matrix for row vectors into an upper triangular matrix, a rotation and a translation, in the
/// order of application, by Gram-Schmidt orthogonalization of the rows.
RTCQuaternionDecomposition quaternionOf(const M44f& m) {
    const V3f a(m[0][0], m[0][1], m[0][2]), b(m[1][0], m[1][1], m[1][2]), c(m[2][0], m[2][1], m[2][2]);
    const V3f x = normalize(a), y = normalize(b - x * dot(x, b));
    const V3f z = cross(x, y); // scale_z contains a reflection
    RTCQuaternionDecomposition q;
    rtcInitQuaternionDecomposition(&q);
    q.scale_x = dot(x, a);
    q.scale_y = dot(y, b);
    q.scale_z = dot(z, c);
    q.skew_xy = dot(x, b);
    q.skew_xz = dot(x, c);
    q.skew_yz = dot(y, c);
    const M44f rotation(x.x, x.y, x.z, 0, y.x, y.y, y.z, 0, z.x, z.y, z.z, 0, 0, 0, 0, 1);
    const Quatf r = Imath::extractQuat(rotation);
    rtcQuaternionDecompositionSetQuaternion(&q, r.r, r.v.x, r.v.y, r.v.z);
    rtcQuaternionDecompositionSetTranslation(&q, m[3][0], m[3][1], m[3][2]);
    return q;
}

/// Embree's valid mask of lanes 0 … n-1.
struct alignas(64) Mask {
    int valid[16];
    explicit Mask(int n) {
        for (int i = 0; i < 16; ++i)
            valid[i] = i < n ? -1 : 0;
    }
};

} // namespace

struct EmbreeScene::Impl {
    RTCDevice device = rtcNewDevice(nullptr);
    std::vector<RTCScene> scenes; ///< [0] is the world
    std::vector<std::unique_ptr<QuadricData>> quadrics;
    std::vector<std::vector<V3f>> baked; ///< vertex arrays in world space
    bool movingInstances = false;

    ~Impl() {
        for (RTCScene scene : scenes)
            rtcReleaseScene(scene);
        rtcReleaseDevice(device);
    }

    RTCGeometry meshGeometry(const TriangleMesh& mesh, const std::vector<const std::vector<V3f>*>& keys) {
        if (mesh.alpha.texture || mesh.alpha.constant < 1)
            throw Error("the benchmark does not support alpha masks");
        RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        if (keys.size() > 1)
            rtcSetGeometryTimeStepCount(g, unsigned(keys.size()));
        for (size_t i = 0; i < keys.size(); ++i)
            rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, unsigned(i), RTC_FORMAT_FLOAT3,
                                       keys[i]->data(), 0, sizeof(V3f), keys[i]->size());
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.indices.data(), 0,
                                   3 * sizeof(uint32_t), mesh.triangleCount());
        return g;
    }

    RTCGeometry quadricGeometry(const PlacedShape& placed) {
        quadrics.push_back(std::make_unique<QuadricData>(QuadricData{&placed, placed.toParent.inverse()}));
        RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryUserPrimitiveCount(g, 1);
        rtcSetGeometryUserData(g, quadrics.back().get());
        rtcSetGeometryBoundsFunction(g, boundQuadric, nullptr);
        rtcSetGeometryIntersectFunction(g, intersectQuadrics);
        rtcSetGeometryOccludedFunction(g, occludeQuadric);
        return g;
    }

    static void attach(RTCScene scene, RTCGeometry g) {
        rtcCommitGeometry(g);
        rtcAttachGeometry(scene, g);
        rtcReleaseGeometry(g);
    }

    void addGroup(const Group& group) {
        scenes.push_back(rtcNewScene(device));
        for (const Geometry& geometry : group.geometries) {
            const PlacedShape& placed = geometry.placed;
            if (!placed.shape.mesh) {
                attach(scenes.back(), quadricGeometry(placed));
                continue;
            }
            std::vector<const std::vector<V3f>*> keys;
            for (const auto& key : placed.shape.mesh->positions)
                keys.push_back(&key);
            attach(scenes.back(), meshGeometry(*placed.shape.mesh, keys));
        }
    }

    void bake(const Group& group, const Motion& motion, int keyCount) {
        for (const Geometry& geometry : group.geometries) {
            const TriangleMesh* mesh = geometry.placed.shape.mesh.get();
            if (!mesh || mesh->deforms())
                throw Error("the benchmark can only bake triangle meshes with rigid motion");
            std::vector<const std::vector<V3f>*> keys;
            for (int i = 0; i < keyCount; ++i) {
                const M44f m = motion.at(keyTime(i, keyCount));
                std::vector<V3f> vertices;
                vertices.reserve(mesh->vertexCount() + 2); // Embree reads sixteen bytes at each vertex
                for (const V3f& p : mesh->positions[0])
                    vertices.push_back(transformPoint(m, p));
                baked.push_back(std::move(vertices));
            }
            for (int i = keyCount; i > 0; --i)
                keys.push_back(&baked[baked.size() - size_t(i)]);
            attach(scenes[0], meshGeometry(*mesh, keys));
        }
    }

    void addInstance(const Instance& instance, const MotionChoice& choice) {
        const Motion& motion = *instance.motion;
        const bool asRendered = choice.style == MotionStyle::AsRendered || motion.isStatic();
        const int keys = asRendered ? motion.keyCount() : choice.keys;
        RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(g, scenes[instance.group]);
        if (keys > 1) {
            rtcSetGeometryTimeStepCount(g, unsigned(keys));
            movingInstances = true;
        }
        const bool rotates = choice.style == MotionStyle::Quaternion || (asRendered && motion.usesRotation());
        for (int i = 0; i < keys; ++i) {
            const M44f m = motion.at(keyTime(i, keys));
            if (rotates && keys > 1) {
                const RTCQuaternionDecomposition q = quaternionOf(m);
                rtcSetGeometryTransformQuaternion(g, unsigned(i), &q);
            } else {
                rtcSetGeometryTransform(g, unsigned(i), RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR, m.getValue());
            }
        }
        attach(scenes[0], g);
    }
};

EmbreeScene::EmbreeScene(const Scene& scene, const MotionChoice& choice) : m_impl(std::make_unique<Impl>()) {
    Impl& impl = *m_impl;
    size_t arrays = 0;
    for (const Instance& instance : scene.instances())
        arrays += scene.groups()[instance.group].geometries.size() * size_t(choice.keys);
    impl.baked.reserve(arrays); // Embree keeps pointers to the elements
    for (const Group& group : scene.groups())
        impl.addGroup(group);
    for (size_t i = 1; i < impl.scenes.size(); ++i)
        rtcCommitScene(impl.scenes[i]);
    for (const Instance& instance : scene.instances()) {
        if (choice.style == MotionStyle::Baked)
            impl.bake(scene.groups()[instance.group], *instance.motion,
                      instance.motion->isStatic() ? 1 : choice.keys);
        else
            impl.addInstance(instance, choice);
    }
    rtcCommitScene(impl.scenes[0]);
    if (rtcGetDeviceError(impl.device) != RTC_ERROR_NONE)
        throw Error("Embree failed to build the scene");
}

EmbreeScene::~EmbreeScene() = default;

bool EmbreeScene::movingInstances() const { return m_impl->movingInstances; }

void EmbreeScene::intersect(RayPacket& packet, int n, bool coherent) const {
    const Mask mask(n);
    auto* rays = reinterpret_cast<RTCRayHit16*>(&packet);
#if RTC_VERSION_MAJOR >= 4
    RTCIntersectArguments args;
    rtcInitIntersectArguments(&args);
    args.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    rtcIntersect16(mask.valid, m_impl->scenes[0], rays, &args);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    rtcIntersect16(mask.valid, m_impl->scenes[0], &context, rays);
#endif
}

void EmbreeScene::intersectSingly(RayPacket& packet, int n) const {
    auto* rays = reinterpret_cast<RTCRayHitN*>(&packet);
    for (int i = 0; i < n; ++i) {
        RTCRayHit ray = rtcGetRayHitFromRayHitN(rays, RayPacket::kSize, unsigned(i));
#if RTC_VERSION_MAJOR >= 4
        rtcIntersect1(m_impl->scenes[0], &ray);
#else
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        rtcIntersect1(m_impl->scenes[0], &context, &ray);
#endif
        rtcCopyHitToHitN(RTCRayHitN_HitN(rays, RayPacket::kSize), &ray.hit, RayPacket::kSize, unsigned(i));
        packet.tfar[i] = ray.ray.tfar;
    }
}

bool EmbreeScene::intersectStream(std::span<RayPacket> packets) const {
#if RTC_VERSION_MAJOR >= 4
    static_cast<void>(packets);
    return false;
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersectNM(m_impl->scenes[0], &context, reinterpret_cast<RTCRayHitN*>(packets.data()),
                   RayPacket::kSize, unsigned(packets.size()), sizeof(RayPacket));
    return true;
#endif
}

void EmbreeScene::occluded(RayPacket& packet, int n) const {
    const Mask mask(n);
    auto* rays = reinterpret_cast<RTCRay16*>(&packet);
#if RTC_VERSION_MAJOR >= 4
    RTCOccludedArguments args;
    rtcInitOccludedArguments(&args);
    rtcOccluded16(mask.valid, m_impl->scenes[0], rays, &args);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded16(mask.valid, m_impl->scenes[0], &context, rays);
#endif
}

} // namespace strobe::bench
