// Geometry of a frame: bakes static shapes, creates instances for moving or repeated shapes, and fits motion
// to the shutter.
#pragma once

#include "core/render/integrator.h"
#include "core/util/diagnostics.h"
#include "loader/build/shape_store.h"

namespace strobe {

struct BuiltGeometry {
    std::vector<Group> groups; ///< [0]: the static shapes of the world
    std::vector<Instance> instances;
    std::vector<std::shared_ptr<const Light>> areaLights; ///< Geometry::light counts from `firstLight`
};

/// Creates the area light of a declaration on a placed shape; returns null if the declaration is skipped.
using MakeAreaLight = std::function<std::shared_ptr<const Light>(const AreaLightDecl&, const PlacedShape&)>;

/// Returns the geometry of the frame of `shutter`. `camera` determines the tolerance of motion fits.
/// `firstLight`: the index of the first area light among the lights of the scene. Throws located Errors.
BuiltGeometry buildGeometry(SceneDescription& description, const Camera& camera, const Shutter& shutter,
                            int firstLight, ShapeStore& shapes, const MakeAreaLight& makeAreaLight,
                            Diagnostics& diagnostics);

} // namespace strobe
