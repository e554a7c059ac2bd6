#include "cli/progress.h"

#include <fmt/format.h>

#include <cstdio>
#include <unistd.h>

namespace strobe {

namespace {

std::string duration(double seconds) {
    const long s = long(seconds + 0.5);
    return s >= 3600 ? fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
                     : fmt::format("{}:{:02}", s / 60, s % 60);
}

} // namespace

Progress::Progress(bool quiet)
    : m_quiet(quiet), m_terminal(isatty(STDERR_FILENO)), m_start(std::chrono::steady_clock::now()),
      m_lastDrawn(m_start) {}

void Progress::update(double fraction) {
    if (m_quiet)
        return;
    const auto now = std::chrono::steady_clock::now();
    const double elapsed = std::chrono::duration<double>(now - m_start).count();
    if (m_terminal) {
        if (now - m_lastDrawn < std::chrono::milliseconds(100) && fraction < 1)
            return;
        m_lastDrawn = now;
        constexpr int kWidth = 40;
        const int filled = int(fraction * kWidth);
        const std::string left = fraction > 0 ? duration(elapsed / fraction * (1 - fraction)) : "?";
        fmt::print(stderr, "\r[{:=<{}}{: <{}}] {:3.0f}%  {} left   ", "", filled, "", kWidth - filled,
                   fraction * 100, left);
        std::fflush(stderr);
    } else if (int(fraction * 10) > m_lastTenth) {
        m_lastTenth = int(fraction * 10);
        fmt::print(stderr, "{}%\n", m_lastTenth * 10);
    }
}

void Progress::finish() {
    if (!m_quiet && m_terminal)
        fmt::print(stderr, "\r{: <70}\r", "");
}

} // namespace strobe
