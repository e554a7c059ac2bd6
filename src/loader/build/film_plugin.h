// The film directive.
#pragma once

#include "loader/build/plugin_tables.h"

namespace strobe {

Plugin<FilmSetup> imageFilmPlugin();

} // namespace strobe
