// Signals that stop a render or save its checkpoint.
#pragma once

#include "session/session.h"

#include <atomic>
#include <thread>

#include <signal.h>

namespace strobe {

/// Handles signals while it exists. If the render can save what it has, SIGINT, SIGTERM, SIGUSR1 and SIGXCPU
/// stop it, and SIGHUP saves its checkpoint; a SIGINT after another signal ends the program at once.
/// Otherwise these signals end the program, but not while it writes its outputs, so that no temporary file
/// remains. To be constructed before other threads: they inherit the signals that it blocks.
class StopSignals {
  public:
    /// `control` outlives the object.
    StopSignals(RenderControl& control, bool canSave);
    ~StopSignals();
    StopSignals(const StopSignals&) = delete;
    StopSignals& operator=(const StopSignals&) = delete;

  private:
    void wait();
    void handle(int signal);

    RenderControl& m_control;
    const bool m_canSave;
    sigset_t m_signals, m_formerMask;
    std::atomic<bool> m_ends{false};
    std::thread m_thread; ///< last: it uses the other members
};

} // namespace strobe
