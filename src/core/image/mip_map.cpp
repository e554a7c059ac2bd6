#include "core/image/mip_map.h"

#include "core/math/fast_math.h"
#include "core/math/simd4.h"

#include <utility>

namespace strobe {

namespace {

constexpr float kMaxStretch = 32; ///< of ellipses; those that are more are taken for wider ones
constexpr int kMaxProbes = 64;    ///< along one
constexpr float kMaxEdge = 1000;  ///< ellipse, in images
constexpr int kMaxLines = 2 * kSoAWidth;
static_assert(2 * kMaxProbes <= kMaxLines);

/// Where a lookup lies along one axis of n texels: between two of them, and how far from the first.
struct Between {
    int first, second;
    float x;
};

STROBE_FORCE_INLINE int floorOf(float x) {
    const int toZero = int(x);
    return toZero - int(float(toZero) > x);
}

/// `repeats`: all ones, or 0.
STROBE_FORCE_INLINE Between between(float u, int n, int32_t repeats, float image) {
    const int before = (n - 1) & repeats, behind = n - 1 - before;
    const float x = (u - image * float(floorOf(u))) * float(n) - .5f;
    const int left = floorOf(x), right = left + 1;
    const int leftInside = std::min(left, n - 1), rightInside = std::max(right, 0);
    return {left < 0 ? before : leftInside, right < n ? rightInside : behind, x - float(left)};
}

/// Lengths of the axes of the ellipse that two derivatives span, and the direction of the major one.
struct Axes {
    float major, minor;
    V2f direction;

    STROBE_FORCE_INLINE Axes(const V2f& dx, const V2f& dy) {
        const float s2 = sqr(dx.x) + sqr(dy.x), t2 = sqr(dx.y) + sqr(dy.y), st = dx.x * dx.y + dy.x * dy.y;
        const float difference = s2 - t2, root = std::sqrt(sqr(difference) + 4 * sqr(st));
        major = std::sqrt((s2 + t2 + root) / 2);
        const float width = std::abs(dx.x * dy.y - dx.y * dy.x) / major; // by the area: nothing cancels
        minor = major > 0 ? width : 0.f;
        // Of the two expressions of an eigenvector, that whose terms have one sign.
        const float sum = root + std::abs(difference), other = 2 * std::abs(st);
        const float inverse = 1 / std::sqrt(2 * root * sum), scale = root > 0 ? inverse : 0.f;
        const float x = (difference < 0 ? other : sum) * scale, y = (difference < 0 ? sum : other) * scale;
        direction = {root > 0 ? x : 1.f, std::copysign(y, st)};
    }
    /// Makes an ellipse that is too thin wider, and half as much too long as it was. Returns how many times
    /// as long as wide it is then.
    STROBE_FORCE_INLINE float limit() {
        const float aspect = major / minor, mean = (major + minor * kMaxStretch) / 2;
        const int32_t fits = major <= minor * kMaxStretch ? 1 : 0;
        const float narrow = mean / kMaxStretch;
        major = fits ? major : mean, minor = fits ? minor : narrow;
        return fits ? aspect : kMaxStretch;
    }
};

} // namespace

/// Ellipses, and what is probed of them.
struct MipMap::Shapes {
    alignas(64) float major[kSoAWidth], minor[kSoAWidth], aspect[kSoAWidth]; ///< as limited
    V2SoA direction;
    alignas(64) int32_t isTiny[kSoAWidth]; ///< lies between texels of the finest level
    /// The first level where the ellipse is no wider than a texel; blended with the finer one before it.
    alignas(64) int32_t level[kSoAWidth], isWider[kSoAWidth];
    V2SoA half; ///< probes go from uv - half to uv + half
    alignas(64) int32_t probes[kSoAWidth], finer[kSoAWidth];
    alignas(64) float steep[kSoAWidth]; ///< weights are exp(steep x²), at x from -1 to 1
    alignas(64) float blend[kSoAWidth]; ///< how much of the coarser level

