#include "lights/diffuse_area.h"

#include "core/image/image.h"
#include "lights/emission.h"
#include "lights/light_image.h"
#include "lights/mesh_light.h"
#include "lights/placement.h"
#include "lights/quadric_light.h"
#include "lights/sphere_light.h"

namespace strobe {

namespace {

const ParamDef<Rgb> kL{"L", Rgb(1), "emitted radiance, W/(m² sr)"};
const ParamDef<RgbInput> kTexture{"texture", Rgb(1), "texture that scales L; meshes only"};
const ParamDef<FilePath> kImage{
    "filename",
    {},
    "image of the radiance over the shape's texture coordinates; of quadrics, its mean is used"};
const ParamDef<bool> kTwoSided{"twosided", false,
                               "emission on both sides instead of the side of the surface normal only"};

/// Creates the light for the type of the shape.
std::shared_ptr<SurfaceLight> makeLight(const PlacedShape& shape, const Emission& emission) {
    if (shape.shape.mesh)
        return makeMeshLight(shape, emission);
    return isSphereAtAllTimes(shape) ? makeSphereLight(shape, emission) : makeQuadricLight(shape, emission);
}

/// Returns whether the light is an invisible sphere, of which pbrt samples the near side only: the far side
/// is not seen through it.
bool isInvisibleSphere(const Shape& shape) {
    return shape.mesh && shape.mesh->isSphere && shape.mesh->isInvisible();
}

/// Warns if the shape has cutouts (alpha), which light sampling does not support.
void warnOfCutouts(const PlacedShape& shape, const ParamSet& params, Diagnostics& diagnostics) {
    if (!shape.shape.mesh)
        return;
    const FloatInput& alpha = shape.shape.mesh->alpha;
    if (alpha.texture || (alpha.constant > 0 && alpha.constant < 1))
        diagnostics.warn(params.where(), "the alpha of the shape is ignored when its light is sampled");
}

/// An image over texture coordinates, interpolated bilinearly. Row 0 is at v = 1; it does not repeat.
class ImageEmission final : public Texture {
  public:
    explicit ImageEmission(Image image) : m_image(std::move(image)) {}
    Rgb rgb(const TextureQuery& q) const override {
        return bilinear(m_image, {q.uv.x, 1 - q.uv.y}, Wrap::Clamp);
    }
    Rgb mean() const {
        Rgb sum(0);
        for (const Rgb& c : m_image.pixels)
            sum += c / float(m_image.pixels.size());
        return sum;
    }

  private:
    Image m_image;
};

/// Multiplies the emission by the image "filename"; for shapes other than meshes by its mean, with a warning.
void applyImage(const ParamSet& params, const BuildContext& context, const AreaLightArgs& args,
                Emission& emission) {
    if (emission.texture)
        throw Error(params.whereIs(kImage), "an area light has either \"texture\" or \"filename\"");
    auto image = std::make_shared<const ImageEmission>(readLightImage(params, kImage, context));
    if (args.shape.shape.mesh) {
        emission.texture = std::move(image);
        return;
    }
    context.diagnostics.warnOnce("area light image", params.whereIs(kImage),
                                 "images on area lights are supported on meshes only: the mean is used");
    emission.radiance *= image->mean();
}

std::shared_ptr<Light> createDiffuse(const ParamSet& params, const BuildContext& context,
                                     const AreaLightArgs& args) {
    const bool twoSided = params.get(kTwoSided) && !isInvisibleSphere(args.shape.shape);
    Emission emission{readEmission(params, kL, context), twoSided, params.get(kTexture).texture};
    if (emission.texture && !args.shape.shape.mesh)
        throw Error(params.whereIs(kTexture), "\"texture\" is supported on meshes only");
    if (params.has(kImage))
        applyImage(params, context, args, emission);
    std::shared_ptr<SurfaceLight> light = makeLight(args.shape, emission);
    if (params.has(kPower) && light->area() > 0) {
        emission.radiance *=
            scaleToTotal(params, kPower, luminance(Emission{Rgb(1), emission.twoSided}.power(light->area())));
        light = makeLight(args.shape, emission);
    }
    if (!(light->area() > 0))
        throw Error(params.where(), "area light on a shape of zero area");
    if (!std::isfinite(light->area()))
        throw Error(params.where(), "area light on a shape of infinite or undefined area");
    warnOfCutouts(args.shape, params, context.diagnostics);
    light->sampleCount = params.get(kLightSamples);
    return light;
}

} // namespace

Plugin<std::shared_ptr<Light>, const AreaLightArgs&> diffuseAreaLightPlugin() {
    return {"diffuse",
            "radiance L from every point of a shape",
            {kL, kLightScale, kPower, kTexture, kTwoSided, kImage, kLightSamples},
            createDiffuse};
}

} // namespace strobe
