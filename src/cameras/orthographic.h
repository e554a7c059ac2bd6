// The orthographic camera.
#pragma once

#include "core/camera.h"
#include "core/plugin.h"

namespace strobe {

/// "orthographic": parallel rays along +z of camera space; the screen window is in camera space units.
Plugin<std::shared_ptr<const Camera>, const CameraArgs&> orthographicPlugin();

} // namespace strobe
