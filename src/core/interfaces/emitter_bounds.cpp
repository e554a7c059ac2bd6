#include "core/interfaces/emitter_bounds.h"

namespace strobe {

namespace {

/// Returns a bound of how far the centers leave the line segments between neighboring poses. A smooth curve
/// leaves them by an eighth of the second difference, a curve with a kink by at most half of it.
float deviationBetween(std::span<const EmitterPose> poses) {
    float deviation = 0;
    for (size_t i = 1; i + 1 < poses.size(); ++i)
        deviation =
            std::max(deviation, length(poses[i - 1].center + poses[i + 1].center - poses[i].center * 2) / 2);
    return deviation;
}

void boundSpheres(std::span<const EmitterPose> poses, EmitterBounds& bounds) {
    bounds.begin = poses.front().center;
    bounds.end = poses.back().center;
    bounds.radius = 0;
    const float last = float(std::max<size_t>(poses.size() - 1, 1));
    for (size_t i = 0; i < poses.size(); ++i) {
        const V3f center = lerp(bounds.begin, bounds.end, float(i) / last);
        bounds.radius = std::max(bounds.radius, length(poses[i].center - center) + poses[i].radius);
    }
    bounds.radius += deviationBetween(poses);
}

void boundNormals(std::span<const EmitterPose> poses, EmitterBounds& bounds) {
    V3f sum(0);
    for (const EmitterPose& pose : poses)
        sum += pose.axis;
    const bool hasMean = length2(sum) > 1e-6f;
    bounds.axis = hasMean ? normalize(sum) : V3f(0, 0, 1);
    bounds.spread = hasMean ? 0 : kPi;
    float step = 0;
    for (size_t i = 0; i < poses.size(); ++i) {
        bounds.spread = std::max(bounds.spread, angleBetween(poses[i].axis, bounds.axis) + poses[i].spread);
        if (i > 0)
            step = std::max(step, angleBetween(poses[i].axis, poses[i - 1].axis));
    }
    bounds.spread = std::min(bounds.spread + step / 2, kPi);
}

} // namespace

void boundPoses(std::span<const EmitterPose> poses, EmitterBounds& bounds) {
    boundSpheres(poses, bounds);
    boundNormals(poses, bounds);
}

} // namespace strobe
