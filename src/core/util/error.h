// Located errors and warnings. One exception type; main shows it once, with the source line and a caret.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace strobe {

class ResourcePolicy;

/// A text file that locations point into. `mainDirectory` is the directory of the file given on the command
/// line: the second place where relative file names are looked for, after the file's own directory. `policy`:
/// what the text may have read; null: everything.
struct Source {
    std::filesystem::path path; ///< as the user would name it
    std::string_view text;      ///< whole contents; `owner` keeps it alive
    std::shared_ptr<const void> owner;
    std::filesystem::path mainDirectory;
    std::shared_ptr<const ResourcePolicy> policy;

    explicit Source(std::filesystem::path path = {}, std::string_view text = {},
                    std::shared_ptr<const void> owner = {}, std::filesystem::path mainDirectory = {},
                    std::shared_ptr<const ResourcePolicy> policy = {})
        : path(std::move(path)), text(text), owner(std::move(owner)), mainDirectory(std::move(mainDirectory)),
          policy(std::move(policy)) {}
    /// How many lines end before the offset.
    size_t linesBefore(size_t offset) const;

  private:
    static constexpr size_t kBlock = 4096;
    mutable std::once_flag m_once;
    mutable std::vector<size_t> m_lines; ///< those that end before each block of so many bytes
};

/// A place in a source text; default-constructed: nowhere (command line, or made by a program).
struct Location {
    std::shared_ptr<const Source> source;
    size_t offset = 0;

    explicit operator bool() const { return source != nullptr; }
    /// 1-based line and column (in bytes), counted on demand.
    std::pair<int, int> lineColumn() const;
    /// "file:line:column", or empty when nowhere.
    std::string toString() const;
};

/// Why a run failed: decides the exit code of the command line.
enum class ErrorKind { Usage, Scene, Output };

/// The one exception type of the library.
class Error : public std::runtime_error {
  public:
    Error(Location where, const std::string& message, ErrorKind kind = ErrorKind::Scene)
        : std::runtime_error(message), location(std::move(where)), kind(kind) {}
    explicit Error(const std::string& message, ErrorKind kind = ErrorKind::Scene)
        : Error(Location{}, message, kind) {}

    Location location;
    ErrorKind kind;
};

/// "file:line:column: error: message", the source line, and a caret under the column. Bytes that are not
/// printable ASCII are shown as '?', tabs as spaces, and long lines are cut to a window around the caret.
std::string formatDiagnostic(const Location& where, std::string_view severity, std::string_view message);

/// Receives warnings. Each (location, message) pair, and each `once` key, is reported a single time.
class Diagnostics {
  public:
    using Sink = std::function<void(const std::string& formatted)>;
    Diagnostics() = default; ///< keeps quiet
    explicit Diagnostics(Sink sink) : m_sink(std::move(sink)) {}
    /// Keeps quiet, but can repeat all that it was told: for work on another thread.
    static Diagnostics recorder();
    void replayTo(Diagnostics& other) const;
    void warn(const Location& where, const std::string& message);
    /// As warn, but only the first time that `key` is seen.
    void warnOnce(const std::string& key, const Location& where, const std::string& message);
    int count() const { return m_count; }

  private:
    struct Told {
        std::string key; ///< of warnOnce
        Location where;
        std::string message;
    };
    Sink m_sink;
    bool m_records = false;
    std::vector<Told> m_told;
    std::set<std::string> m_seen;
    int m_count = 0;
};

/// The name of `names` that a misspelt `name` most likely meant, or an empty string (edit distance).
template <class Range>
std::string nearestName(std::string_view name, const Range& names);
size_t editDistance(std::string_view a, std::string_view b);
/// `unknown KIND "NAME"; did you mean "…"? (known: …)`, for an error message.
std::string unknownName(const std::string& kind, const std::string& name,
                        const std::vector<std::string>& known);

template <class Range>
std::string nearestName(std::string_view name, const Range& names) {
    std::string best;
    size_t bestDistance = name.size() / 3 + 1; // with more letters wrong there is no resemblance
    for (const auto& candidate : names) {
        const size_t d = editDistance(name, candidate);
        if (d < bestDistance) {
            bestDistance = d;
            best = candidate;
        }
    }
    return best;
}

} // namespace strobe
