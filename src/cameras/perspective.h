// The perspective camera.
#pragma once

#include "core/interfaces/camera.h"
#include "core/params/plugin.h"

namespace strobe {

/// "perspective": a pinhole or a thin lens; looks along +z of camera space, x right, y up. "fov" spans the
/// shorter image axis.
Plugin<std::shared_ptr<const Camera>, const CameraArgs&> perspectivePlugin();

} // namespace strobe
