#include "lights/goniometric.h"

#include "lights/delta.h"
#include "lights/equal_area.h"
#include "lights/light_image.h"
#include "lights/placement.h"

#include <optional>

namespace strobe {
namespace {

const ParamDef<Rgb> kI{"I", Rgb(1), "radiant intensity where the image is 1, W/sr"};
const ParamDef<FilePath> kImage{
    "mapname",
    {},
    "image of the intensity over the directions: latitude-longitude, or square equal-area (pbrt-v4); none: 1",
    "filename"};

/// Intensities over the sphere of directions.
class IntensityMap {
  public:
    /// `equalArea`: the image is an equal-area map; else latitude-longitude.
    IntensityMap(Image image, bool equalArea) : m_image(std::move(image)), m_isEqualArea(equalArea) {}
    /// Returns the intensity in a unit direction of light space.
    Rgb at(const V3f& w) const {
        const V3f up(w.x, w.z, w.y); // the maps have z up
        if (m_isEqualArea)
            return equalAreaLookup(m_image, equalAreaPoint(up));
        const float phi = std::atan2(up.y, up.x) * (kInvPi / 2);
        return bilinear(m_image, {phi < 0 ? phi + 1 : phi, std::acos(std::clamp(up.z, -1.f, 1.f)) * kInvPi},
                        Wrap::Repeat);
    }
    /// Returns the mean over all directions.
    Rgb mean() const {
        Rgb sum(0);
        float weights = 0;
        for (int y = 0; y < m_image.height; ++y) {
            const float row = std::sin((float(y) + .5f) / float(m_image.height) * kPi);
            const float weight = m_isEqualArea ? 1 : row;
            for (int x = 0; x < m_image.width; ++x)
                sum += m_image.at(x, y) * weight;
            weights += weight * float(m_image.width);
        }
        return sum / weights;
    }

  private:
    Image m_image;
    bool m_isEqualArea;
};

class GoniometricLight final : public DeltaLight {
  public:
    GoniometricLight(const LightPlacement& placement, const Rgb& intensity, std::optional<IntensityMap> map)
        : m_placement(placement), m_intensity(intensity), m_map(std::move(map)),
          m_mean(m_map ? m_map->mean() : Rgb(1)) {}
    LightSample deltaSample(const V3f& p, float time) const override {
        const M44f m = m_placement.at(time);
        LightSample s = fromPoint(p, transformPoint(m, V3f(0)), m_intensity);
        if (m_map)
            s.radiance *= m_map->at(normalizeAny(transformVector(m.inverse(), -s.wi)));
        return s;
    }
    Rgb power(float) const override { return m_intensity * m_mean * (4 * kPi); }
    std::optional<EmitterBounds> emitterBounds(uint32_t, float begin, float end) const override {
        EmitterBounds bounds;
        bounds.intensity = rootMeanSquare(m_intensity * m_mean);
        m_placement.bound(V3f(0), V3f(0, 0, 1), kPi, begin, end, bounds);
        return bounds;
    }

  private:
    LightPlacement m_placement;
    Rgb m_intensity;
    std::optional<IntensityMap> m_map;
    Rgb m_mean;
};

std::shared_ptr<Light> create(const ParamSet& params, const BuildContext& context, const LightArgs& args) {
    std::optional<IntensityMap> map;
    if (params.has(kImage)) {
        Image image = readLightImage(params, kImage, context);
        const bool isEqualArea = image.width == image.height && context.pbrtVersion == 4;
        map.emplace(std::move(image), isEqualArea);
    }
    const float mean = map ? luminance(map->mean()) : 1;
    const Rgb intensity =
        readEmission(params, kI, context) * scaleToTotal(params, kPower, 4 * kPi * std::max(mean, 1e-20f));
    auto light = std::make_shared<GoniometricLight>(LightPlacement(args, context.conventions), intensity,
                                                    std::move(map));
    light->sampleCount = params.get(kLightSamples);
    return light;
}

} // namespace

Plugin<std::shared_ptr<Light>, const LightArgs&> goniometricLightPlugin() {
    return {"goniometric",
            "point light with an image of its intensity over all directions",
            {kI, kLightScale, kPower, kImage, kLightSamples},
            create};
}

} // namespace strobe
