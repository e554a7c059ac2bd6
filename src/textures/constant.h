// The same value everywhere.
#pragma once

#include "core/plugin.h"

namespace strobe {

Plugin<TexturePtr, const TextureArgs&> constantTexturePlugin();

} // namespace strobe
