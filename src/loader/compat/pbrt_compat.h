// Plugins of other renderers that are none of ours: what of ours is nearest to them, with their parameters.
#pragma once

#include "core/interfaces/light.h"
#include "core/interfaces/material.h"
#include "core/interfaces/shape.h"
#include "core/params/plugin.h"

namespace strobe {

/// A row that reads another renderer's parameters and makes something of ours.
template <class Row>
struct CompatPlugin {
    Row row;             ///< its name is theirs
    std::string becomes; ///< for the one warning: what is made, and what is lost
};

using MaterialRow = Plugin<std::shared_ptr<const Material>>;
using TextureRow = Plugin<TexturePtr, const TextureArgs&>;
using ShapeRow = Plugin<Shape>;

/// Materials, most of which become glTF's metallic-roughness. Those of pbrt-v3 that have the name of one of
/// ours, which is pbrt-v2's, are here too.
std::vector<CompatPlugin<MaterialRow>> compatMaterials();
/// Textures: bilerp and uv as they are, noises as their mean.
std::vector<CompatPlugin<TextureRow>> compatTextures();
/// Shapes: surfaces of revolution, bilinear patches, height fields and curves, as triangles.
std::vector<CompatPlugin<ShapeRow>> compatShapes();

/// The diagonal, in mm, of the film behind pbrt's "realistic" camera.
float readDiagonal(const ParamSet& film);
/// Gives such a camera the parameters of a perspective one of the same focal length.
void makePerspective(ParamSet& camera, float filmDiagonal, const V2i& resolution);

} // namespace strobe