    static void measure(const TexturePointSoA& at, int begin, int end, float side, int32_t* found, Shapes& s);
    static void findLevels(const float* lesserSide, int levels, int begin, int end, Shapes& s);
    static void findProbes(const float* lesserSide, int levels, float side, int begin, int end, Shapes& s);
};

/// `side`: the longer one of the finest level.
STROBE_TARGET_CLONES void MipMap::Shapes::measure(const TexturePointSoA& at, int begin, int end, float side,
                                                  int32_t* found, Shapes& s) {
    // Texels are counted by ints, also those at the end of the longest ellipse.
    const float most = 0x1p30f / side - kMaxEdge;
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        Axes axes(at.duvdx.at(i), at.duvdy.at(i));
        const int32_t isTiny = axes.major * side < .5f ? 1 : 0, isShort = axes.major < kMaxEdge ? 1 : 0;
        const int32_t isNear = (std::abs(at.uv.x[i]) < most ? 1 : 0) & (std::abs(at.uv.y[i]) < most ? 1 : 0);
        found[i] = isNear & (isTiny | isShort);
        s.isTiny[i] = isTiny;
        s.aspect[i] = axes.limit();
        s.major[i] = axes.major, s.minor[i] = axes.minor;
        s.direction.x[i] = axes.direction.x, s.direction.y[i] = axes.direction.y;
        s.level[i] = 0, s.isWider[i] = 1;
    }
}

STROBE_TARGET_CLONES void MipMap::Shapes::findLevels(const float* lesserSide, int levels, int begin, int end,
                                                     Shapes& s) {
    for (int level = 0; level < levels; ++level) {
        const float side = lesserSide[level];
        STROBE_IVDEP
        for (int i = begin; i < end; ++i) {
            s.isWider[i] &= s.minor[i] * side > 1 ? 1 : 0;
            s.level[i] += s.isWider[i];
        }
        if (end - begin == 1 && !s.isWider[begin])
            return;
    }
}

STROBE_TARGET_CLONES void MipMap::Shapes::findProbes(const float* lesserSide, int levels, float side,
                                                     int begin, int end, Shapes& s) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const int32_t level = s.level[i], isTiny = s.isTiny[i];
        const float major = s.major[i], minor = s.minor[i], length = major - minor;
        // Thinner than half a texel counts as that.
        const int32_t isThin = (level == 0 ? 1 : 0) & (minor * side < .5f ? 1 : 0);
        const float thin = std::max(1.f, major * side * 2), aspect = isThin ? thin : s.aspect[i];
        const float wanted = std::min(std::max(1.f, 2 * aspect - 1), float(kMaxProbes));
        const int32_t several = int32_t(wanted), probes = isTiny ? 1 : several;
        const float steep = -2 * sqr(major / std::max(2 * length, 1e-20f));
        s.probes[i] = probes;
        s.steep[i] = probes <= 2 ? 0.f : steep;
        const float x = s.direction.x[i] * length, y = s.direction.y[i] * length;
        s.half.x[i] = isTiny ? 0.f : x, s.half.y[i] = isTiny ? 0.f : y;
        const int32_t isBetween = (level > 0 ? 1 : 0) & (level < levels ? 1 : 0) & (isTiny ^ 1);
        const float coarser = lesserSide[std::min(level, levels - 1)];
        const float blend = std::min(std::max(2 * minor * coarser - 1, 0.f), 1.f);
        s.blend[i] = isBetween ? blend : 0.f;
        const int32_t before = std::max(level - 1, 0);
        s.finer[i] = isTiny ? 0 : before;
    }
}

/// Rows of probes, each in one level; those with the most come first. Or single probes of them.
struct MipMap::Lines {
    int count = 0;
    alignas(64) int32_t owner[kMaxLines], level[kMaxLines], probes[kMaxLines];
    alignas(64) float share[kMaxLines]; ///< in the owner's color
    alignas(64) float x[kMaxLines], y[kMaxLines], halfX[kMaxLines], halfY[kMaxLines];
    alignas(64) float number[kMaxLines], steep[kMaxLines];
    alignas(64) float middle[kMaxLines]; ///< of the first probe, in 2 number parts of the line
    alignas(64) int32_t width[kMaxLines], height[kMaxLines], first[kMaxLines];

