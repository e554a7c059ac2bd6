// The picture so far, in its files, every now and then.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace strobe {

/// Calls `write` every `period` from a thread of its own, until it is destroyed (a call under way is
/// awaited).
class PeriodicWriter {
  public:
    PeriodicWriter(std::chrono::duration<double> period, std::function<void()> write)
        : m_thread([this, period, write = std::move(write)] {
              std::unique_lock lock(m_mutex);
              while (!m_wake.wait_for(lock, period, [this] { return m_ends; })) {
                  lock.unlock();
                  write();
                  lock.lock();
              }
          }) {}
    ~PeriodicWriter() {
        {
            const std::lock_guard lock(m_mutex);
            m_ends = true;
        }
        m_wake.notify_all();
        m_thread.join();
    }
    PeriodicWriter(const PeriodicWriter&) = delete;
    PeriodicWriter& operator=(const PeriodicWriter&) = delete;

  private:
    std::mutex m_mutex;
    std::condition_variable m_wake;
    bool m_ends = false;
    std::thread m_thread; ///< last: it uses the others
};

} // namespace strobe
