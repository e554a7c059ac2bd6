#include "sharing/records/light_units.h"

#include "core/film/pixel_accumulator.h"

#include <bit>

namespace strobe {

namespace {

/// An albedo below this is black: it carries no light to other points.
constexpr float kBlack = 1e-4f;
/// Light above this is special: its units may have more than 51 bits.
constexpr float kMaxLight = 1 << 10;

STROBE_FORCE_INLINE float max3(float a, float b, float c) { return std::max(std::max(a, b), c); }

STROBE_FORCE_INLINE float scaleOf(float r, float g, float b, float clamp) {
    const float maxChannel = max3(r, g, b);
    return clamp > 0 && maxChannel > clamp ? clamp / maxChannel : 1;
}

STROBE_FORCE_INLINE float ratio(float light, float albedo) { return albedo > kBlack ? light / albedo : 0; }

STROBE_FORCE_INLINE float rareShareOf(float brightness, float limit) {
    return brightness > limit ? 1 - limit / brightness : 0;
}

/// Returns 1 if x is a small number, else 0: an integer, which is combined without branches.
STROBE_FORCE_INLINE int isSmall(float x) { return std::abs(x) < kMaxLight ? 1 : 0; }

/// The quantities of LightUnits as floats.
struct Quantities {
    alignas(64) float of[LightUnits::kQuantities][kSoAWidth];
};

/// Writes which samples count, and their values and albedos.
STROBE_TARGET_CLONES void findValues(const LightSoA& in, float clamp, int count, float* scales,
                                     Quantities& out, LightUnits& units) {
    constexpr float kMax = float(PixelAccumulator::kMaxValue), kMaxAlbedo = CellUse::kMaxAlbedo;
    STROBE_IVDEP
    for (int i = 0; i < count; ++i) {
        const float r = in.radiance.r[i], g = in.radiance.g[i], b = in.radiance.b[i], w = in.weight[i];
        const float scale = scaleOf(r, g, b, clamp);
        const float value = w * scale * (r + g + b) / 3;
        const int isCounted =
            int(std::abs(r * w) < kMax) & int(std::abs(g * w) < kMax) & int(std::abs(b * w) < kMax);
        scales[i] = scale;
        out.of[LightUnits::kValue][i] = value;
        units.isCounted[i] = isCounted;
        units.isRecorded[i] = isCounted ? in.hasVertex[i] : 0;
        units.isSpecial[i] = isSmall(value) ? 0 : units.isCounted[i];
        const float ar = in.albedo.r[i] * w, ag = in.albedo.g[i] * w, ab = in.albedo.b[i] * w;
        out.of[LightUnits::kAlbedo][i] = std::max(-kMaxAlbedo, std::min(kMaxAlbedo, ar)); // NaN is the limit
        out.of[LightUnits::kAlbedo + 1][i] = std::max(-kMaxAlbedo, std::min(kMaxAlbedo, ag));
        out.of[LightUnits::kAlbedo + 2][i] = std::max(-kMaxAlbedo, std::min(kMaxAlbedo, ab));
    }
}

/// Writes the light of a part.
STROBE_TARGET_CLONES void findPart(const LightSoA& in, int part, float rareLimit, const float* scales,
                                   int count, Quantities& out, LightUnits& units) {
    const RgbSoA& light = in.parts[part];
    float(*divided)[kSoAWidth] = &out.of[LightUnits::kLight + 3 * part];
    float(*reflected)[kSoAWidth] = &out.of[LightUnits::kReflected + 3 * part];
    STROBE_IVDEP
    for (int i = 0; i < count; ++i) {
        const float ar = in.albedo.r[i], ag = in.albedo.g[i], ab = in.albedo.b[i], w = in.weight[i];
        const float r = ratio(light.r[i], ar) * scales[i], g = ratio(light.g[i], ag) * scales[i],
                    b = ratio(light.b[i], ab) * scales[i];
        const float rr = ar * w * r, rg = ag * w * g, rb = ab * w * b;
        const bool isRare = max3(ar * r, ag * g, ab * b) > rareLimit;
        const int isUsual =
            isSmall(r) & isSmall(g) & isSmall(b) & isSmall(rr) & isSmall(rg) & isSmall(rb) & int(!isRare);
        units.isSpecial[i] = isUsual ? units.isSpecial[i] : units.isCounted[i];
        divided[0][i] = r;
        divided[1][i] = g;
        divided[2][i] = b;
        reflected[0][i] = rr;
        reflected[1][i] = rg;
        reflected[2][i] = rb;
    }
}

/// Writes x * perUnit, rounded, where the mask is not 0, and else 0. Precondition: the result has at most 51
/// bits.
STROBE_TARGET_CLONES void quantize(const float* x, double perUnit, const uint32_t* mask, int count,
                                   int64_t* out) {
    constexpr double kMagic = 0x1.8p52; // x + kMagic has the integer in its lowest bits
    STROBE_IVDEP
    for (int i = 0; i < count; ++i) {
        const float kept = mask[i] ? x[i] : 0;
        out[i] = std::bit_cast<int64_t>(double(kept) * perUnit + kMagic) - std::bit_cast<int64_t>(kMagic);
    }
}

} // namespace

void findLightUnits(const LightSoA& light, const LightLimits& limits, int count, LightUnits& out) {
    Quantities quantities;
    alignas(64) float scales[kSoAWidth];
    findValues(light, limits.clamp, count, scales, quantities, out);
    for (int part = 0; part < kParts; ++part)
        findPart(light, part, limits.rare.of[part], scales, count, quantities, out);
    alignas(64) uint32_t isUsual[kSoAWidth], isUsualVertex[kSoAWidth];
    for (int i = 0; i < count; ++i) {
        isUsual[i] = out.isCounted[i] & ~out.isSpecial[i];
        isUsualVertex[i] = isUsual[i] & out.isRecorded[i];
    }
    for (int k = 0; k < LightUnits::kQuantities; ++k) {
        const bool isAlbedo = k >= LightUnits::kAlbedo && k < LightUnits::kCellCount;
        quantize(quantities.of[k], isAlbedo ? double(1 << CellUse::kAlbedoBits) : FixedPointSum::kPerUnit,
                 isAlbedo                  ? out.isRecorded
                 : k == LightUnits::kValue ? isUsual
                                           : isUsualVertex,
                 count, out.of[k]);
    }
}

SampleLight::SampleLight(const LightSoA& in, const LightLimits& limits, int i) {
    const Rgb radiance = in.radiance.at(i), unweighted = in.albedo.at(i);
    scale = scaleOf(radiance.x, radiance.y, radiance.z, limits.clamp);
    value = in.weight[i] * scale * (radiance.x + radiance.y + radiance.z) / 3;
    albedo = unweighted * in.weight[i];
    for (int part = 0; part < kParts; ++part) {
        const Rgb whole = in.parts[part].at(i);
        for (int c = 0; c < 3; ++c)
            light[part][c] = ratio(whole[c], unweighted[c]) * scale;
        const Rgb visible = unweighted * light[part];
        rare[part] = light[part] * rareShareOf(max3(visible.x, visible.y, visible.z), limits.rare.of[part]);
        light[part] -= rare[part];
    }
}

} // namespace strobe
