#include "core/image/mip_footprints.h"

namespace strobe {
namespace {

constexpr float kMaxAspect = 32;  ///< maximum ratio of the axes of an ellipse
constexpr float kMaxMajor = 1000; ///< maximum length of the major axis, in repetitions of the image

/// The lengths of the axes of the ellipse that two derivatives span, and the direction of the major axis.
struct EllipseAxes {
    float major, minor;
    V2f direction;

    STROBE_FORCE_INLINE EllipseAxes(const V2f& dx, const V2f& dy) {
        const float s2 = sqr(dx.x) + sqr(dy.x), t2 = sqr(dx.y) + sqr(dy.y), st = dx.x * dx.y + dy.x * dy.y;
        const float difference = s2 - t2;
        const float root = std::sqrt(sqr(difference) + 4 * sqr(st));
        major = std::sqrt((s2 + t2 + root) / 2);
        // Computed from the area, without cancellation.
        const float width = std::abs(dx.x * dy.y - dx.y * dy.x) / major;
        minor = major > 0 ? width : 0.f;
        // Of the two expressions of the eigenvector, uses the one whose terms have equal signs.
        const float sum = root + std::abs(difference);
        const float other = 2 * std::abs(st);
        const float inverse = 1 / std::sqrt(2 * root * sum);
        const float scale = root > 0 ? inverse : 0.f;
        const float x = (difference < 0 ? other : sum) * scale;
        const float y = (difference < 0 ? sum : other) * scale;
        direction = {root > 0 ? x : 1.f, std::copysign(y, st)};
    }
    /// Limits the aspect ratio to kMaxAspect: reduces the excess length of the major axis by half, and widens
    /// the minor axis. Returns the resulting aspect ratio.
    STROBE_FORCE_INLINE float limitAspect() {
        const float aspect = major / minor;
        const float mean = (major + minor * kMaxAspect) / 2;
        const int32_t fits = major <= minor * kMaxAspect ? 1 : 0;
        const float widened = mean / kMaxAspect;
        major = fits ? major : mean;
        minor = fits ? minor : widened;
        return fits ? aspect : kMaxAspect;
    }
};

} // namespace

STROBE_TARGET_CLONES void MipFootprints::measure(const TexturePointSoA& points, int begin, int end,
                                                 float side, int32_t* isDone, MipFootprints& f) {
    // Texel coordinates must fit an int, also at the end of the longest ellipse.
    const float maxCoordinate = 0x1p30f / side - kMaxMajor;
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        EllipseAxes axes(points.duvdx.at(i), points.duvdy.at(i));
        const int32_t isSubTexel = axes.major * side < .5f ? 1 : 0;
        const int32_t isShort = axes.major < kMaxMajor ? 1 : 0;
        const int32_t isNear = (std::abs(points.uv.x[i]) < maxCoordinate ? 1 : 0) &
                               (std::abs(points.uv.y[i]) < maxCoordinate ? 1 : 0);
        isDone[i] = isNear & (isSubTexel | isShort);
        f.isSubTexel[i] = isSubTexel;
        f.aspect[i] = axes.limitAspect();
        f.major[i] = axes.major;
        f.minor[i] = axes.minor;
        f.direction.x[i] = axes.direction.x;
        f.direction.y[i] = axes.direction.y;
        f.level[i] = 0;
        f.isWider[i] = 1;
    }
}

STROBE_TARGET_CLONES void MipFootprints::findLevels(const float* shorterSide, int levels, int begin, int end,
                                                    MipFootprints& f) {
    for (int level = 0; level < levels; ++level) {
        const float side = shorterSide[level];
        STROBE_IVDEP
        for (int i = begin; i < end; ++i) {
            f.isWider[i] &= f.minor[i] * side > 1 ? 1 : 0;
            f.level[i] += f.isWider[i];
        }
        if (end - begin == 1 && !f.isWider[begin])
            return;
    }
}

STROBE_TARGET_CLONES void MipFootprints::findProbes(const float* shorterSide, int levels, float side,
                                                    int begin, int end, MipFootprints& f) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const int32_t level = f.level[i];
        const int32_t isSubTexel = f.isSubTexel[i];
        const float major = f.major[i], minor = f.minor[i];
        const float length = major - minor;
        // In the finest level, an ellipse counts as at least half a texel wide.
        const int32_t isThin = (level == 0 ? 1 : 0) & (minor * side < .5f ? 1 : 0);
        const float thinAspect = std::max(1.f, major * side * 2);
        const float aspect = isThin ? thinAspect : f.aspect[i];
        const float clampedCount = std::min(std::max(1.f, 2 * aspect - 1), float(kMaxProbes));
        const int32_t probeCount = int32_t(clampedCount);
        const int32_t probes = isSubTexel ? 1 : probeCount;
        const float steepness = -2 * sqr(major / std::max(2 * length, 1e-20f));
        f.probes[i] = probes;
        f.steepness[i] = probes <= 2 ? 0.f : steepness;
        const float x = f.direction.x[i] * length;
        const float y = f.direction.y[i] * length;
        f.half.x[i] = isSubTexel ? 0.f : x;
        f.half.y[i] = isSubTexel ? 0.f : y;
        const int32_t isBetween = (level > 0 ? 1 : 0) & (level < levels ? 1 : 0) & (isSubTexel ^ 1);
        const float coarserSide = shorterSide[std::min(level, levels - 1)];
        const float blend = std::min(std::max(2 * minor * coarserSide - 1, 0.f), 1.f);
        f.blend[i] = isBetween ? blend : 0.f;
        const int32_t finer = std::max(level - 1, 0);
        f.finer[i] = isSubTexel ? 0 : finer;
    }
}

} // namespace strobe
