// The time at which the process began.
#pragma once

#include <chrono>

namespace strobe {

/// Returns when the system began to load the program, or the current time if the system does not tell.
std::chrono::steady_clock::time_point processStart();

} // namespace strobe
