#include "core/image/mip_map.h"

#include "core/math/fast_math.h"
#include "core/math/simd4.h"

#include <utility>

namespace strobe {

namespace {

constexpr float kMaxAspect = 32;         ///< maximum ratio of the axes of an ellipse
constexpr int kMaxProbes = 64;           ///< maximum number of probes along an ellipse
constexpr float kMaxMajor = 1000;        ///< maximum length of the major axis, in repetitions of the image
constexpr int kMaxLines = 2 * kSoAWidth; ///< each lookup needs at most two levels
static_assert(2 * kMaxProbes <= kMaxLines);

/// The two texels along one axis that a position lies between.
struct AxisTap {
    int first, second;
    float x; ///< weight of the second texel, in [0,1)
};

STROBE_FORCE_INLINE int floorToInt(float x) {
    const int towardsZero = int(x);
    return towardsZero - int(float(towardsZero) > x);
}

/// Returns the texels at coordinate u of an axis with n texels. To wrap, `repeatMask` has all bits set and
/// `period` is 1; to clamp, both are 0.
STROBE_FORCE_INLINE AxisTap axisTap(float u, int n, int32_t repeatMask, float period) {
    const int beforeFirst = (n - 1) & repeatMask;
    const int afterLast = n - 1 - beforeFirst;
    const float x = (u - period * float(floorToInt(u))) * float(n) - .5f;
    const int left = floorToInt(x);
    const int right = left + 1;
    const int leftInside = std::min(left, n - 1);
    const int rightInside = std::max(right, 0);
    return {left < 0 ? beforeFirst : leftInside, right < n ? rightInside : afterLast, x - float(left)};
}

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

/// The ellipses of lookups, and their levels and probes.
struct MipMap::Footprints {
    alignas(64) float major[kSoAWidth], minor[kSoAWidth], aspect[kSoAWidth]; ///< after limitAspect
    V2SoA direction;
    alignas(64) int32_t
        isSubTexel[kSoAWidth]; ///< the ellipse is shorter than half a texel of the finest level
    /// The finest level where the ellipse is no wider than a texel. It is blended with the next finer level.
    alignas(64) int32_t level[kSoAWidth];
    alignas(64) int32_t isWider[kSoAWidth]; ///< the ellipse is wider than a texel in all levels tested so far
    V2SoA half;                             ///< the probes extend from uv - half to uv + half
    alignas(64) int32_t probes[kSoAWidth];  ///< number of probes
    alignas(64) int32_t finer[kSoAWidth];   ///< the finer one of the two levels
    alignas(64) float steepness[kSoAWidth]; ///< probes have weights exp(steepness x²), for x in [-1,1] along
                                            ///< the line
    alignas(64) float blend[kSoAWidth];     ///< weight of the coarser level

