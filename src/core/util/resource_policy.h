// The files that a scene may read, and the memory that it may use.
#pragma once

#include "core/math/api.h"
#include "core/util/error.h"

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <set>
#include <string>

namespace STROBE_API strobe {

/// The resource limits of a run (--sandbox, --max-memory). The policy is reachable from every Source that the
/// command line reads, and so from every Location: code that opens a file or allocates much memory on behalf
/// of a scene calls authorizeRead or requireMemory first. Thread-safe.
class ResourcePolicy {
  public:
    struct Settings {
        std::vector<std::filesystem::path> roots; ///< files and directories that may be read; if empty, all
        uint64_t maxMemory = 0; ///< maximum resident memory in bytes; 0: memory of the machine
    };
    /// Allows all files and the memory of the machine, and does not record authorized files.
    ResourcePolicy() = default;
    /// Throws Error of kind Usage if a root does not exist.
    explicit ResourcePolicy(const Settings& settings);

    /// Returns whether only files within the roots may be read.
    bool restrictsFiles() const { return !m_settings.roots.empty(); }
    /// Returns the path to open for `file`. If files are restricted, this is the canonical path, with
    /// symbolic links and `..` resolved; else `file` itself. Throws Error at `where` if the file is outside
    /// the roots.
    std::filesystem::path authorizeRead(const std::filesystem::path& file, const Location& where) const;
    /// Returns whether `file` exists and authorizeRead was called for it, under this or another name.
    bool hasAuthorized(const std::filesystem::path& file) const;
    /// Throws Error at `where` if `bytes` of additional memory exceed the limit. The message names `item`,
    /// the object that needs the memory, and proposes `remedy`.
    void requireMemory(uint64_t bytes, const std::string& item, const std::string& remedy,
                       const Location& where) const;

  private:
    void record(const std::filesystem::path& file) const;

    Settings m_settings; ///< with canonical roots
    bool m_isRecording = false;
    mutable std::mutex m_mutex; ///< for m_authorized: threads load shapes and images concurrently
    mutable std::set<std::filesystem::path> m_authorized;
};

/// Returns the policy of the source of `where`; without one, a policy that allows everything.
const ResourcePolicy& resourcePolicyOf(const Location& where);

/// Returns the resident memory of the process in bytes; 0 if it is not available.
uint64_t residentBytes();

/// Formats a number of bytes, e.g. as "3.2 GB".
std::string formatBytes(uint64_t bytes);

} // namespace strobe
