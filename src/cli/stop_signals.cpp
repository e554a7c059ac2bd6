#include "cli/stop_signals.h"

#include <csignal>

#include <unistd.h>

namespace strobe {

namespace {

/// Ends the wait. Its default action is none.
constexpr int kWake = SIGURG;

bool isIgnored(int signal) {
    struct sigaction action;
    return sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
}

/// Ends the program as the signal does by default.
void endBy(int signal) {
    std::signal(signal, SIG_DFL);
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, signal);
    pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
    raise(signal);
}

} // namespace

StopSignals::StopSignals(RenderControl& control, bool canSave) : m_control(control), m_canSave(canSave) {
    sigemptyset(&m_signals);
    for (const int signal : {SIGINT, SIGTERM, SIGUSR1, SIGHUP, SIGXCPU})
        if (canSave || !isIgnored(signal)) // as of nohup
            sigaddset(&m_signals, signal);
    sigaddset(&m_signals, kWake);
    pthread_sigmask(SIG_BLOCK, &m_signals, &m_formerMask);
    m_thread = std::thread([this] { wait(); });
}

StopSignals::~StopSignals() {
    m_ends = true;
    pthread_kill(m_thread.native_handle(), kWake);
    m_thread.join();
    pthread_sigmask(SIG_SETMASK, &m_formerMask, nullptr);
}

void StopSignals::wait() {
    while (!m_ends)
        if (const int signal = sigwaitinfo(&m_signals, nullptr); signal > 0 && signal != kWake)
            handle(signal);
}

void StopSignals::handle(int signal) {
    if (!m_canSave) {
        const auto lock = m_control.lockWriting();
        endBy(signal);
    } else if (signal == SIGHUP) {
        m_control.saveCheckpoint();
    } else {
        if (signal == SIGINT && m_control.isStopped())
            _exit(128 + SIGINT);
        m_control.stop();
    }
}

} // namespace strobe
