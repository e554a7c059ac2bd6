#include "lights/emission.h"

#include "lights/placement.h"

namespace strobe {

BoundingSphere objectSphere(const Shape& shape) {
    if (shape.quadric) {
        const Box3f box = shape.quadric->bounds();
        const float sphereRadius = shape.quadric->wholeSphereRadius();
        const V3f center = (box.min + box.max) * .5f;
        return {center, sphereRadius > 0 ? sphereRadius : length(box.max - center)};
    }
    const TriangleMesh& mesh = *shape.mesh; // unused vertices do not count
    Box3f box;
    for (const std::vector<V3f>& key : mesh.positions)
        for (const uint32_t i : mesh.indices)
            box.extendBy(key[i]);
    if (box.isEmpty())
        return {};
    const V3f center = (box.min + box.max) * .5f;
    float radius2 = 0;
    for (const std::vector<V3f>& key : mesh.positions)
        for (const uint32_t i : mesh.indices)
            radius2 = std::max(radius2, length2(key[i] - center));
    return {center, std::sqrt(radius2)};
}

BoundingSphere transformSphere(const M44f& m, const BoundingSphere& sphere) {
    // The largest squared scale is the spectral norm of M Mᵀ, which is at most its largest absolute row sum,
    // with equality for rotations with uniform scale.
    float scale2 = 0;
    const V3f rows[3] = {
        {m[0][0], m[0][1], m[0][2]}, {m[1][0], m[1][1], m[1][2]}, {m[2][0], m[2][1], m[2][2]}};
    for (const V3f& a : rows)
        scale2 = std::max(scale2, absDot(a, rows[0]) + absDot(a, rows[1]) + absDot(a, rows[2]));
    const V3f center = transformPoint(m, sphere.center);
    const float rounding =
        1e-6f * std::max(std::abs(center.x), std::max(std::abs(center.y), std::abs(center.z)));
    return {center, sphere.radius * std::sqrt(scale2) * (1 + 1e-5f) + rounding};
}

bool mayIntersectSphere(const BoundingSphere& sphere, const V3f& p, const V3f& wi) {
    const V3f toCenter = sphere.center - p;
    const float d2 = length2(toCenter), r2 = sqr(sphere.radius) + 1e-6f * d2;
    if (d2 <= r2)
        return true;
    return dot(toCenter, wi) > 0 && length2(cross(toCenter, wi)) <= r2;
}

SurfaceLight::SurfaceLight(PlacedShape shape, const Emission& emission)
    : m_shape(std::move(shape)), m_emission(emission),
      m_isStatic(!m_shape.motion || m_shape.motion->isStatic()), m_staticToWorld(m_shape.toWorld(0)),
      m_objectBounds(objectSphere(m_shape.shape)),
      m_staticBounds(transformSphere(m_staticToWorld, m_objectBounds)) {}

std::optional<EmitterBounds> SurfaceLight::emitterBounds(uint32_t, float begin, float end) const {
    EmitterBounds result;
    bool isFlat = true;
    const auto poseAt = [&](float time) {
        const BoundingSphere sphere = bounds(time);
        const V3f normal = normalizeAny(normalAt(time));
        isFlat &= normal != V3f(0);
        return EmitterPose{sphere.center, sphere.radius, normal, 0};
    };
    boundPoses(posesOf(m_isStatic ? 1 : m_shape.motion->keyCount(), begin, end, poseAt), result);
    if (!isFlat)
        result.spread = kPi;
    result.isTwoSided = isFlat && m_emission.twoSided;
    // A flat surface of flux Φ has the intensity Φ/π along the normal of its only side, a sphere Φ/(4π).
    result.intensity =
        rootMeanSquare(power(0)) / (isFlat ? kPi * (m_emission.twoSided ? 2.f : 1.f) : 4 * kPi);
    return result;
}

} // namespace strobe
