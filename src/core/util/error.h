// The exception type of the library, and locations in scene files.
#pragma once

#include "core/math/api.h"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace STROBE_API strobe {

class ResourcePolicy;

/// A text file that locations refer to.
struct Source {
    std::filesystem::path path; ///< as shown to the user
    std::string_view text;      ///< the whole contents, kept alive by `owner`
    std::shared_ptr<const void> owner;
    /// The directory of the scene file given on the command line. Relative file names are resolved against
    /// the directory of `path` first, and then against this directory.
    std::filesystem::path mainDirectory;
    std::shared_ptr<const ResourcePolicy>
        policy; ///< restricts the files that the text may refer to; may be null

    explicit Source(std::filesystem::path path = {}, std::string_view text = {},
                    std::shared_ptr<const void> owner = {}, std::filesystem::path mainDirectory = {},
                    std::shared_ptr<const ResourcePolicy> policy = {})
        : path(std::move(path)), text(text), owner(std::move(owner)), mainDirectory(std::move(mainDirectory)),
          policy(std::move(policy)) {}
    /// Returns the number of line breaks before `offset`. Thread-safe; builds an index on the first call,
    /// since large scenes need the line of every material.
    size_t linesBefore(size_t offset) const;

  private:
    static constexpr size_t kIndexStride = 4096; ///< bytes between index entries
    mutable std::once_flag m_indexOnce;
    mutable std::vector<size_t> m_lineIndex; ///< number of line breaks before each multiple of kIndexStride
};

/// A position in a source text. A default-constructed location has no source: the command line, or a scene
/// that a program has built.
struct Location {
    std::shared_ptr<const Source> source;
    size_t offset = 0; ///< in bytes

    explicit operator bool() const { return source != nullptr; }
    /// Returns the 1-based line and column (in bytes); {0, 0} without a source.
    std::pair<int, int> lineColumn() const;
    /// Returns "file:line:column"; an empty string without a source.
    std::string toString() const;
};

/// The cause of an error; determines the exit code of the command line.
enum class ErrorKind { Usage, Scene, Output };

/// The exception type of the library.
class Error : public std::runtime_error {
  public:
    Error(Location where, const std::string& message, ErrorKind kind = ErrorKind::Scene)
        : std::runtime_error(message), location(std::move(where)), kind(kind) {}
    explicit Error(const std::string& message, ErrorKind kind = ErrorKind::Scene)
        : Error(Location{}, message, kind) {}

    Location location;
    ErrorKind kind;
};

} // namespace strobe
