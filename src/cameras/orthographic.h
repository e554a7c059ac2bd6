// The "orthographic" camera.
#pragma once

#include "core/interfaces/camera.h"
#include "core/params/plugin.h"

namespace strobe {

/// Parallel rays along +z of camera space, with x right and y up. The screen window is in units of camera
/// space. With a lens (lensradius > 0), rays through one film point meet in the plane at focaldistance.
Plugin<std::shared_ptr<const Camera>, const CameraArgs&> orthographicPlugin();

} // namespace strobe
