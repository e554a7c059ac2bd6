#include "lights/infinite.h"

#include "core/image/image.h"
#include "core/math/sampling.h"
#include "lights/environment_map.h"
#include "lights/equal_area.h"
#include "lights/placement.h"

#include <optional>

namespace strobe {

namespace {

const ParamDef<Rgb> kL{"L", Rgb(1), "radiance, or factor of the map"};
const ParamDef<FilePath> kMap{
    "mapname", {}, "latitude-longitude image; none: the same from everywhere", "filename"};

/// From the light's space to the world's and back.
struct Body {
    M44f toWorld, toLight;
    float determinant; ///< absolute, of toWorld

    STROBE_FORCE_INLINE V3f lightDirection(const V3f& d) const {
        const V3f w = transformVector(toLight, d);
        return w * (1 / std::sqrt(length2(w)));
    }
    /// Solid angle in light space over that in the world, for a unit direction that became `w`: 1 unless the
    /// transform scales unevenly.
    STROBE_FORCE_INLINE float distortion(const V3f& w) const {
        const float l2 = length2(w);
        return l2 * std::sqrt(l2) / determinant;
    }
    /// A direction of the light to the world, unit length, its density with it.
    STROBE_FORCE_INLINE V3f worldDirection(const V3f& d, float& pdf) const {
        const V3f w = transformVector(toWorld, d);
        pdf *= distortion(w);
        return w * (1 / std::sqrt(length2(w)));
    }
};

STROBE_TARGET_CLONES void turnToLight(const Body& turn, const V3SoA& d, int n, V3SoA& out) {
    const Body t = turn;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const V3f w = t.lightDirection(d.at(i));
        out.x[i] = w.x, out.y[i] = w.y, out.z[i] = w.z;
    }
}

STROBE_TARGET_CLONES void turnToWorld(const Body& turn, V3SoA& d, int n, float* pdf) {
    const Body t = turn;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        float p = pdf[i];
        const V3f w = t.worldDirection(d.at(i), p);
        d.x[i] = w.x, d.y[i] = w.y, d.z[i] = w.z;
        pdf[i] = p;
    }
}

STROBE_TARGET_CLONES void scale(RgbSoA& c, int n, const Rgb& factor) {
    const float r = factor.x, g = factor.y, b = factor.z;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        c.r[i] *= r, c.g[i] *= g, c.b[i] *= b;
}

class InfiniteLight final : public Light {
  public:
    InfiniteLight(const M44f& toWorld, const Rgb& factor, std::optional<EnvironmentMap> map)
        : m_body{toWorld, toWorld.inverse(), std::abs(determinant3(toWorld))}, m_factor(factor),
          m_map(std::move(map)) {}

    void sample(const V3f&, float, const V2f* u, int n, LightSample* out) const override {
        for (int i = 0; i < n; ++i) {
            if (!m_map) {
                out[i] = {uniformSphere(u[i]), kInfinity, m_factor, kUniformSpherePdf};
                continue;
            }
            EnvironmentMap::Sample s = m_map->sample(u[i]);
            const V3f w = m_body.worldDirection(s.w, s.pdf);
            out[i] = {w, kInfinity, s.radiance * m_factor, s.pdf};
        }
    }
    void sampleSoA(const LightQuerySoA& query, LightSampleSoA& out) const override {
        if (!m_map)
            return Light::sampleSoA(query, out);
        m_map->sampleSoA(query.u, query.n, out.wi, out.radiance, out.pdf);
        turnToWorld(m_body, out.wi, query.n, out.pdf);
        scale(out.radiance, query.n, m_factor);
        std::fill(out.distance, out.distance + query.n, kInfinity);
    }

    float pdf(const V3f&, float, const V3f& wi, const LightHit*) const override {
        if (!m_map)
            return kUniformSpherePdf;
        const V3f w = m_body.lightDirection(wi);
        float pdf = m_map->pdf(w);
        m_body.worldDirection(w, pdf);
        return pdf;
    }

