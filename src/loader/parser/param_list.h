// Parameter lists: `"type name" value` or `"type name" [values]`, any number of them.
#pragma once

#include "core/params/params.h"
#include "core/util/diagnostics.h"
#include "loader/parser/lexer.h"

namespace strobe {

/// Reads parameters up to the first token that is not a string. `where`: the location of the directive. A
/// texture parameter has the texture's name in `strings`; the caller resolves it. Sets `looksLikeV4` to true
/// if the notation belongs to pbrt-v3 or v4. A repeated parameter is an Error if `lenientDiagnostics` is
/// null; else it is a warning, and the last value is used. Throws located Errors.
ParamSet readParams(Lexer& lexer, const Location& where, bool& looksLikeV4, Diagnostics* lenientDiagnostics);

} // namespace strobe
