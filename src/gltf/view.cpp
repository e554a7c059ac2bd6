#include "gltf/view.h"

namespace strobe {
KeyedTransform viewOf(const std::vector<V3f>& points, const V2f& halfView) {
    constexpr float kMargin = .92f;               // of the image
    const V3f back = normalize(V3f(.5f, .4f, 1)); // from the objects to the camera
    const V3f right = normalize(cross(V3f(0, 1, 0), back)), up = cross(back, right);
    Box3f box;
    for (const V3f& p : points)
        box.extendBy(p);
    if (points.empty())
        box = Box3f(V3f(-1), V3f(1));
    const V3f center = box.center();
    // A point at (x, y, z) from the center, z away from the camera, is seen if |x| <= t (z + distance).
    float distance = 0, size = 0;
    const auto include = [&](const V3f& p) {
        const V3f d = p - center;
        const float z = -dot(d, back);
        distance = std::max({distance, std::abs(dot(d, right)) / (halfView.x * kMargin) - z,
                             std::abs(dot(d, up)) / (halfView.y * kMargin) - z});
        size = std::max(size, length(d));
    };
    for (const V3f& p : points.empty() ? std::vector<V3f>{box.min, box.max} : points)
        include(p);
    // A flat scene seen from its edge, or a single point, needs some distance.
    distance = std::max(distance, size > 0 ? 1.1f * size : 1);
    const V3f eye = center + back * distance;
    // strobe's cameras look along +z, with +x to the right.
    const V3f ahead = -back;
    return KeyedTransform(M44f(right.x, right.y, right.z, 0, up.x, up.y, up.z, 0, ahead.x, ahead.y, ahead.z,
                               0, eye.x, eye.y, eye.z, 1));
}

float lowestPoint(const std::vector<V3f>& points) {
    float lowest = points.empty() ? 0 : kInfinity;
    for (const V3f& p : points)
        lowest = std::min(lowest, p.y);
    return lowest;
}

float extentOf(const std::vector<V3f>& points) {
    Box3f box;
    for (const V3f& p : points)
        box.extendBy(p);
    if (points.empty())
        return 0;
    const V3f size = box.size();
    return std::max({size.x, size.y, size.z});
}

} // namespace strobe
