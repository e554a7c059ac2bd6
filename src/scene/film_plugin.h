// The film directive.
#pragma once

#include "scene/plugins.h"

namespace strobe {

Plugin<FilmSetup> imageFilmPlugin();

} // namespace strobe
