#include "session/stop_signals.h"

#include <unistd.h>

namespace strobe {

StopSignals::StopSignals() {
    sigemptyset(&m_signals);
    for (const int signal : {SIGINT, SIGTERM, SIGUSR1, SIGHUP})
        sigaddset(&m_signals, signal);
    pthread_sigmask(SIG_BLOCK, &m_signals, &m_before);
    m_thread = std::thread([this] { wait(); });
}

StopSignals::~StopSignals() {
    m_ends = true;
    m_thread.join();
    pthread_sigmask(SIG_SETMASK, &m_before, nullptr);
}

void StopSignals::onSave(std::function<void()> save) {
    const std::lock_guard lock(m_saving);
    m_save = std::move(save);
}

void StopSignals::wait() {
    const timespec tick{0, 100'000'000};
    while (!m_ends) {
        const int signal = sigtimedwait(&m_signals, nullptr, &tick);
        if (signal == SIGHUP) {
            const std::lock_guard lock(m_saving);
            if (m_save)
                m_save();
        } else if (signal > 0 && m_stops.exchange(true) && signal == SIGINT)
            _exit(128 + SIGINT); // somebody is in a hurry
    }
}

} // namespace strobe
