// The command line of a render: `strobe FILE... [options]`.
#pragma once

#include "cli/exit_codes.h"
#include "session/session.h"

#include <optional>
#include <string>

namespace strobe {

struct CommandLine {
    RenderOptions render;
    std::optional<PixelQuery> pixel; ///< prints this pixel in place of a render
    bool list = false;               ///< prints the plugins
    std::string listName;            ///< with `list`: only those of this name; empty: all, and the AOVs
    /// A text to print in place of a render: the man page, or a completion script; empty: none.
    std::string text;
    bool printOcio = false;            ///< prints the built-in OpenColorIO config
    std::vector<std::string> warnings; ///< about plugins that could not be loaded
    bool quiet = false;
    std::string logLevel = "info"; ///< debug, info, warn or error
};

/// Parses the arguments. Returns an exit code if the program ends here: after --help and --version, which it
/// prints, and after an error, which it prints as well.
std::optional<ExitCode> parseCommandLine(int argc, char** argv, CommandLine& line);

} // namespace strobe
