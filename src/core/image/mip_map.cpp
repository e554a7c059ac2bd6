#include "core/image/mip_map.h"

#include "core/image/mip_footprints.h"
#include "core/math/fast_math.h"
#include "core/math/simd4.h"

#include <utility>

namespace strobe {

namespace {

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

/// The wrap mode of an axis as operands: to repeat, `repeatMask` has all bits set and `period` is 1; to clamp
/// or to mirror, both are 0.
struct AxisWrap {
    int32_t repeatMask = 0, isMirror = 0;
    float period = 0;

    explicit AxisWrap(Wrap wrap)
        : repeatMask(wrap == Wrap::Repeat ? -1 : 0), isMirror(wrap == Wrap::Mirror ? 1 : 0),
          period(wrap == Wrap::Repeat ? 1.f : 0.f) {}
};

/// Returns the texels at coordinate u of an axis with n texels. `center`: coordinate of the center of a
/// texel, or 0 for the nearest texel.
STROBE_FORCE_INLINE AxisTap axisTap(float u, int n, const AxisWrap& wrap, float center) {
    const int beforeFirst = (n - 1) & wrap.repeatMask;
    const int afterLast = n - 1 - beforeFirst;
    const float phase = u - 2 * float(floorToInt(u * .5f));
    const float mirrored = 1 - std::abs(1 - phase);
    const float inside = wrap.isMirror ? mirrored : u - wrap.period * float(floorToInt(u));
    const float x = inside * float(n) - center;
    const int left = floorToInt(x);
    const int right = left + 1;
    const int leftInside = std::min(left, n - 1);
    const int rightInside = std::max(right, 0);
    const float fraction = x - float(left);
    return {left < 0 ? beforeFirst : leftInside, right < n ? rightInside : afterLast,
            center > 0 ? fraction : 0.f};
}

} // namespace

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
    alignas(64) int32_t width[kMaxLines], height[kMaxLines]; ///< of the level
    alignas(64) int32_t firstTexel[kMaxLines], tileRowStep[kMaxLines], tileStep[kMaxLines],
        rowStep[kMaxLines]; ///< see MipLayout

    Lines() = default;
    Lines(const MipFootprints& f, int begin, int end, const int32_t* isDone);
    void expand(const Lines& lines);
    static void fill(const MipFootprints& f, const V2SoA& uv, const MipMap& mipMap, Lines& lines);

  private:
    void setLine(int line, int32_t lineOwner, int32_t lineLevel, int32_t lineProbes, float lineShare);
};

/// The wrap modes and the interpolation of lookups.
struct MipMap::Wraps {
    AxisWrap u, v;
    float center; ///< see axisTap

    explicit Wraps(const TextureOptions& options)
        : u(options.u), v(options.v), center(options.nearest ? 0 : .5f) {}
};

/// One probe of each line: the indices of the four texels around it, and their weights.
struct MipMap::Taps {
    alignas(64) int32_t texel[4][kMaxLines];
    alignas(64) float weight[4][kMaxLines];

    static void compute(const Lines& lines, int probe, int count, const Wraps& wraps, Taps& out);
};

void MipMap::Lines::setLine(int line, int32_t lineOwner, int32_t lineLevel, int32_t lineProbes,
                            float lineShare) {
    owner[line] = lineOwner;
    level[line] = lineLevel;
    probes[line] = lineProbes;
    share[line] = lineShare;
}

MipMap::Lines::Lines(const MipFootprints& f, int begin, int end, const int32_t* isDone) {
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
STROBE_TARGET_CLONES void MipMap::Lines::fill(const MipFootprints& f, const V2SoA& uv, const MipMap& mipMap,
                                              Lines& lines) {
    const int32_t* width = mipMap.m_width.data();
    const int32_t* height = mipMap.m_height.data();
    const int32_t* firstTexel = mipMap.m_firstTexel.data();
    const int32_t* tileRowStep = mipMap.m_tileRowStep.data();
    const int32_t* tileStep = mipMap.m_tileStep.data();
    const int32_t* rowStep = mipMap.m_rowStep.data();
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
        lines.tileRowStep[k] = tileRowStep[level];
        lines.tileStep[k] = tileStep[level];
        lines.rowStep[k] = rowStep[level];
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
        repeat(lines.tileRowStep, tileRowStep);
        repeat(lines.tileStep, tileStep);
        repeat(lines.rowStep, rowStep);
        for (int i = 0; i < n; ++i, ++count) {
            owner[count] = k;
            firstProbe[count] = float(2 * i + 1);
        }
    }
}

