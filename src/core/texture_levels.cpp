#include "core/texture_levels.h"

#include "core/fast_math.h"
#include "core/lanes.h"

namespace strobe {

namespace {

int wrapped(int i, int n, Wrap wrap) {
    if (i >= 0 && i < n)
        return i; // as nearly all: divisions are slow
    if (wrap == Wrap::Clamp)
        return std::clamp(i, 0, n - 1);
    const int rest = i % n;
    return rest < 0 ? rest + n : rest;
}

/// Lengths of the axes of the ellipse that two derivatives span, and the direction of the major one.
struct Axes {
    float major, minor;
    V2f direction;

    Axes(const V2f& dx, const V2f& dy) {
        const double s2 = double(dx.x) * dx.x + double(dy.x) * dy.x,
                     t2 = double(dx.y) * dx.y + double(dy.y) * dy.y,
                     st = double(dx.x) * dx.y + double(dy.x) * dy.y;
        const double difference = s2 - t2, root = std::sqrt(difference * difference + 4 * st * st);
        major = float(std::sqrt((s2 + t2 + root) / 2));
        minor = float(std::sqrt(std::max((s2 + t2 - root) / 2, 0.)));
        const double cos2 = root > 0 ? difference / root : 1; // of twice the angle
        direction = {float(std::sqrt(std::max(1 + cos2, 0.) / 2)),
                     float(std::copysign(std::sqrt(std::max(1 - cos2, 0.) / 2), st))};
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

/// Places in (-1, 1) and the weights exp(-2 (spread x)²) there.
STROBE_LANES void placeProbes(int probes, float spread, float* x, float* weight) {
    STROBE_INDEPENDENT
    for (int i = 0; i < probes; ++i) {
        x[i] = (2 * float(i) + 1) / float(probes) - 1;
        const float w = fastExp(-2 * sqr(x[i] * spread));
        weight[i] = probes == 2 ? 1 : w;
    }
}

float lesserSide(const Image& level) { return float(std::min(level.width, level.height)); }

} // namespace

Rgb TextureLevels::bilinear(const Image& level, const V2f& uv, Wrap wrap) const {
    const float x = uv.x * float(level.width) - .5f, y = uv.y * float(level.height) - .5f;
    const float left = std::floor(x), top = std::floor(y), fx = x - left, fy = y - top;
    const int x0 = wrapped(int(left), level.width, wrap), x1 = wrapped(int(left) + 1, level.width, wrap);
    const int y0 = wrapped(int(top), level.height, wrap), y1 = wrapped(int(top) + 1, level.height, wrap);
    const Rgb upper = level.at(x0, y0) * (1 - fx) + level.at(x1, y0) * fx;
    const Rgb lower = level.at(x0, y1) * (1 - fx) + level.at(x1, y1) * fx;
    return upper * (1 - fy) + lower * fy;
}

TextureLevels::Line::Line(const V2f& at, const V2f& toEnd, int n, float spread)
    : middle(at), half(toEnd), probes(n) {
    if (probes == 1)
        return;
    placeProbes(probes, spread, x, weight);
    for (int i = 0; i < probes; ++i)
        weights += weight[i];
}

Rgb TextureLevels::along(const Image& level, const Line& line, Wrap wrap) const {
    if (line.probes == 1)
        return bilinear(level, line.middle, wrap);
    Rgb sum(0);
    for (int i = 0; i < line.probes; ++i)
        sum += bilinear(level, line.middle + line.half * line.x[i], wrap) * line.weight[i];
    return sum * (1 / line.weights);
}

bool TextureLevels::lookup(const V2f& uv, const V2f& duvdx, const V2f& duvdy, Wrap wrap, Rgb& out) const {
    const Image& finest = m_levels.front();
    // Texels are counted by ints, also those at the end of the longest ellipse.
    const float most = 0x1p30f / float(std::max(finest.width, finest.height)) - kLongest;
    if (wrap == Wrap::Black || !(std::abs(uv.x) < most) || !(std::abs(uv.y) < most))
        return false;
    Axes axes(duvdx, duvdy);
    if (axes.major * float(std::max(finest.width, finest.height)) < .5f) { // all of it between texels
        out = bilinear(finest, uv, wrap);
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
        out = along(finest, line, wrap);
    } else if (level == m_levels.size()) {
        out = along(m_levels.back(), line, wrap);
    } else {
        const float blend = std::clamp(2 * axes.minor * lesserSide(m_levels[level]) - 1, 0.f, 1.f);
        out = along(m_levels[level - 1], line, wrap) * (1 - blend);
        if (blend > 0)
            out += along(m_levels[level], line, wrap) * blend;
    }
    return true;
}

} // namespace strobe
