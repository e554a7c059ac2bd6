// The environment camera.
#pragma once

#include "core/interfaces/camera.h"
#include "core/params/plugin.h"

namespace strobe {

/// "environment": all directions; +y of camera space is up at the top row, and columns go round from +x by
/// +z.
Plugin<std::shared_ptr<const Camera>, const CameraArgs&> environmentPlugin();

} // namespace strobe
