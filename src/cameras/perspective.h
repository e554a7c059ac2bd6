// The "perspective" camera.
#pragma once

#include "core/interfaces/camera.h"
#include "core/params/plugin.h"

namespace strobe {

/// A pinhole or thin lens camera that looks along +z of camera space, with x right and y up. "fov" (degrees)
/// is the angle of view along the shorter image axis. With a lens (lensradius > 0), rays through one film
/// point meet in the plane at focaldistance.
Plugin<std::shared_ptr<const Camera>, const CameraArgs&> perspectivePlugin();

} // namespace strobe
