// The same value everywhere.
#pragma once

#include "core/params/plugin.h"

namespace strobe {

Plugin<TexturePtr, const TextureArgs&> constantTexturePlugin();

} // namespace strobe
