// Signals as a wish to stop, or to save.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <thread>

#include <signal.h>

namespace strobe {

/// Takes SIGINT, SIGTERM, SIGUSR1 (all: stop) and SIGHUP (save and go on) while it exists. To be made before
/// other threads are: they inherit what it blocks. A second SIGINT ends the program at once.
class StopSignals {
  public:
    StopSignals();
    ~StopSignals();
    StopSignals(const StopSignals&) = delete;
    StopSignals& operator=(const StopSignals&) = delete;

    /// What SIGHUP calls, from a thread of its own; null: nothing. After the return, no call of the former is
    /// under way.
    void onSave(std::function<void()> save);
    bool stops() const { return m_stops.load(std::memory_order_relaxed); }

  private:
    void wait();

    sigset_t m_signals, m_before;
    std::mutex m_saving;
    std::function<void()> m_save; ///< under m_saving
    std::atomic<bool> m_stops{false}, m_ends{false};
    std::thread m_thread; ///< last: it uses the others
};

} // namespace strobe