    static void measure(const TexturePointSoA& points, int begin, int end, float side, int32_t* isDone,
                        Footprints& f);
    static void findLevels(const float* shorterSide, int levels, int begin, int end, Footprints& f);
    static void findProbes(const float* shorterSide, int levels, float side, int begin, int end,
                           Footprints& f);
};

/// Computes the ellipses, and sets isDone to 0 where they or the coordinates are too large. `side` is the
/// longer side of the finest level in texels.
STROBE_TARGET_CLONES void MipMap::Footprints::measure(const TexturePointSoA& points, int begin, int end,
                                                      float side, int32_t* isDone, Footprints& f) {
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

STROBE_TARGET_CLONES void MipMap::Footprints::findLevels(const float* shorterSide, int levels, int begin,
                                                         int end, Footprints& f) {
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

STROBE_TARGET_CLONES void MipMap::Footprints::findProbes(const float* shorterSide, int levels, float side,
                                                         int begin, int end, Footprints& f) {
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

/// Lines of probes. Each line lies in one level and belongs to one lookup (its owner). Lines are sorted by
/// the number of probes, the largest first. After `expand`, each line is a single probe.
struct MipMap::Lines {
    int count = 0;
    alignas(64) int32_t owner[kMaxLines], level[kMaxLines], probes[kMaxLines];
    alignas(64) float share[kMaxLines]; ///< weight of the line in the color of its owner
    alignas(64) float x[kMaxLines], y[kMaxLines], halfX[kMaxLines], halfY[kMaxLines];
    alignas(64) float probeCount[kMaxLines]; ///< `probes` as a float
    alignas(64) float steepness[kMaxLines];
    /// Position of the first probe on the line, which has length 2 probeCount; probes are 2 apart.
    alignas(64) float firstProbe[kMaxLines];
    alignas(64) int32_t width[kMaxLines], height[kMaxLines], firstTexel[kMaxLines]; ///< of the level

    Lines() = default;
    Lines(const Footprints& f, int begin, int end, const int32_t* isDone);
    void expand(const Lines& lines);
    static void fill(const Footprints& f, const V2SoA& uv, const MipMap& mipMap, Lines& lines);

  private:
    void setLine(int line, int32_t lineOwner, int32_t lineLevel, int32_t lineProbes, float lineShare);
};

/// One probe of each line: the indices of the four texels around it, and their weights.
struct MipMap::Taps {
    alignas(64) int32_t texel[4][kMaxLines];
    alignas(64) float weight[4][kMaxLines];

    static void compute(const Lines& lines, int probe, int count, int32_t repeatMask, Taps& out);
};

void MipMap::Lines::setLine(int line, int32_t lineOwner, int32_t lineLevel, int32_t lineProbes,
                            float lineShare) {
    owner[line] = lineOwner;
    level[line] = lineLevel;
    probes[line] = lineProbes;
    share[line] = lineShare;
}

MipMap::Lines::Lines(const Footprints& f, int begin, int end, const int32_t* isDone) {
    // A counting sort: the number of lines by their number of probes, then the index of the next such line.
    int next[kMaxProbes + 1] = {};
    int most = 0;
    for (int i = begin; i < end; ++i)
        if (isDone[i]) {
            next[f.probes[i]] += f.blend[i] > 0 ? 2 : 1;
            most = std::max(most, int(f.probes[i]));
        }
    for (; most > 0; --most)
        count += std::exchange(next[most], count);
    for (int i = begin; i < end; ++i) {
        if (!isDone[i])
            continue;
        const int n = f.probes[i];
        setLine(next[n]++, i, f.finer[i], n, 1 - f.blend[i]);
        if (f.blend[i] > 0)
            setLine(next[n]++, i, f.finer[i] + 1, n, f.blend[i]);
    }
}

/// Sets the members that depend on the owner and the level of each line.
STROBE_TARGET_CLONES void MipMap::Lines::fill(const Footprints& f, const V2SoA& uv, const MipMap& mipMap,
                                              Lines& lines) {
    const int32_t* width = mipMap.m_width.data();
    const int32_t* height = mipMap.m_height.data();
    const int32_t* firstTexel = mipMap.m_firstTexel.data();
    const int n = lines.count;
    STROBE_IVDEP
    for (int k = 0; k < n; ++k) {
        const int32_t i = lines.owner[k];
        const int32_t level = lines.level[k];
        lines.x[k] = uv.x[i];
        lines.y[k] = uv.y[i];
        lines.halfX[k] = f.half.x[i];
        lines.halfY[k] = f.half.y[i];
        lines.probeCount[k] = float(lines.probes[k]);
        lines.steepness[k] = f.steepness[i];
        lines.firstProbe[k] = 1;
        lines.width[k] = width[level];
        lines.height[k] = height[level];
        lines.firstTexel[k] = firstTexel[level];
    }
}

/// Makes one line for each probe of `lines`. The owners are the indices in `lines`.
void MipMap::Lines::expand(const Lines& lines) {
    count = 0;
    for (int k = 0; k < lines.count; ++k) {
        const int n = lines.probes[k];
        const auto repeat = [&](const auto* source, auto* target) {
            std::fill_n(target + count, n, source[k]);
        };
        repeat(lines.x, x);
        repeat(lines.y, y);
        repeat(lines.halfX, halfX);
        repeat(lines.halfY, halfY);
        repeat(lines.probeCount, probeCount);
        repeat(lines.steepness, steepness);
        repeat(lines.width, width);
        repeat(lines.height, height);
        repeat(lines.firstTexel, firstTexel);
        for (int i = 0; i < n; ++i, ++count) {
            owner[count] = k;
            firstProbe[count] = float(2 * i + 1);
        }
    }
}

/// Computes the taps of probe number `probe` of the first `count` lines.
STROBE_TARGET_CLONES void MipMap::Taps::compute(const Lines& lines, int probe, int count, int32_t repeatMask,
                                                Taps& out) {
    const float offset = 2 * float(probe);
    const float period = repeatMask ? 1.f : 0.f;
    STROBE_IVDEP
    for (int k = 0; k < count; ++k) {
        const float x = (lines.firstProbe[k] + offset) / lines.probeCount[k] - 1;
        const float weight = fastExp(lines.steepness[k] * sqr(x));
        const int32_t width = lines.width[k];
        const int32_t first = lines.firstTexel[k];
        const AxisTap u = axisTap(lines.x[k] + lines.halfX[k] * x, width, repeatMask, period);
        const AxisTap v = axisTap(lines.y[k] + lines.halfY[k] * x, lines.height[k], repeatMask, period);
        const int32_t upperRow = first + v.first * width;
        const int32_t lowerRow = first + v.second * width;
        out.texel[0][k] = upperRow + u.first;
        out.texel[1][k] = upperRow + u.second;
        out.texel[2][k] = lowerRow + u.first;
        out.texel[3][k] = lowerRow + u.second;
        const float upper = weight * (1 - v.x);
        const float lower = weight * v.x;
        out.weight[0][k] = upper * (1 - u.x);
        out.weight[1][k] = upper * u.x;
        out.weight[2][k] = lower * (1 - u.x);
        out.weight[3][k] = lower * u.x;
    }
}

MipMap::MipMap(const std::vector<Image>& levels) {
    for (const Image& level : levels) {
        m_width.push_back(level.width);
        m_height.push_back(level.height);
        m_firstTexel.push_back(int32_t(m_texels.size()));
        m_shorterSide.push_back(float(std::min(level.width, level.height)));
        for (const Rgb& c : level.pixels)
            m_texels.push_back({{c.x, c.y, c.z, 1}});
    }
    m_longerSide = std::max(m_width.front(), m_height.front());
}

void MipMap::addTexels(const Taps& taps, int k, Texel& sum) const {
    const Texel* texels = m_texels.data();
    const auto weighted = [&](int tap) {
        return loadFloat4(texels[taps.texel[tap][k]].values) * taps.weight[tap][k];
    };
    storeFloat4(sum.values,
                loadFloat4(sum.values) + ((weighted(0) + weighted(1)) + (weighted(2) + weighted(3))));
}

void MipMap::sumProbes(const Lines& lines, int32_t repeatMask, Texel* sums) const {
    constexpr int kFewLines = 2; // a single lookup
    Taps taps;
    std::fill_n(sums, lines.count, Texel{});
    if (lines.count <= kFewLines) { // vectorizes over all probes of all lines
        Lines probes;
        probes.expand(lines);
        Taps::compute(probes, 0, probes.count, repeatMask, taps);
        for (int k = 0; k < probes.count; ++k)
            addTexels(taps, k, sums[probes.owner[k]]);
        return;
    }
    for (int probe = 0, left = lines.count;; ++probe) { // vectorizes over lines
        while (left > 0 && lines.probes[left - 1] <= probe)
            --left;
        if (left == 0)
            return;
        Taps::compute(lines, probe, left, repeatMask, taps);
        for (int k = 0; k < left; ++k)
            addTexels(taps, k, sums[k]);
    }
}

void MipMap::lookupSoA(const TexturePointSoA& points, int begin, int end, Wrap wrap, RgbSoA& out,
                       int32_t* isDone) const {
    if (wrap != Wrap::Repeat && wrap != Wrap::Clamp)
        return std::fill(isDone + begin, isDone + end, 0);
    Footprints footprints;
    const int levels = int(m_width.size());
    const float side = float(m_longerSide);
    Footprints::measure(points, begin, end, side, isDone, footprints);
    Footprints::findLevels(m_shorterSide.data(), levels, begin, end, footprints);
    Footprints::findProbes(m_shorterSide.data(), levels, side, begin, end, footprints);
    Lines lines(footprints, begin, end, isDone);
    Lines::fill(footprints, points.uv, *this, lines);

    Texel sums[kMaxLines];
    sumProbes(lines, wrap == Wrap::Repeat ? -1 : 0, sums);
    for (float* row : {out.r, out.g, out.b})
        std::fill(row + begin, row + end, 0.f);
    for (int k = 0; k < lines.count; ++k) {
        const int i = lines.owner[k];
        const float* sum = sums[k].values;
        const float scale = lines.share[k] / sum[3];
        out.r[i] += sum[0] * scale;
        out.g[i] += sum[1] * scale;
        out.b[i] += sum[2] * scale;
    }
}

bool MipMap::lookup(const V2f& uv, const V2f& duvdx, const V2f& duvdy, Wrap wrap, Rgb& out) const {
    TexturePointSoA point;
    RgbSoA color;
    int32_t isDone;
    point.uv.set(0, uv);
    point.duvdx.set(0, duvdx);
    point.duvdy.set(0, duvdy);
    lookupSoA(point, 0, 1, wrap, color, &isDone);
    out = color.at(0);
    return isDone;
}

} // namespace strobe
