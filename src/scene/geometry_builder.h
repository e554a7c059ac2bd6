// Places shapes: bakes what rests, makes instances of what moves or repeats, fits motion to the shutter.
#pragma once

#include "core/integrator.h"
#include "scene/description.h"
#include "scene/plugins.h"

namespace strobe {

struct BuiltGeometry {
    std::vector<Group> groups; ///< [0]: the world's own
    std::vector<Instance> instances;
    std::vector<std::shared_ptr<const Light>> areaLights; ///< Geometry::light counts from `firstLight`
};

/// Makes a shape from its declaration; an empty Shape where it is skipped.
using MakeShape = std::function<Shape(ShapeDecl&)>;
/// Makes the area light of a declaration on a placed shape.
using MakeAreaLight = std::function<std::shared_ptr<const Light>(const AreaLightDecl&, const PlacedShape&)>;

BuiltGeometry buildGeometry(SceneDescription& description, const Camera& camera, const Shutter& shutter,
                            int firstLight, const MakeShape& makeShape, const MakeAreaLight& makeAreaLight,
                            Messages& messages);

} // namespace strobe
