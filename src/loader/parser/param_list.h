// Parameter lists: `"type name" value` or `"type name" [values]`, any number of them.
#pragma once

#include "core/params/params.h"
#include "loader/parser/lexer.h"

namespace strobe {

/// Reads parameters up to the first token that is not a string. `where`: the directive's place. Textures keep
/// their name in `strings`; the caller looks it up. `looksLikeV4` becomes true if only pbrt-v3 or v4 would
/// write so. A name that is given twice is an Error, or, with `lenient`, a warning there: the last counts.
/// Throws located Errors.
ParamSet readParams(Lexer& lexer, const Location& where, bool& looksLikeV4, Diagnostics* lenient);

} // namespace strobe
