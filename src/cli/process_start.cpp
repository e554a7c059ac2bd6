#include "cli/process_start.h"

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

#include <unistd.h>

namespace strobe {

std::chrono::steady_clock::time_point processStart() {
    using Clock = std::chrono::steady_clock;
    std::ifstream file("/proc/self/stat");
    const std::string stat{std::istreambuf_iterator<char>(file), {}};
    // Field 2, the program's name in parentheses, may contain spaces. Field 22 is the start in ticks since
    // boot.
    std::istringstream fields(stat.substr(std::min(stat.rfind(')') + 1, stat.size())));
    std::string field;
    for (int i = 3; i <= 22; ++i)
        fields >> field;
    timespec now;
    if (!fields || clock_gettime(CLOCK_BOOTTIME, &now) != 0)
        return Clock::now();
    const double age = double(now.tv_sec) + 1e-9 * double(now.tv_nsec) -
                       std::strtod(field.c_str(), nullptr) / double(sysconf(_SC_CLK_TCK));
    return Clock::now() - std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(age));
}

} // namespace strobe
