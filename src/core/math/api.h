// The visibility of symbols in libstrobe.
#pragma once

/// Follows the name of the namespace in headers whose declarations programs and plugins may use. All other
/// symbols are local to libstrobe.
#define STROBE_API [[gnu::visibility("default")]]
