// Signals that stop a render or save its checkpoint.
#pragma once

#include "session/session.h"

#include <atomic>
#include <thread>

#include <signal.h>

namespace strobe {

/// Handles signals while it exists: SIGINT, SIGTERM and SIGUSR1 stop the render, SIGHUP saves its checkpoint.
/// A SIGINT after any of the first three ends the program at once. To be constructed before other threads:
/// they inherit the signals that it blocks.
class StopSignals {
  public:
    /// `control` outlives the object.
    explicit StopSignals(RenderControl& control);
    ~StopSignals();
    StopSignals(const StopSignals&) = delete;
    StopSignals& operator=(const StopSignals&) = delete;

  private:
    void wait();

    RenderControl& m_control;
    sigset_t m_signals, m_formerMask;
    std::atomic<bool> m_ends{false};
    std::thread m_thread; ///< last: it uses the other members
};

} // namespace strobe