    Lines() = default;
    Lines(const Shapes& s, int begin, int end, const int32_t* found);
    void spread(const Lines& few);
    static void fill(const Shapes& s, const V2SoA& uv, const MipMap& levels, Lines& lines);
};

/// What one probe of each line takes: the four texels around, by index, and how much of these.
struct MipMap::Taken {
    alignas(64) int32_t texel[4][kMaxLines];
    alignas(64) float weight[4][kMaxLines];

    static void take(const Lines& lines, int probe, int count, int32_t repeats, Taken& out);
};

MipMap::Lines::Lines(const Shapes& s, int begin, int end, const int32_t* found) {
    int places[kMaxProbes + 1] = {}, most = 0; // by probes
    for (int i = begin; i < end; ++i)
        if (found[i]) {
            places[s.probes[i]] += s.blend[i] > 0 ? 2 : 1;
            most = std::max(most, int(s.probes[i]));
        }
    for (; most > 0; --most)
        count += std::exchange(places[most], count);
    for (int i = begin; i < end; ++i) {
        if (!found[i])
            continue;
        const int n = s.probes[i], at = places[n];
        const bool twice = s.blend[i] > 0;
        owner[at] = i, level[at] = s.finer[i], probes[at] = n, share[at] = 1 - s.blend[i];
        if (twice)
            owner[at + 1] = i, level[at + 1] = s.finer[i] + 1, probes[at + 1] = n, share[at + 1] = s.blend[i];
        places[n] = at + 1 + twice;
    }
}

STROBE_TARGET_CLONES void MipMap::Lines::fill(const Shapes& s, const V2SoA& uv, const MipMap& levels,
                                              Lines& lines) {
    const int32_t *width = levels.m_width.data(), *height = levels.m_height.data(),
                  *first = levels.m_first.data();
    const int n = lines.count;
    STROBE_IVDEP
    for (int k = 0; k < n; ++k) {
        const int32_t i = lines.owner[k], level = lines.level[k];
        lines.x[k] = uv.x[i], lines.y[k] = uv.y[i];
        lines.halfX[k] = s.half.x[i], lines.halfY[k] = s.half.y[i];
        lines.number[k] = float(lines.probes[k]), lines.steep[k] = s.steep[i], lines.middle[k] = 1;
        lines.width[k] = width[level], lines.height[k] = height[level], lines.first[k] = first[level];
    }
}

/// Becomes all probes of some lines; the owners are the lines.
void MipMap::Lines::spread(const Lines& few) {
    count = 0;
    for (int k = 0; k < few.count; ++k) {
        const int n = few.probes[k];
        const auto repeat = [&](const auto* from, auto* to) { std::fill_n(to + count, n, from[k]); };
        repeat(few.x, x), repeat(few.y, y), repeat(few.halfX, halfX), repeat(few.halfY, halfY);
        repeat(few.number, number), repeat(few.steep, steep);
        repeat(few.width, width), repeat(few.height, height), repeat(few.first, first);
        for (int i = 0; i < n; ++i, ++count)
            owner[count] = k, middle[count] = float(2 * i + 1);
    }
}

STROBE_TARGET_CLONES void MipMap::Taken::take(const Lines& lines, int probe, int count, int32_t repeats,
                                              Taken& out) {
    const float before = 2 * float(probe), image = repeats ? 1.f : 0.f;
    STROBE_IVDEP
    for (int k = 0; k < count; ++k) {
        const float x = (lines.middle[k] + before) / lines.number[k] - 1,
                    weight = fastExp(lines.steep[k] * sqr(x));
        const int32_t width = lines.width[k], first = lines.first[k];
        const Between u = between(lines.x[k] + lines.halfX[k] * x, width, repeats, image);
        const Between v = between(lines.y[k] + lines.halfY[k] * x, lines.height[k], repeats, image);
        const int32_t above = first + v.first * width, below = first + v.second * width;
        out.texel[0][k] = above + u.first, out.texel[1][k] = above + u.second;
        out.texel[2][k] = below + u.first, out.texel[3][k] = below + u.second;
        const float upper = weight * (1 - v.x), lower = weight * v.x;
        out.weight[0][k] = upper * (1 - u.x), out.weight[1][k] = upper * u.x;
        out.weight[2][k] = lower * (1 - u.x), out.weight[3][k] = lower * u.x;
    }
}

