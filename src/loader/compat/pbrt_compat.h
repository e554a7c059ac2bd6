// Plugins of pbrt that strobe lacks: each becomes the nearest plugin of strobe. See docs/pbrt-files.md.
#pragma once

#include "core/interfaces/light.h"
#include "core/interfaces/material.h"
#include "core/interfaces/shape.h"
#include "core/params/plugin.h"

namespace strobe {

/// A replacement that looks the same: its message is a note.
inline constexpr const char* kConvertedToTriangles = "it is converted to triangles";

/// A plugin with the name and the parameters of pbrt, which creates an approximation of it.
template <class Row>
struct CompatPlugin {
    Row row;
    std::string replacement; ///< end of the warning "… is not supported; "; empty: exact, no warning
};

using MaterialRow = Plugin<std::shared_ptr<const Material>>;
using TextureRow = Plugin<TexturePtr, const TextureArgs&>;
using ShapeRow = Plugin<Shape>;

/// Returns the materials, most of which become "metallicroughness". They include materials of pbrt-v3 and v4
/// whose names strobe uses for other materials: those of pbrt-v2, and "measured".
std::vector<CompatPlugin<MaterialRow>> compatMaterials();
/// Returns the opaque material that looks like a dense medium behind a smooth boundary: diffuse, below a
/// glossy coat. `scattering`: reduced by the phase function.
std::shared_ptr<const Material> makeDenseMedium(const Rgb& absorption, const Rgb& scattering);

/// Returns the textures: bilerp and uv exactly, ptex as a gray constant.
std::vector<CompatPlugin<TextureRow>> compatTextures();
/// Returns the shapes, as triangles: surfaces of revolution (also spheres and disks with alpha), bilinear
/// patches, height fields and curves.
std::vector<CompatPlugin<ShapeRow>> compatShapes();

/// Returns the diagonal, in mm, of the film behind pbrt's "realistic" camera.
float readDiagonal(const ParamSet& film);
/// Replaces the parameters of a "realistic" camera by those of a "perspective" camera of the same focal
/// length. `filmDiagonal` in mm, `resolution` in pixels.
void makePerspective(ParamSet& camera, float filmDiagonal, const V2i& resolution);

} // namespace strobe
