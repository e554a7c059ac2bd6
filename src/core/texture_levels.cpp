#include "core/texture_levels.h"

#include "core/fast_math.h"
#include "core/lanes.h"

#include <cstring>

namespace strobe {

namespace {

/// Where a lookup lies along one axis of n texels: between two of them, and how far from the first.
struct Between {
    int first, second;
    float x;
};

STROBE_INLINE int floorOf(float x) {
    const int toZero = int(x);
    return toZero - int(float(toZero) > x);
}

/// Without branches, for loops of vectors.
STROBE_INLINE Between between(float u, int n, bool repeats) {
    const float image = repeats ? 1.f : 0.f;
    const int before = repeats ? n - 1 : 0, behind = n - 1 - before;
    const float x = (u - image * float(floorOf(u))) * float(n) - .5f;
    const int left = floorOf(x), right = left + 1;
    const int leftInside = std::min(left, n - 1), rightInside = std::max(right, 0);
    return {left < 0 ? before : leftInside, right < n ? rightInside : behind, x - float(left)};
}

/// Lengths of the axes of the ellipse that two derivatives span, and the direction of the major one.
struct Axes {
    float major, minor;
    V2f direction;

    Axes(const V2f& dx, const V2f& dy) {
        const float s2 = sqr(dx.x) + sqr(dy.x), t2 = sqr(dx.y) + sqr(dy.y), st = dx.x * dx.y + dy.x * dy.y;
        const float difference = s2 - t2, root = std::sqrt(sqr(difference) + 4 * sqr(st));
        major = std::sqrt((s2 + t2 + root) / 2);
        minor = major > 0 ? std::abs(dx.x * dy.y - dx.y * dy.x) / major : 0; // by the area: nothing cancels
        // Of the two expressions of an eigenvector, that whose terms have one sign.
        const float sum = root + std::abs(difference), other = 2 * std::abs(st);
        const float scale = root > 0 ? 1 / std::sqrt(2 * root * sum) : 0;
        const float x = difference < 0 ? other : sum, y = difference < 0 ? sum : other;
        direction = {root > 0 ? x * scale : 1, std::copysign(y * scale, st)};
    }
    /// Makes an ellipse that is too thin wider, and half as much too long as it was. Returns how many times
    /// as long as wide it is then.
    float limit(float mostStretched) {
        if (major <= mostStretched * minor)
            return major / minor;
        major = (major + minor * mostStretched) / 2;
        minor = major / mostStretched;
        return mostStretched;
    }
};

/// Few probes are done as quickly as one, if there are as many as a vector has.
STROBE_INLINE int fullVectors(int probes) { return (probes + 7) & ~7; }

} // namespace

TextureLevels::Level::Level(const Image& image) : width(image.width), height(image.height) {
    texels.reserve(image.pixels.size());
    for (const Rgb& c : image.pixels)
        texels.push_back({{c.x, c.y, c.z, 1}});
}

STROBE_LANES void TextureLevels::take(const Line& line, const Level& finer, const Level* coarser,
                                      bool repeats, Taken* out) {
    const int n = fullVectors(line.probes);
    const V2f middle = line.middle, half = line.half;
    const float probes = float(line.probes), steep = line.probes == 2 ? 0 : -2 * sqr(line.spread);
    alignas(64) float x[kMostProbes], weight[kMostProbes];
    STROBE_INDEPENDENT
    for (int i = 0; i < n; ++i) {
        x[i] = (2 * float(i) + 1) / probes - 1;
        weight[i] = fastExp(steep * sqr(x[i]));
    }
    for (const Level* level = &finer; level; level = level == &finer ? coarser : nullptr, ++out) {
        const int width = level->width, height = level->height;
        Taken& taken = *out;
        STROBE_INDEPENDENT
        for (int i = 0; i < n; ++i) {
            const Between u = between(middle.x + half.x * x[i], width, repeats);
            const Between v = between(middle.y + half.y * x[i], height, repeats);
            taken.texel[0][i] = v.first * width + u.first, taken.texel[1][i] = v.first * width + u.second;
            taken.texel[2][i] = v.second * width + u.first, taken.texel[3][i] = v.second * width + u.second;
            const float upper = weight[i] * (1 - v.x), lower = weight[i] * v.x;
            taken.weight[0][i] = upper * (1 - u.x), taken.weight[1][i] = upper * u.x;
            taken.weight[2][i] = lower * (1 - u.x), taken.weight[3][i] = lower * u.x;
        }
    }
}

Rgb TextureLevels::bilinear(const Level& level, const V2f& uv, bool repeats) {
    const Between u = between(uv.x, level.width, repeats), v = between(uv.y, level.height, repeats);
    const Texel* upper = &level.texels[size_t(v.first) * size_t(level.width)];
    const Texel* lower = &level.texels[size_t(v.second) * size_t(level.width)];
    const auto mean = [](const Texel& a, const Texel& b, float x) {
        const float *p = a.numbers, *q = b.numbers;
        return Rgb(p[0], p[1], p[2]) * (1 - x) + Rgb(q[0], q[1], q[2]) * x;
    };
    return mean(upper[u.first], upper[u.second], u.x) * (1 - v.x) +
           mean(lower[u.first], lower[u.second], u.x) * v.x;
}

Rgb TextureLevels::mean(const Level& level, const Taken& taken, int probes) {
    typedef float Four __attribute__((vector_size(16)));
    Four sums[4]{}; // one for each corner: none waits for another
    for (int i = 0; i < probes; ++i)
        for (int k = 0; k < 4; ++k) {
            Four texel;
            std::memcpy(&texel, &level.texels[size_t(taken.texel[k][i])], sizeof texel);
            sums[k] += texel * taken.weight[k][i];
        }
    const Four sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
    return Rgb(sum[0], sum[1], sum[2]) * (1 / sum[3]);
}

Rgb TextureLevels::along(const Line& line, const Level& finer, const Level* coarser, float blend,
                         bool repeats) {
    if (line.probes == 1) {
        const Rgb c = bilinear(finer, line.middle, repeats);
        return coarser ? c * (1 - blend) + bilinear(*coarser, line.middle, repeats) * blend : c;
    }
    Taken taken[2];
    take(line, finer, coarser, repeats, taken);
    const Rgb c = mean(finer, taken[0], line.probes);
    return coarser ? c * (1 - blend) + mean(*coarser, taken[1], line.probes) * blend : c;
}

bool TextureLevels::lookup(const V2f& uv, const V2f& duvdx, const V2f& duvdy, Wrap wrap, Rgb& out) const {
    const Level& finest = m_levels.front();
    const bool repeats = wrap == Wrap::Repeat;
    // Texels are counted by ints, also those at the end of the longest ellipse.
    const float most = 0x1p30f / float(std::max(finest.width, finest.height)) - kLongest;
    if (wrap == Wrap::Black || !(std::abs(uv.x) < most) || !(std::abs(uv.y) < most))
        return false;
    Axes axes(duvdx, duvdy);
    if (axes.major * float(std::max(finest.width, finest.height)) < .5f) { // all of it between texels
        out = bilinear(finest, uv, repeats);
        return true;
    }
    if (!(axes.major < kLongest))
        return false;
    float aspect = axes.limit(kMostStretched);
    // The first level where the ellipse is no wider than a texel, blended with the finer one before it.
    size_t level = 0;
    while (level < m_levels.size() && axes.minor * float(m_levels[level].lesserSide()) > 1)
        ++level;
    const float texels = float(std::max(finest.width, finest.height));
    if (level == 0 && axes.minor * texels < .5f) // thinner than half a texel counts as that
        aspect = std::max(axes.major * texels * 2, 1.f);
    const float length = axes.major - axes.minor;
    const Line line{uv, axes.direction * length, std::max(1, int(2 * aspect - 1)),
                    axes.major / std::max(2 * length, 1e-20f)};
    const Level& finer = m_levels[level == 0 ? 0 : level - 1];
    const bool isBetween = level > 0 && level < m_levels.size();
    const float blend =
        isBetween ? std::clamp(2 * axes.minor * float(m_levels[level].lesserSide()) - 1, 0.f, 1.f) : 0;
    out = along(line, finer, blend > 0 ? &m_levels[level] : nullptr, blend, repeats);
    return true;
}

} // namespace strobe
