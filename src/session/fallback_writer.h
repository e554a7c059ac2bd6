// What cannot be written where it belongs is written elsewhere: hours of rendering are not lost to a full
// disk.
#pragma once

#include <spdlog/logger.h>

#include <filesystem>
#include <functional>
#include <mutex>

namespace strobe {

/// Writes files; safe to use from several threads.
class FallbackWriter {
  public:
    explicit FallbackWriter(spdlog::logger& log) : m_log(log) {}
    FallbackWriter(const FallbackWriter&) = delete;
    FallbackWriter& operator=(const FallbackWriter&) = delete;

    using Write = std::function<void(const std::filesystem::path& file)>;
    /// Calls write(file). If that throws an Error of kind Output, says so and tries the same name in a new
    /// folder of its own: in $TMPDIR, /tmp or the current folder, where it can be. False: it is not where it
    /// belongs.
    bool write(const std::filesystem::path& file, const Write& write);
    /// Whether every file so far is where it belongs.
    bool wroteAll() const { return m_wroteAll; }

  private:
    bool writeToFallbackFolder(const std::filesystem::path& file, const Write& write);

    spdlog::logger& m_log;
    std::mutex m_mutex;
    std::filesystem::path m_folder; ///< once there is one
    bool m_wroteAll = true;
};

} // namespace strobe
