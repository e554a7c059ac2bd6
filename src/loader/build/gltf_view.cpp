#include "loader/build/gltf_view.h"

namespace strobe {
namespace {

/// The bounds of points on one axis of an image. A camera at position c and depth -d sees a point (x, z) if
/// |x - c| <= t (z + d), where t is the tangent of half its angle.
struct AxisBounds {
    float t, least = kInfinity, greatest = -kInfinity; ///< of x + t z, and of x - t z

    void add(float x, float z) {
        least = std::min(least, x + t * z);
        greatest = std::max(greatest, x - t * z);
    }
    float center() const { return (least + greatest) / 2; }
    float distance() const { return (greatest - least) / (2 * t); }
};

} // namespace

KeyedTransform viewOf(const std::vector<V3f>& points, const V2f& halfView) {
    constexpr float kMargin = .94f;               // of the image
    const V3f back = normalize(V3f(.5f, .4f, 1)); // from the objects to the camera
    const V3f right = normalize(cross(V3f(0, 1, 0), back)), up = cross(back, right);
    std::vector<V3f> seen = points;
    if (seen.empty())
        seen = {V3f(-1), V3f(1)};
    AxisBounds x{halfView.x * kMargin}, y{halfView.y * kMargin};
    float nearest = kInfinity, farthest = -kInfinity;
    for (const V3f& p : seen) {
        const float depth = -dot(p, back);
        x.add(dot(p, right), depth);
        y.add(dot(p, up), depth);
        nearest = std::min(nearest, depth);
        farthest = std::max(farthest, depth);
    }
    // A flat scene seen from its edge, or a single point, needs some distance.
    const float least = std::max(1e-3f * std::max(std::abs(nearest), std::abs(farthest)), 1e-6f);
    const float distance = std::max({x.distance(), y.distance(), least - nearest});
    const V3f eye = right * x.center() + up * y.center() + back * distance;
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
