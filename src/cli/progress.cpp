#include "cli/progress.h"

#include "cli/standard_streams.h"

#include <fmt/format.h>

#include <cstdlib>
#include <string_view>

#include <unistd.h>

namespace strobe {

namespace {

/// "h:mm:ss" or "m:ss".
std::string formatDuration(double seconds) {
    const long s = long(seconds + 0.5);
    return s >= 3600 ? fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
                     : fmt::format("{}:{:02}", s / 60, s % 60);
}

/// Whether the terminal cannot move its cursor.
bool isDumb() {
    const char* terminal = std::getenv("TERM");
    return terminal && std::string_view(terminal) == "dumb";
}

} // namespace

Progress::Progress() : m_isTerminal(isatty(STDERR_FILENO) && !isDumb()) { restart(); }

void Progress::restart() {
    m_start = Clock::now();
    m_lastDrawn = m_start;
    m_printedTenths = 0;
}

void Progress::update(double fraction) {
    if (fraction == 0) {
        restart();
        return;
    }
    const Clock::time_point now = Clock::now();
    if (m_isTerminal) {
        if (now - m_lastDrawn < std::chrono::milliseconds(100) && fraction < 1)
            return;
        m_lastDrawn = now;
        drawBar(fraction, std::chrono::duration<double>(now - m_start).count());
    } else if (int(fraction * 10) > m_printedTenths) {
        m_printedTenths = int(fraction * 10);
        printMessage(fmt::format("{}%\n", m_printedTenths * 10));
    }
}

void Progress::drawBar(double fraction, double elapsed) const {
    constexpr int kWidth = 40;
    const int filled = int(fraction * kWidth);
    const std::string left = formatDuration(elapsed / fraction * (1 - fraction));
    printMessage(fmt::format("\r[{:=<{}}{: <{}}] {:3.0f}%  {} left   ", "", filled, "", kWidth - filled,
                             fraction * 100, left));
}

void Progress::finish() {
    if (m_isTerminal)
        printMessage(fmt::format("\r{: <70}\r", ""));
}

} // namespace strobe
