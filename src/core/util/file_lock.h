// Locks that keep two processes from writing the same file.
#pragma once

#include "core/math/api.h"

#include <filesystem>

namespace STROBE_API strobe {

/// Holds FILE.lock, which contains the process and the host. The system releases the lock when the process
/// ends, however it ends; a file that remains is no lock.
class FileLock {
  public:
    /// Throws Error of kind Usage, with the holder, if another process holds the lock, and of kind Output if
    /// the lock file cannot be created.
    explicit FileLock(const std::filesystem::path& file);
    /// Removes the lock file.
    ~FileLock();
    FileLock(const FileLock&) = delete;
    FileLock& operator=(const FileLock&) = delete;

  private:
    const std::filesystem::path m_lockFile;
    int m_fd = -1;
};

} // namespace strobe
