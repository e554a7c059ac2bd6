#include "cli/standard_streams.h"

#include "core/util/error.h"
#include "core/util/nearest_name.h"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <sstream>
#include <string>

#include <fcntl.h>
#include <unistd.h>

namespace strobe {

void prepareStandardStreams() {
    // Opened for reading only, so that writing of results fails and is reported.
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (fcntl(stream, F_GETFD) < 0 && errno == EBADF) [[maybe_unused]]
            const int lowestFree = open("/dev/null", O_RDONLY);
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);
}

void printMessage(std::string_view text) {
    std::fwrite(text.data(), 1, text.size(), stderr);
    std::fflush(stderr);
}

void printResult(std::string_view text) {
    const bool isWritten = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
    if ((!isWritten || std::fflush(stdout) != 0) && errno != EPIPE)
        throw Error(std::string("cannot write to standard output: ") + std::strerror(errno),
                    ErrorKind::Output);
}

namespace {

/// Returns the option whose name is nearest to the first unknown one; empty if there is none.
std::string nearestOption(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options())
        names.push_back(option->get_name());
    for (const std::string& argument : app.remaining())
        if (argument.starts_with("--"))
            return nearestName(argument.substr(0, argument.find('=')), names);
    return "";
}

} // namespace

ExitCode printParseResult(const CLI::App& app, const CLI::ParseError& result) {
    std::ostringstream out, errors;
    const std::string nearest = nearestOption(app);
    const int code =
        nearest.empty()
            ? app.exit(result, out, errors)
            : app.exit(CLI::ValidationError(std::string(result.what()) + "; did you mean " + nearest + "?"),
                       out, errors);
    printMessage(errors.str());
    printResult(out.str());
    return code == 0 ? kOk : kUsageError;
}

} // namespace strobe