/// Computes the taps of probe number `probe` of the first `count` lines.
STROBE_TARGET_CLONES void MipMap::Taps::compute(const Lines& lines, int probe, int count, const Wraps& wraps,
                                                Taps& out) {
    const float offset = 2 * float(probe);
    const AxisWrap wrapU = wraps.u, wrapV = wraps.v;
    const float center = wraps.center;
    STROBE_IVDEP
    for (int k = 0; k < count; ++k) {
        const float x = (lines.firstProbe[k] + offset) / lines.probeCount[k] - 1;
        const float weight = fastExp(lines.steepness[k] * sqr(x));
        const int32_t first = lines.firstTexel[k];
        const int32_t tileRowStep = lines.tileRowStep[k];
        const int32_t tileStep = lines.tileStep[k];
        const int32_t rowStep = lines.rowStep[k];
        const AxisTap u = axisTap(lines.x[k] + lines.halfX[k] * x, lines.width[k], wrapU, center);
        const AxisTap v = axisTap(lines.y[k] + lines.halfY[k] * x, lines.height[k], wrapV, center);
        const int32_t upperRow = first + (v.first >> 6) * tileRowStep + (v.first & 63) * rowStep;
        const int32_t lowerRow = first + (v.second >> 6) * tileRowStep + (v.second & 63) * rowStep;
        const int32_t leftColumn = (u.first >> 6) * tileStep + (u.first & 63);
        const int32_t rightColumn = (u.second >> 6) * tileStep + (u.second & 63);
        out.texel[0][k] = upperRow + leftColumn;
        out.texel[1][k] = upperRow + rightColumn;
        out.texel[2][k] = lowerRow + leftColumn;
        out.texel[3][k] = lowerRow + rightColumn;
        const float upper = weight * (1 - v.x);
        const float lower = weight * v.x;
        out.weight[0][k] = upper * (1 - u.x);
        out.weight[1][k] = upper * u.x;
        out.weight[2][k] = lower * (1 - u.x);
        out.weight[3][k] = lower * u.x;
    }
}

void MipMap::setLevels(const MipLayout& layout) {
    for (const MipLayout::Level& level : layout.levels) {
        m_width.push_back(level.width);
        m_height.push_back(level.height);
        m_firstTexel.push_back(level.first);
        m_tileRowStep.push_back(level.tileRowStep);
        m_tileStep.push_back(level.tileStep);
        m_rowStep.push_back(level.rowStep);
        m_shorterSide.push_back(float(std::min(level.width, level.height)));
    }
    m_longerSide = std::max(m_width.front(), m_height.front());
}

MipMap::MipMap(const std::vector<Image>& levels) {
    MipLayout layout;
    for (const Image& level : levels)
        layout.add(level.width, level.height, false);
    m_memory = std::make_unique<TexelMemory>(layout.texels * sizeof(Texel));
    auto* texel = reinterpret_cast<Texel*>(m_memory->data());
    for (const Image& level : levels)
        for (const Rgb& c : level.pixels)
            *texel++ = {{c.x, c.y, c.z, 1}};
    setLevels(layout);
}

MipMap::MipMap(const MipLayout& layout, std::unique_ptr<TexelMemory> texels,
               std::shared_ptr<const TexelCodec> codec, int channels)
    : m_channels(channels), m_memory(std::move(texels)), m_codec(std::move(codec)) {
    setLevels(layout);
}

namespace {

/// Returns texel number i as red, green, blue, 1. `values`: by code; not used for floats.
template <class Code, int Channels>
STROBE_FORCE_INLINE Float4 texelAt(const Code* codes, const float* values, int32_t i) {
    const Code* code = codes + size_t(i) * Channels;
    if constexpr (Channels == 4)
        return loadFloat4(code);
    else {
        const auto value = [&](int channel) {
            if constexpr (std::is_same_v<Code, float>)
                return code[channel];
            else
                return values[code[channel]];
        };
        constexpr int kLast = Channels - 1;
        return Float4{value(0), value(kLast / 2), value(kLast), 1};
    }
}

} // namespace

template <class Code, int Channels>
void MipMap::addTexels(const Taps& taps, int k, Texel& sum) const {
    const auto* codes = reinterpret_cast<const Code*>(m_memory->data());
    const float* values = m_codec ? m_codec->values().data() : nullptr;
    if (m_memory->isInFile())
        for (int tap = 0; tap < 4; ++tap)
            m_memory->touch(size_t(taps.texel[tap][k]) * (Channels * sizeof(Code)));
    const auto weighted = [&](int tap) {
        return texelAt<Code, Channels>(codes, values, taps.texel[tap][k]) * taps.weight[tap][k];
    };
    storeFloat4(sum.values,
                loadFloat4(sum.values) + ((weighted(0) + weighted(1)) + (weighted(2) + weighted(3))));
}

