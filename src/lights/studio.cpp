#include "lights/studio.h"

#include "core/image/image.h"
#include "lights/environment_map.h"
#include "lights/infinite.h"
#include "lights/placement.h"

namespace strobe {
namespace {

const ParamDef<Rgb> kL{"L", Rgb(1), "scale of the radiance"};

/// A soft light of the studio.
struct Softbox {
    V3f direction;      ///< towards the light; unit
    Rgb radiance;       ///< in its middle
    float inner, outer; ///< angles in radians: full radiance up to `inner`, none beyond `outer`
};

float smoothStep(float edge0, float edge1, float x) {
    const float t = std::clamp((x - edge0) / (edge1 - edge0), 0.f, 1.f);
    return t * t * (3 - 2 * t);
}

Rgb mixed(const Rgb& a, const Rgb& b, float t) { return a * (1 - t) + b * t; }

/// Returns the radiance from a direction; y is up, z the front.
Rgb studioRadiance(const V3f& w) {
    const Rgb floorNear(.16f, .155f, .15f), floorFar(.34f, .34f, .34f), horizon(.82f, .84f, .86f),
        zenith(.30f, .34f, .40f);
    static const Softbox boxes[] = {
        {normalize(V3f(-.75f, .8f, .75f)), Rgb(15.5f, 14.8f, 13.9f), radians(12), radians(20)},
        {normalize(V3f(1, .35f, .5f)), Rgb(1.6f, 1.75f, 2.f), radians(14), radians(24)},
        {normalize(V3f(.35f, .75f, -1)), Rgb(5, 5.2f, 5.6f), radians(8), radians(14)}};
    constexpr float kSoftHorizon = .02f; // sine of the elevation
    const Rgb below = mixed(floorFar, floorNear, std::sqrt(std::clamp(-w.y, 0.f, 1.f)));
    const Rgb above = mixed(horizon, zenith, std::sqrt(std::clamp(w.y, 0.f, 1.f)));
    Rgb sum = mixed(below, above, smoothStep(-kSoftHorizon, kSoftHorizon, w.y));
    for (const Softbox& box : boxes) {
        const float angle = std::acos(std::clamp(dot(w, box.direction), -1.f, 1.f));
        sum += box.radiance * (1 - smoothStep(box.inner, box.outer, angle));
    }
    return sum;
}

/// Returns the studio as the map of a light whose z axis is up.
Image studioImage() {
    constexpr int kWidth = 512, kHeight = 256;
    Image image{kWidth, kHeight, {}};
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            const float theta = (float(y) + .5f) / kHeight * kPi, phi = (float(x) + .5f) / kWidth * 2 * kPi;
            const V3f w(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
            image.pixels.push_back(studioRadiance({w.x, w.z, -w.y}));
        }
    return image;
}

std::shared_ptr<Light> createStudio(const ParamSet& params, const BuildContext& context,
                                    const LightArgs& args) {
    // The map's z is the studio's y, and its y is the studio's -z.
    const M44f zUp(1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1);
    const M44f toWorld = zUp * LightPlacement(args, context.conventions).at(0);
    auto light = makeEnvironmentLight(toWorld, params.get(kL) * params.get(kLightScale), studioImage());
    light->sampleCount = params.get(kLightSamples);
    return light;
}

} // namespace

Plugin<std::shared_ptr<Light>, const LightArgs&> studioLightPlugin() {
    return {"studio",
            "gray floor, gradient sky and three soft lights; y is up: the default light of glTF files",
            {kL, kLightScale, kLightSamples},
            createStudio};
}

} // namespace strobe
