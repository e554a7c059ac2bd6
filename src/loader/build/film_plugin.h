// The plugin of the Film directive.
#pragma once

#include "loader/build/plugin_tables.h"

namespace strobe {

/// Returns the row of Film "image". Its `create` throws located Errors.
Plugin<FilmSetup> imageFilmPlugin();

} // namespace strobe
