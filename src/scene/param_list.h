// Parameter lists: `"type name" value` or `"type name" [values]`, any number of them.
#pragma once

#include "core/params.h"
#include "scene/lexer.h"

namespace strobe {

/// Reads parameters up to the first token that is not a string. `where`: the directive's place. Textures keep
/// their name in `strings`; the caller looks it up. `looksLikeV4` becomes true if only pbrt-v3 or v4 would
/// write so. Throws located Errors.
ParamSet readParams(Lexer& lexer, const Location& where, bool& looksLikeV4);

} // namespace strobe
