// The "metallicroughness" material: the metallic-roughness model of glTF 2.0.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"
#include "materials/normals.h"

#include <optional>

namespace strobe {

/// The inputs of the material. Names, ranges and defaults are those of glTF 2.0 (appendix B of the
/// specification) and of the extensions KHR_materials_ior, _specular, _transmission, _clearcoat, _sheen,
/// _anisotropy and _iridescence.
struct MetallicRoughnessInputs {
    RgbInput baseColor{Rgb(1)};
    FloatInput metallic{1}, roughness{1};
    std::optional<FloatInput> vRoughness; ///< along dp/dv; `roughness` is then that along dp/du
    /// A texture whose green channel scales the roughness and whose blue channel scales the metalness, or
    /// null.
    std::shared_ptr<const Texture> packed;
    FloatInput ior{1.5f};
    FloatInput specular{1};
    RgbInput specularColor{Rgb(1)};
    FloatInput transmission{0};
    /// Light of the diffuse body passes the smooth boundary of the dielectric twice, at the angles of wo and
    /// of wi, as below a coat. Ignored where there is a clearcoat. False: glTF's mix, by the angle between wo
    /// and the half vector.
    bool bodyBelowBoundary = false;
    FloatInput clearcoat{0}, clearcoatRoughness{0};
    /// A texture of tangent-space normals of the clearcoat, relative to the shading normal; null: none.
    /// `scale` multiplies their tilt.
    std::shared_ptr<const Texture> clearcoatNormals;
    float clearcoatNormalScale = 1;
    RgbInput sheenColor{Rgb(0)};
    FloatInput sheenRoughness{0};
    /// KHR_materials_anisotropy: stretches the gloss along a direction, by `anisotropyRotation` radians from
    /// dp/du, counter-clockwise. The texture, or null, has the direction in red and green, and a factor of
    /// the strength in blue.
    float anisotropy = 0, anisotropyRotation = 0;
    std::shared_ptr<const Texture> anisotropyMap;
    /// KHR_materials_iridescence: the weight, the index and the thickness in nm of a thin film on the base.
    FloatInput iridescence{0};
    float iridescenceIor = 1.3f;
    FloatInput iridescenceThickness{400};
    NormalsPtr normals; ///< null: the interpolated normals
};

/// Creates the material: a two-sided sum of a diffuse lobe, a GGX reflection with separable Smith masking,
/// the transmission of an infinitely thin wall, and a GGX clearcoat on top, with Schlick's Fresnel terms.
/// GGX's alpha is the square of the roughness; an alpha below 0.001 is a perfect mirror. Inputs out of range
/// are clamped during evaluation.
std::shared_ptr<const Material> makeMetallicRoughness(const MetallicRoughnessInputs& inputs);

/// The plugin of the scene language, with the inputs as parameters.
Plugin<std::shared_ptr<const Material>> metallicRoughnessPlugin();

} // namespace strobe
