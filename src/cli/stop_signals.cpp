#include "cli/stop_signals.h"

#include <unistd.h>

namespace strobe {

StopSignals::StopSignals(RenderControl& control) : m_control(control) {
    sigemptyset(&m_signals);
    for (const int signal : {SIGINT, SIGTERM, SIGUSR1, SIGHUP})
        sigaddset(&m_signals, signal);
    pthread_sigmask(SIG_BLOCK, &m_signals, &m_formerMask);
    m_thread = std::thread([this] { wait(); });
}

StopSignals::~StopSignals() {
    m_ends = true;
    m_thread.join();
    pthread_sigmask(SIG_SETMASK, &m_formerMask, nullptr);
}

void StopSignals::wait() {
    const timespec tick{0, 100'000'000};
    while (!m_ends) {
        const int signal = sigtimedwait(&m_signals, nullptr, &tick);
        if (signal == SIGHUP) {
            m_control.saveCheckpoint();
        } else if (signal > 0) {
            if (signal == SIGINT && m_control.isStopped())
                _exit(128 + SIGINT);
            m_control.stop();
        }
    }
}

} // namespace strobe
