// The command line `strobe merge PART... -o OUT...`.
#pragma once

#include "cli/exit_codes.h"
#include "session/options.h"

#include <optional>
#include <string>
#include <vector>

namespace strobe {

struct MergeCommandLine {
    MergeOptions merge;
    std::vector<std::string> warnings; ///< about plugins that could not be loaded
    bool quiet = false;
};

/// Parses the arguments, of which the first is "merge". Returns an exit code if the program ends here; see
/// parseCommandLine.
std::optional<ExitCode> parseMergeCommandLine(int argc, char** argv, MergeCommandLine& line);

} // namespace strobe
