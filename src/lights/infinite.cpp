#include "lights/infinite.h"

#include "core/image/image.h"
#include "core/math/sampling.h"
#include "lights/environment_map.h"
#include "lights/equal_area.h"
#include "lights/light_image.h"
#include "lights/placement.h"

#include <optional>

namespace strobe {

namespace {

const ParamDef<Rgb> kL{"L", Rgb(1), "radiance, W/(m² sr), or scale of the map"};
const ParamDef<FilePath> kMap{
    "mapname",
    {},
    "environment map: latitude-longitude, or square equal-area (pbrt-v4); none: constant radiance",
    "filename"};

/// The light-to-world transform, its inverse and its effect on solid angles.
struct LightTransform {
    M44f toWorld, toLight;
    float determinant; ///< of toWorld, absolute

    /// Returns the direction in light space, of unit length.
    STROBE_FORCE_INLINE V3f lightDirection(const V3f& d) const {
        const V3f w = transformVector(toLight, d);
        return w * (1 / std::sqrt(length2(w)));
    }
    /// Returns the solid angle in light space over the solid angle in world space for a unit direction in
    /// light space that `toWorld` maps to `w`. It is 1 unless the transform scales non-uniformly.
    STROBE_FORCE_INLINE float solidAngleRatio(const V3f& w) const {
        const float l2 = length2(w);
        return l2 * std::sqrt(l2) / determinant;
    }
    /// Returns the direction in world space, of unit length, and converts its density to world space.
    STROBE_FORCE_INLINE V3f worldDirection(const V3f& d, float& pdf) const {
        const V3f w = transformVector(toWorld, d);
        pdf *= solidAngleRatio(w);
        return w * (1 / std::sqrt(length2(w)));
    }
};

STROBE_TARGET_CLONES void toLightSpace(const LightTransform& transform, const V3SoA& d, int n, V3SoA& out) {
    const LightTransform t = transform;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const V3f w = t.lightDirection(d.at(i));
        out.x[i] = w.x;
        out.y[i] = w.y;
        out.z[i] = w.z;
    }
}

STROBE_TARGET_CLONES void toWorldSpace(const LightTransform& transform, V3SoA& d, int n, float* pdf) {
    const LightTransform t = transform;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        float p = pdf[i];
        const V3f w = t.worldDirection(d.at(i), p);
        d.x[i] = w.x;
        d.y[i] = w.y;
        d.z[i] = w.z;
        pdf[i] = p;
    }
}

STROBE_TARGET_CLONES void scaleRadiance(RgbSoA& c, int n, const Rgb& factor) {
    const float r = factor.x, g = factor.y, b = factor.z;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        c.r[i] *= r;
        c.g[i] *= g;
        c.b[i] *= b;
    }
}

class InfiniteLight final : public Light {
  public:
    InfiniteLight(const M44f& toWorld, const Rgb& radiance, std::optional<EnvironmentMap> map)
        : m_transform{toWorld, toWorld.inverse(), std::abs(determinant3(toWorld))}, m_radiance(radiance),
          m_map(std::move(map)) {}

    void sample(const V3f&, float, const V2f* u, int n, LightSample* out) const override {
        for (int i = 0; i < n; ++i) {
            if (!m_map) {
                out[i] = {uniformSphere(u[i]), kInfinity, m_radiance, kUniformSpherePdf};
                continue;
            }
            EnvironmentMap::Sample s = m_map->sample(u[i]);
            const V3f w = m_transform.worldDirection(s.w, s.pdf);
            out[i] = {w, kInfinity, s.radiance * m_radiance, s.pdf};
        }
    }
    void sampleSoA(const LightQuerySoA& query, LightSampleSoA& out) const override {
        if (!m_map)
            return Light::sampleSoA(query, out);
        m_map->sampleSoA(query.u, query.n, out.wi, out.radiance, out.pdf);
        toWorldSpace(m_transform, out.wi, query.n, out.pdf);
        scaleRadiance(out.radiance, query.n, m_radiance);
        std::fill(out.distance, out.distance + query.n, kInfinity);
    }

    float pdf(const V3f&, float, const V3f& wi, const LightHit*) const override {
        if (!m_map)
            return kUniformSpherePdf;
        const V3f w = m_transform.lightDirection(wi);
        float pdf = m_map->pdf(w);
        m_transform.worldDirection(w, pdf);
        return pdf;
    }

