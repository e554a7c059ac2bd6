// Progress on standard error: a bar with the time left on a terminal, plain percentages elsewhere.
#pragma once

#include <chrono>

namespace strobe {

class Progress {
  public:
    explicit Progress(bool quiet);
    /// `fraction` in [0,1]; calls may come from different threads, one at a time.
    void update(double fraction);
    void finish();

  private:
    bool m_quiet, m_terminal;
    int m_lastTenth = 0;
    std::chrono::steady_clock::time_point m_start, m_lastDrawn;
};

} // namespace strobe