MipMap::MipMap(const std::vector<Image>& levels) {
    for (const Image& level : levels) {
        m_width.push_back(level.width), m_height.push_back(level.height);
        m_first.push_back(int32_t(m_texels.size()));
        m_lesserSide.push_back(float(std::min(level.width, level.height)));
        for (const Rgb& c : level.pixels)
            m_texels.push_back({{c.x, c.y, c.z, 1}});
    }
    m_longestSide = std::max(m_width.front(), m_height.front());
}

void MipMap::addTexels(const Taken& taken, int k, Texel& sum) const {
    const Texel* texels = m_texels.data();
    const auto part = [&](int c) {
        return loadFloat4(texels[taken.texel[c][k]].numbers) * taken.weight[c][k];
    };
    storeFloat4(sum.numbers, loadFloat4(sum.numbers) + ((part(0) + part(1)) + (part(2) + part(3))));
}

void MipMap::probe(const Lines& lines, int32_t repeats, Texel* sums) const {
    constexpr int kFew = 2; // as one lookup has
    Taken taken;
    std::fill_n(sums, lines.count, Texel{});
    if (lines.count <= kFew) { // all probes of all lines side by side
        Lines probes;
        probes.spread(lines);
        Taken::take(probes, 0, probes.count, repeats, taken);
        for (int k = 0; k < probes.count; ++k)
            addTexels(taken, k, sums[probes.owner[k]]);
        return;
    }
    for (int number = 0, left = lines.count;; ++number) { // one of each line
        while (left > 0 && lines.probes[left - 1] <= number)
            --left;
        if (left == 0)
            return;
        Taken::take(lines, number, left, repeats, taken);
        for (int k = 0; k < left; ++k)
            addTexels(taken, k, sums[k]);
    }
}

void MipMap::lookupSoA(const TexturePointSoA& at, int begin, int end, Wrap wrap, RgbSoA& out,
                       int32_t* found) const {
    if (wrap != Wrap::Repeat && wrap != Wrap::Clamp)
        return std::fill(found + begin, found + end, 0);
    Shapes shapes;
    const int levels = int(m_width.size());
    const float side = float(m_longestSide);
    Shapes::measure(at, begin, end, side, found, shapes);
    Shapes::findLevels(m_lesserSide.data(), levels, begin, end, shapes);
    Shapes::findProbes(m_lesserSide.data(), levels, side, begin, end, shapes);
    Lines lines(shapes, begin, end, found);
    Lines::fill(shapes, at.uv, *this, lines);

    Texel sums[kMaxLines];
    probe(lines, wrap == Wrap::Repeat ? -1 : 0, sums);
    for (float* row : {out.r, out.g, out.b})
        std::fill(row + begin, row + end, 0.f);
    for (int k = 0; k < lines.count; ++k) {
        const int i = lines.owner[k];
        const float* sum = sums[k].numbers;
        const float scale = lines.share[k] / sum[3];
        out.r[i] += sum[0] * scale, out.g[i] += sum[1] * scale, out.b[i] += sum[2] * scale;
    }
}

bool MipMap::lookup(const V2f& uv, const V2f& duvdx, const V2f& duvdy, Wrap wrap, Rgb& out) const {
    TexturePointSoA at;
    RgbSoA color;
    int32_t found;
    at.uv.set(0, uv), at.duvdx.set(0, duvdx), at.duvdy.set(0, duvdy);
    lookupSoA(at, 0, 1, wrap, color, &found);
    out = color.at(0);
    return found;
}

} // namespace strobe
