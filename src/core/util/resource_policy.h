// What a scene may read and take: the one place that decides.
#pragma once

#include "core/util/error.h"

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <set>
#include <string>

namespace strobe {

/// The limits of a run. Every Source of the command line's scenes leads to the guard, and so does every
/// Location in them: who opens a file or takes much memory on a scene's behalf asks the functions below.
class ResourcePolicy {
  public:
    struct Settings {
        std::vector<std::filesystem::path> roots; ///< files and folders that may be read; none: all
        uint64_t maxMemory = 0;                   ///< resident bytes; 0: what the machine has
    };
    ResourcePolicy() = default; ///< allows everything, and remembers nothing
    /// Throws Error of kind Usage where a root does not exist.
    explicit ResourcePolicy(const Settings& settings);

    /// True where only the roots may be read.
    bool restrictsFiles() const { return !m_settings.roots.empty(); }
    /// The path to open: where `file` truly is, symbolic links and `..` followed, if only the roots may be
    /// read; else `file` itself. Throws an Error at `where` if that is outside of them.
    std::filesystem::path authorizeRead(const std::filesystem::path& file, const Location& where) const;
    /// Whether `file` is there and is one that was admitted, by this name or another.
    bool hasAuthorized(const std::filesystem::path& file) const;
    /// Throws an Error at `where` that says what `what` would take, and `remedy`, if that many bytes more do
    /// not fit.
    void requireMemory(uint64_t bytes, const std::string& what, const std::string& remedy,
                       const Location& where) const;

  private:
    void remember(const std::filesystem::path& file) const;

    Settings m_settings; ///< roots are canonical
    bool m_remembers = false;
    mutable std::mutex m_mutex; ///< of what follows: shapes and images are loaded by many threads
    mutable std::set<std::filesystem::path> m_admitted; ///< looked at when asked for: there may be very many
};

/// The guard of the text that `where` lies in, or one that allows everything.
const ResourcePolicy& resourcePolicyOf(const Location& where);

/// Memory that the process holds, in bytes; 0 where the system does not say.
uint64_t residentBytes();

/// "3.2 GB".
std::string formatBytes(uint64_t bytes);

} // namespace strobe