    bool mayIntersect(const V3f&, float, const V3f&) const override { return true; }
    float solidAngle(const V3f&, float) const override { return 4 * kPi; }
    Rgb environment(const V3f& d) const override {
        return m_map ? m_map->radiance(m_transform.lightDirection(d)) * m_radiance : m_radiance;
    }
    void environmentSoA(const V3SoA& d, int n, RgbSoA& radiance, float* pdf) const override {
        if (!m_map)
            return Light::environmentSoA(d, n, radiance, pdf);
        V3SoA w;
        toLightSpace(m_transform, d, n, w);
        m_map->lookupSoA(w, n, radiance, pdf);
        if (pdf)
            toWorldSpace(m_transform, w, n, pdf);
        scaleRadiance(radiance, n, m_radiance);
    }
    Rgb power(float radius) const override {
        const Rgb mean = m_map ? m_map->mean() * m_radiance : m_radiance;
        return mean * (4 * kPi * kPi * radius * radius);
    }
    bool isEnvironment() const override { return true; }

  private:
    LightTransform m_transform;
    Rgb m_radiance; ///< scale of the map if there is one
    std::optional<EnvironmentMap> m_map;
};

/// Replaces channels by zero that are negative, not finite, or larger than a sample may be, with a warning.
void sanitizePixels(Image& image, const Location& where, Diagnostics& diagnostics) {
    constexpr float kMax = 0x1p48f; // of a sample; sums of larger values could overflow
    const auto isValid = [](float value) { return value >= 0 && value < kMax; };
    size_t invalid = 0;
    for (Rgb& c : image.pixels)
        if (!isValid(c.x) || !isValid(c.y) || !isValid(c.z)) {
            for (int k = 0; k < 3; ++k)
                c[k] = isValid(c[k]) ? c[k] : 0;
            ++invalid;
        }
    if (invalid > 0)
        diagnostics.warn(where, std::to_string(invalid) +
                                    " pixels of the environment map are negative, not finite or beyond "
                                    "2.8e14; these values are taken as 0");
}

std::optional<EnvironmentMap> readMap(const ParamSet& params, const BuildContext& context) {
    if (!params.has(kMap))
        return std::nullopt;
    const Location where = params.whereIs(kMap);
    const std::filesystem::path path = params.get(kMap).path;
    Image image = readLightImage(params, kMap, context);
    if (image.width < 1 || image.height < 1)
        throw Error(where, "the environment map is empty");
    if (int64_t(image.width) * image.height > kMaxImagePixels)
        throw Error(where, "the environment map has " + std::to_string(image.width) + " x " +
                               std::to_string(image.height) + " pixels: too many");
    sanitizePixels(image, where, context.diagnostics);
    if (image.width == image.height && image.width > 1 && context.conventions == Conventions::PbrtV4)
        image = toLatitudeLongitude(image);
    return EnvironmentMap(std::move(image));
}

/// Returns the luminance of the irradiance on a horizontal surface that faces +z of light space, for L = 1.
float upwardIlluminance(const EnvironmentMap* map) {
    if (!map)
        return kPi;
    constexpr int kRows = 256;
    double sum = 0;
    for (int i = 0; i < kRows * kRows; ++i) { // stratified by projected solid angle
        const V3f w = cosineHemisphere({(float(i % kRows) + .5f) / kRows, (float(i / kRows) + .5f) / kRows});
        sum += luminance(map->radiance(w));
    }
    return float(sum * kPi / (kRows * kRows));
}

std::shared_ptr<Light> createInfinite(const ParamSet& params, const BuildContext& context,
                                      const LightArgs& args) {
    const bool v2 = context.conventions == Conventions::PbrtV2;
    if (!v2 && !args.toWorld.isStatic())
        context.diagnostics.warn(
            params.where(),
            "motion of environment lights is not supported: the transform at shutter opening is used");
    const M44f toWorld = LightPlacement(args, context.conventions).at(0);
    if (!(std::abs(determinant3(toWorld)) > 0))
        throw Error(params.where(), "the environment light's transform is singular");
    std::optional<EnvironmentMap> map = readMap(params, context);
    Rgb radiance = readEmission(params, kL, context);
    if (params.has(kIlluminance))
        radiance *= scaleToTotal(params, kIlluminance, upwardIlluminance(map ? &*map : nullptr));
    auto light = std::make_shared<InfiniteLight>(toWorld, radiance, std::move(map));
    light->sampleCount = params.get(kLightSamples);
    return light;
}

} // namespace

std::shared_ptr<Light> makeEnvironmentLight(const M44f& toWorld, const Rgb& scale, const Image& map) {
    return std::make_shared<InfiniteLight>(toWorld, scale, EnvironmentMap(map));
}

Plugin<std::shared_ptr<Light>, const LightArgs&> infiniteLightPlugin() {
    return {"infinite",
            "radiance from all directions, constant or from an environment map",
            {kL, kLightScale, kIlluminance, kMap, kLightSamples},
            createInfinite};
}

} // namespace strobe