    bool mayIntersect(const V3f&, float, const V3f&) const override { return true; }
    float solidAngle(const V3f&, float) const override { return 4 * kPi; }
    Rgb environment(const V3f& d) const override {
        return m_map ? m_map->radiance(m_body.lightDirection(d)) * m_factor : m_factor;
    }
    void environmentSoA(const V3SoA& d, int n, RgbSoA& radiance, float* pdf) const override {
        if (!m_map)
            return Light::environmentSoA(d, n, radiance, pdf);
        V3SoA w;
        turnToLight(m_body, d, n, w);
        m_map->lookupSoA(w, n, radiance, pdf);
        if (pdf)
            turnToWorld(m_body, w, n, pdf);
        scale(radiance, n, m_factor);
    }
    Rgb power(float radius) const override {
        const Rgb mean = m_map ? m_map->mean() * m_factor : m_factor;
        return mean * (4 * kPi * kPi * radius * radius);
    }
    bool isEnvironment() const override { return true; }

  private:
    Body m_body;
    Rgb m_factor;
    std::optional<EnvironmentMap> m_map;
};

/// Values that no light can have are warned about and become black.
void cleanPixels(Image& image, const Location& where, Diagnostics& messages) {
    size_t bad = 0;
    for (Rgb& c : image.pixels)
        if (!isFinite(c) || c.x < 0 || c.y < 0 || c.z < 0) {
            for (int k = 0; k < 3; ++k)
                c[k] = std::isfinite(c[k]) ? std::max(c[k], 0.f) : 0;
            ++bad;
        }
    if (bad > 0)
        messages.warn(where, std::to_string(bad) +
                                 " pixels of the environment map are negative or not finite; taken as black");
}

std::optional<EnvironmentMap> readMap(const ParamSet& params, const BuildContext& context) {
    if (!params.has(kMap))
        return std::nullopt;
    const Location where = params.whereIs(kMap);
    const std::filesystem::path path = params.get(kMap).path;
    const ColorEncoding usual{context.conventions == Conventions::PbrtV4 ? ColorEncoding::Srgb
                                                                         : ColorEncoding::Linear};
    Image image =
        readImage(path, where, ColorEncoding::fromFileRules(*context.colorConfig, path, where, usual));
    if (image.width < 1 || image.height < 1)
        throw Error(where, "the environment map is empty");
    if (int64_t(image.width) * image.height > kMaxImagePixels)
        throw Error(where, "the environment map has " + std::to_string(image.width) + " x " +
                               std::to_string(image.height) + " pixels: too many");
    cleanPixels(image, where, context.diagnostics);
    if (image.width == image.height && image.width > 1 && context.conventions == Conventions::PbrtV4)
        image = latitudeLongitudeOf(image);
    return EnvironmentMap(std::move(image));
}

/// What light from above gives a horizontal surface, by its luminance.
float illuminanceOf(const EnvironmentMap* map) {
    if (!map)
        return kPi;
    constexpr int kRows = 256;
    double sum = 0;
    for (int i = 0; i < kRows * kRows; ++i) { // equal projected solid angles
        const V3f w = cosineHemisphere({(float(i % kRows) + .5f) / kRows, (float(i / kRows) + .5f) / kRows});
        sum += luminance(map->radiance(w));
    }
    return float(sum * kPi / (kRows * kRows));
}

std::shared_ptr<Light> createInfinite(const ParamSet& params, const BuildContext& context,
                                      const LightArgs& args) {
    const bool v2 = context.conventions == Conventions::PbrtV2;
    if (!v2 && !args.toWorld.isStatic())
        context.diagnostics.warn(params.where(),
                                 "environment lights do not move: the transform at shutter opening is used");
    const M44f toWorld = LightPlacement(args, context.conventions).at(0);
    if (!(std::abs(determinant3(toWorld)) > 0))
        throw Error(params.where(), "the environment light's transform is singular");
    std::optional<EnvironmentMap> map = readMap(params, context);
    Rgb factor = readEmission(params, kL);
    if (params.has(kIlluminance))
        factor *= readTotal(params, kIlluminance, illuminanceOf(map ? &*map : nullptr));
    auto light = std::make_shared<InfiniteLight>(toWorld, factor, std::move(map));
    light->sampleCount = params.get(kLightSamples);
    return light;
}

} // namespace

Plugin<std::shared_ptr<Light>, const LightArgs&> infiniteLightPlugin() {
    return {
        "infinite",
        "light from all directions, constant or from a map: latitude-longitude or (v4, square) equal-area",
        {kL, kLightScale, kIlluminance, kMap, kLightSamples},
        createInfinite};
}

} // namespace strobe
