// The orthographic camera.
#pragma once

#include "core/interfaces/camera.h"
#include "core/params/plugin.h"

namespace strobe {

/// "orthographic": parallel rays along +z of camera space; the screen window is in camera space units.
Plugin<std::shared_ptr<const Camera>, const CameraArgs&> orthographicPlugin();

} // namespace strobe
