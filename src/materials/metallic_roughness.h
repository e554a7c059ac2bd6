// glTF's metallic-roughness material.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"

namespace strobe {

/// What the material is made of, at each point. Names, ranges and defaults are glTF's (appendix B of its
/// specification, and the extensions KHR_materials_ior, _specular, _transmission and _clearcoat).
struct MetallicRoughnessInputs {
    RgbInput baseColor{Rgb(1)};
    FloatInput metallic{1}, roughness{1};
    /// A texture whose green channel multiplies the roughness and whose blue one the metalness; or none.
    std::shared_ptr<const Texture> packed;
    FloatInput ior{1.5f};
    FloatInput specular{1};
    RgbInput specularColor{Rgb(1)};
    FloatInput transmission{0};
    FloatInput clearcoat{0}, clearcoatRoughness{0};
    /// Tangent-space normals: (0.5, 0.5, 1) is the surface's own; red leans along dp/du, green along dp/dv.
    std::shared_ptr<const Texture> normalMap;
    float normalScale = 1; ///< of the leaning
};

/// Throws nothing: inputs out of range are clamped where they are looked up.
std::shared_ptr<const Material> makeMetallicRoughness(const MetallicRoughnessInputs& inputs);

/// The same as a plugin of the scene language.
Plugin<std::shared_ptr<const Material>> metallicRoughnessPlugin();

} // namespace strobe
