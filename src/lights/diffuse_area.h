// The "diffuse" area light.
#pragma once

#include "core/interfaces/light.h"
#include "core/params/plugin.h"

namespace strobe {

/// Emits radiance L (W/(m² sr)) from every point of a shape in all directions on the side of the surface
/// normal, or on both sides. pbrt-v2 also calls it "area". Meshes are sampled by area (makeMeshLight), whole
/// spheres by the cone of directions (makeSphereLight), other quadrics by area (makeQuadricLight); pdfs are
/// per solid angle. pbrt-v4's "power" (W) replaces the magnitude of L. An image
/// ("filename") scales L over the texture coordinates of meshes; of quadrics, its mean is used with a
/// warning.
Plugin<std::shared_ptr<Light>, const AreaLightArgs&> diffuseAreaLightPlugin();

} // namespace strobe
