// Warnings, and the text form of errors and warnings.
#pragma once

#include "core/util/error.h"

#include <functional>
#include <set>

namespace strobe {

/// Returns "file:line:column: severity: message", followed by the source line and a caret below the column;
/// only "severity: message" if `where` has no source. Bytes of the source line that are not printable ASCII
/// are shown as '?', tabs as spaces. Long lines are cut to a window around the caret.
std::string formatDiagnostic(const Location& where, std::string_view severity, std::string_view message);

/// Receives warnings and passes each distinct one to a sink once. Not thread-safe: threads use a recorder
/// each.
class Diagnostics {
  public:
    using Sink = std::function<void(const std::string& formatted)>;
    /// Discards all warnings, but counts them.
    Diagnostics() = default;
    explicit Diagnostics(Sink sink) : m_sink(std::move(sink)) {}
    /// Returns an object that only records warnings, for `replayTo`.
    static Diagnostics recorder();
    /// Sends all recorded warnings to `other`, in order.
    void replayTo(Diagnostics& other) const;

    /// Reports `message` unless the same message was reported at the same location before.
    void warn(const Location& where, const std::string& message);
    /// Reports `message` on the first call with this `key`.
    void warnOnce(const std::string& key, const Location& where, const std::string& message);
    /// Returns the number of warnings reported.
    int count() const { return m_count; }

  private:
    struct Record {
        std::string key; ///< of warnOnce; empty for warn
        Location where;
        std::string message;
    };
    Sink m_sink;
    bool m_isRecorder = false;
    std::vector<Record> m_records;
    std::set<std::string> m_reported; ///< keys and formatted warnings
    int m_count = 0;
};

} // namespace strobe
