// Exit codes of the program.
#pragma once

namespace strobe {

enum ExitCode {
    kOk = 0,
    kUsageError = 1,
    kSceneError = 2,
    kOutputError = 3,
    kInternalError = 4,
    kInterrupted = 5,
    kInvalidSamples = 6
};

} // namespace strobe
