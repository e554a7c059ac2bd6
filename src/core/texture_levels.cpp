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

/// Places in (-1, 1) and the weights exp(-2 (spread x)²) there.
STROBE_LANES void placeProbes(int probes, float spread, float* x, float* weight) {
    const int n = fullVectors(probes);
    STROBE_INDEPENDENT
    for (int i = 0; i < n; ++i) {
        x[i] = (2 * float(i) + 1) / float(probes) - 1;
        const float w = fastExp(-2 * sqr(x[i] * spread));
        weight[i] = probes == 2 ? 1 : w;
    }
}

} // namespace

TextureLevels::Level::Level(const Image& image) : width(image.width), height(image.height) {
    texels.reserve(image.pixels.size());
    for (const Rgb& c : image.pixels)
        texels.push_back({{c.x, c.y, c.z, 0}});
}

STROBE_LANES void TextureLevels::take(const Level& level, const Line& line, bool repeats, Taken& out) {
    const int width = level.width, height = level.height, n = fullVectors(line.probes);
    const V2f middle = line.middle, half = line.half;
    STROBE_INDEPENDENT
    for (int i = 0; i < n; ++i) {
        const Between u = between(middle.x + half.x * line.x[i], width, repeats);
        const Between v = between(middle.y + half.y * line.x[i], height, repeats);
        out.texel[0][i] = v.first * width + u.first, out.texel[1][i] = v.first * width + u.second;
        out.texel[2][i] = v.second * width + u.first, out.texel[3][i] = v.second * width + u.second;
        const float upper = line.weight[i] * (1 - v.x), lower = line.weight[i] * v.x;
        out.weight[0][i] = upper * (1 - u.x), out.weight[1][i] = upper * u.x;
        out.weight[2][i] = lower * (1 - u.x), out.weight[3][i] = lower * u.x;
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

TextureLevels::Line::Line(const V2f& at, const V2f& toEnd, int n, float spread)
    : middle(at), half(toEnd), probes(n) {
    if (probes == 1)
        return;
    placeProbes(probes, spread, x, weight);
    for (int i = 0; i < probes; ++i)
        weights += weight[i];
}

Rgb TextureLevels::along(const Level& level, const Line& line, bool repeats) {
    if (line.probes == 1)
        return bilinear(level, line.middle, repeats);
    Taken taken;
    take(level, line, repeats, taken);
    typedef float Four __attribute__((vector_size(16)));
    Four sums[4]{}; // one for each corner: none waits for another
    for (int i = 0; i < line.probes; ++i)
        for (int k = 0; k < 4; ++k) {
            Four texel;
            std::memcpy(&texel, &level.texels[size_t(taken.texel[k][i])], sizeof texel);
            sums[k] += texel * taken.weight[k][i];
        }
    const Four sum = ((sums[0] + sums[1]) + (sums[2] + sums[3])) * (1 / line.weights);
    return {sum[0], sum[1], sum[2]};
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
    while (level < m_levels.size() && axes.minor * lesserSide(m_levels[level]) > 1)
        ++level;
    const float texels = float(std::max(finest.width, finest.height));
    if (level == 0 && axes.minor * texels < .5f) // thinner than half a texel counts as that
        aspect = std::max(axes.major * texels * 2, 1.f);
    const float length = axes.major - axes.minor;
    const Line line(uv, axes.direction * length, std::max(1, int(2 * aspect - 1)),
                    axes.major / std::max(2 * length, 1e-20f));
    if (level == 0) {
        out = along(finest, line, repeats);
    } else if (level == m_levels.size()) {
        out = along(m_levels.back(), line, repeats);
    } else {
        const float blend = std::clamp(2 * axes.minor * lesserSide(m_levels[level]) - 1, 0.f, 1.f);
        out = along(m_levels[level - 1], line, repeats) * (1 - blend);
        if (blend > 0)
            out += along(m_levels[level], line, repeats) * blend;
    }
    return true;
}

} // namespace strobe
