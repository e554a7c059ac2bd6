// Standard streams that are closed, full or no longer read.
#pragma once

#include "cli/exit_codes.h"

#include <CLI/CLI.hpp>

#include <string_view>

namespace strobe {

/// Opens /dev/null for standard streams that are closed, so that no output file gets their descriptors.
/// Ignores SIGPIPE and SIGXFSZ, so that writes fail instead. To be called first.
void prepareStandardStreams();

/// Writes to standard error. Failures are ignored: a lost message does not cost a picture.
void printMessage(std::string_view text);

/// Writes to standard output and flushes it. Does nothing if the reader has closed the pipe. Throws Error of
/// kind Output if the text cannot be written.
void printResult(std::string_view text);

/// Prints the help, the version or the error that ended the parsing of a command line, and returns the exit
/// code. Throws what printResult throws.
ExitCode printParseResult(const CLI::App& app, const CLI::ParseError& result);

} // namespace strobe
