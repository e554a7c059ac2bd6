#include "lights/projection.h"

#include "lights/delta.h"
#include "lights/light_image.h"
#include "lights/placement.h"

namespace strobe {
namespace {

const ParamDef<Rgb> kI{"I", Rgb(1), "radiant intensity where the image is 1, W/sr"};
const ParamDef<FilePath> kImage{"mapname", {}, "image that is projected", "filename"};
const ParamDef<float> kFov{
    "fov", 90, "angle of view of the shorter side of the image, in degrees; pbrt-v2 and v3: 45 by default"};

class ProjectionLight final : public DeltaLight {
  public:
    /// `fov` in radians. `flip`: the first row of the image is on the side of -y.
    ProjectionLight(const LightPlacement& placement, Image image, float fov, bool flip)
        : m_placement(placement), m_image(std::move(image)), m_flipsY(flip) {
        const float aspect = float(m_image.width) / float(m_image.height), tangent = std::tan(fov / 2);
        m_extent = V2f(tangent * std::max(aspect, 1.f), tangent * std::max(1 / aspect, 1.f));
        m_total = total();
    }
    /// Returns the flux for an intensity of 1.
    const Rgb& unitPower() const { return m_total; }
    void setIntensity(const Rgb& intensity) { m_intensity = intensity; }

    LightSample deltaSample(const V3f& p, float time) const override {
        const M44f m = m_placement.at(time);
        LightSample s = fromPoint(p, transformPoint(m, V3f(0)), m_intensity);
        s.radiance *= at(transformVector(m.inverse(), -s.wi));
        return s;
    }
    Rgb power(float) const override { return m_intensity * m_total; }
    /// Bounds the emission by the cone around the image.
    std::optional<EmitterBounds> emitterBounds(uint32_t, float begin, float end) const override {
        EmitterBounds bounds;
        const float coneAngle = std::atan(m_extent.length()),
                    solidAngle = 4 * sqr(std::sin(coneAngle / 2)) * kPi;
        bounds.emission = kMargin;
        bounds.intensity = rootMeanSquare(power(0)) / solidAngle;
        m_placement.bound(V3f(0), V3f(0, 0, 1), std::min(coneAngle + kMargin, kPi), begin, end, bounds);
        return bounds;
    }

  private:
    static constexpr float kMargin = 1e-3f; ///< of the emission's cone, radians

    /// Returns the image in a direction of light space; black outside of it.
    Rgb at(const V3f& w) const {
        if (!(w.z > 0))
            return Rgb(0);
        const V2f q(w.x / (w.z * m_extent.x), w.y / (w.z * m_extent.y)); // the image is [-1,1]²
        if (!(std::abs(q.x) <= 1 && std::abs(q.y) <= 1))
            return Rgb(0);
        return bilinear(m_image, {(1 + q.x) / 2, (m_flipsY ? 1 + q.y : 1 - q.y) / 2}, Wrap::Clamp);
    }
    /// Returns the integral of the image over solid angle: that of a pixel is its area at z = 1 times cos³.
    Rgb total() const {
        Rgb sum(0);
        for (int y = 0; y < m_image.height; ++y)
            for (int x = 0; x < m_image.width; ++x) {
                const V2f q((2 * float(x) + 1) / float(m_image.width) - 1,
                            (2 * float(y) + 1) / float(m_image.height) - 1);
                const float secant2 = 1 + sqr(q.x * m_extent.x) + sqr(q.y * m_extent.y);
                sum += m_image.at(x, y) * (1 / (secant2 * std::sqrt(secant2)));
            }
        return sum * (4 * m_extent.x * m_extent.y / float(m_image.pixels.size()));
    }

    LightPlacement m_placement;
    Image m_image;
    bool m_flipsY;
    V2f m_extent; ///< half of the width and of the height of the image at z = 1
    Rgb m_total;
    Rgb m_intensity{1};
};

std::shared_ptr<Light> create(const ParamSet& params, const BuildContext& context, const LightArgs& args) {
    const bool isOld = context.pbrtVersion < 4;
    const float fov = params.has(kFov) ? params.get(kFov) : isOld ? 45 : kFov.fallback;
    if (!(fov > 0 && fov < 180))
        throw Error(params.whereIs(kFov), "\"fov\" must be above 0 and below 180 degrees");
    Image image = params.has(kImage) || !isOld
                      ? (params.require(kImage), readLightImage(params, kImage, context))
                      : Image{1, 1, {Rgb(1)}}; // v2 and v3: a square of light
    auto light = std::make_shared<ProjectionLight>(LightPlacement(args, context.conventions),
                                                   std::move(image), radians(fov), isOld);
    light->setIntensity(readEmission(params, kI, context) *
                        scaleToTotal(params, kPower, std::max(luminance(light->unitPower()), 1e-20f)));
    light->sampleCount = params.get(kLightSamples);
    return light;
}

} // namespace

Plugin<std::shared_ptr<Light>, const LightArgs&> projectionLightPlugin() {
    return {"projection",
            "slide projector: point light that projects an image",
            {kI, kLightScale, kPower, kImage, kFov, kLightSamples},
            create};
}

} // namespace strobe
