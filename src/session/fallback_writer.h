// Writes files to another folder where they cannot be written under their own name, so that a full disk does
// not cost a finished render.
#pragma once

#include "session/log.h"

#include <filesystem>
#include <functional>
#include <mutex>

namespace strobe {

/// Writes files. Thread-safe.
class FallbackWriter {
  public:
    explicit FallbackWriter(const Log& log) : m_log(log) {}
    FallbackWriter(const FallbackWriter&) = delete;
    FallbackWriter& operator=(const FallbackWriter&) = delete;

    using Write = std::function<void(const std::filesystem::path& file)>;
    /// Calls write(file). If that throws Error of kind Output, logs the error, and calls `write` with the
    /// same file name in a new folder in $TMPDIR, /tmp or the current folder, whichever first succeeds.
    /// Returns whether the file was written under its own name.
    bool write(const std::filesystem::path& file, const Write& write);
    /// Whether every file so far was written under its own name.
    bool wroteAll() const { return m_wroteAll; }

  private:
    bool writeToFallbackFolder(const std::filesystem::path& file, const Write& write);

    const Log& m_log;
    std::mutex m_mutex;
    std::filesystem::path m_folder; ///< of the files so far; empty if there are none
    bool m_wroteAll = true;
};

} // namespace strobe
