// The "environment" camera.
#pragma once

#include "core/interfaces/camera.h"
#include "core/params/plugin.h"

namespace strobe {

/// A camera that sees all directions as a latitude-longitude image: the top row is +y of camera space, and
/// columns go from +x over +z. Film x is the azimuth, film y the polar angle.
Plugin<std::shared_ptr<const Camera>, const CameraArgs&> environmentPlugin();

} // namespace strobe
