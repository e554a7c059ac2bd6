#include "cli/standard_streams.h"

#include "core/util/error.h"

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

ExitCode printParseResult(const CLI::App& app, const CLI::ParseError& result) {
    std::ostringstream out, errors;
    const int code = app.exit(result, out, errors);
    printMessage(errors.str());
    printResult(out.str());
    return code == 0 ? kOk : kUsageError;
}

} // namespace strobe
