// Progress on standard error.
#pragma once

#include <chrono>

namespace strobe {

/// Prints the fraction done: on a terminal a bar with the estimated time left, elsewhere a line for every 10
/// %.
class Progress {
  public:
    Progress();
    /// `fraction` in [0, 1]; 0 restarts the clock, for a new image. Any thread may call it, one at a time.
    void update(double fraction);
    /// Erases the bar.
    void finish();

  private:
    using Clock = std::chrono::steady_clock;

    void restart();
    void drawBar(double fraction, double elapsed) const;

    const bool m_isTerminal;
    int m_printedTenths = 0;
    Clock::time_point m_start, m_lastDrawn;
};

} // namespace strobe