template <class Code, int Channels>
void MipMap::sumProbes(const Lines& lines, const Wraps& wraps, Texel* sums) const {
    constexpr int kFewLines = 2; // a single lookup
    Taps taps;
    std::fill_n(sums, lines.count, Texel{});
    if (lines.count <= kFewLines) { // vectorizes over all probes of all lines
        Lines probes;
        probes.expand(lines);
        Taps::compute(probes, 0, probes.count, wraps, taps);
        for (int k = 0; k < probes.count; ++k)
            addTexels<Code, Channels>(taps, k, sums[probes.owner[k]]);
        return;
    }
    for (int probe = 0, left = lines.count;; ++probe) { // vectorizes over lines
        while (left > 0 && lines.probes[left - 1] <= probe)
            --left;
        if (left == 0)
            return;
        Taps::compute(lines, probe, left, wraps, taps);
        for (int k = 0; k < left; ++k)
            addTexels<Code, Channels>(taps, k, sums[k]);
    }
}

void MipMap::lookupSoA(const TexturePointSoA& points, int begin, int end, const TextureOptions& options,
                       RgbSoA& out, int32_t* isDone) const {
    if (options.u == Wrap::Black || options.v == Wrap::Black)
        return std::fill(isDone + begin, isDone + end, 0);
    MipFootprints footprints;
    const int levels = int(m_width.size());
    const float side = float(m_longerSide);
    MipFootprints::measure(points, begin, end, side, isDone, footprints);
    MipFootprints::findLevels(m_shorterSide.data(), levels, begin, end, footprints);
    MipFootprints::findProbes(m_shorterSide.data(), levels, side, begin, end, footprints);
    Lines lines(footprints, begin, end, isDone);
    Lines::fill(footprints, points.uv, *this, lines);

    Texel sums[kMaxLines];
    const Wraps wraps(options);
    if (!m_codec)
        sumProbes<float, 4>(lines, wraps, sums);
    else if (m_codec->kind() == TexelCodec::Byte)
        sumProbes<uint8_t>(lines, wraps, sums);
    else if (m_codec->kind() == TexelCodec::Float)
        sumProbes<float>(lines, wraps, sums);
    else
        sumProbes<uint16_t>(lines, wraps, sums);
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

bool MipMap::lookup(const V2f& uv, const V2f& duvdx, const V2f& duvdy, const TextureOptions& options,
                    Rgb& out) const {
    TexturePointSoA point;
    RgbSoA color;
    int32_t isDone;
    point.uv.set(0, uv);
    point.duvdx.set(0, duvdx);
    point.duvdy.set(0, duvdy);
    lookupSoA(point, 0, 1, options, color, &isDone);
    out = color.at(0);
    return isDone;
}

namespace {

/// Returns a coordinate near the image with the same value, and black: sets isInside to false outside.
float nearImage(float u, Wrap wrap, bool& isInside) {
    if (!std::isfinite(u))
        return 0;
    isInside &= wrap != Wrap::Black || (u >= 0 && u <= 1);
    if (wrap == Wrap::Repeat)
        return u - std::floor(u);
    if (wrap == Wrap::Mirror)
        return u - 2 * std::floor(u / 2);
    return std::clamp(u, -1.f, 2.f);
}

/// Limits the length of an axis of a footprint: the mean of the image is the same for all large ones.
V2f limited(const V2f& axis) {
    constexpr float kMax = 100;
    const float longest = std::max(std::abs(axis.x), std::abs(axis.y));
    if (!std::isfinite(longest))
        return V2f(kMax, 0);
    return longest > kMax ? axis * (kMax / longest) : axis;
}

} // namespace

Rgb MipMap::lookupAnywhere(V2f uv, V2f duvdx, V2f duvdy, TextureOptions options) const {
    bool isInside = true;
    uv = {nearImage(uv.x, options.u, isInside), nearImage(uv.y, options.v, isInside)};
    if (!isInside)
        return Rgb(0);
    options.u = options.u == Wrap::Black ? Wrap::Clamp : options.u;
    options.v = options.v == Wrap::Black ? Wrap::Clamp : options.v;
    Rgb out(0);
    lookup(uv, limited(duvdx), limited(duvdy), options, out);
    return out;
}

} // namespace strobe
