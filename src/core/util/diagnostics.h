// Warnings and notes, and the text form of errors.
#pragma once

#include "core/math/api.h"
#include "core/util/error.h"

#include <functional>
#include <set>

namespace STROBE_API strobe {

/// Returns "file:line:column: severity: message", followed by the source line and a caret below the column;
/// only "severity: message" if `where` has no source. Bytes of the source line that are not printable ASCII
/// are shown as '?', tabs as spaces. Long lines are cut to a window around the caret.
std::string formatDiagnostic(const Location& where, std::string_view severity, std::string_view message);

/// Receives warnings (the image will differ from what the scene says) and notes (it will not), and passes
/// each distinct one to a sink once. Not thread-safe: threads use a recorder each.
class Diagnostics {
  public:
    using Sink = std::function<void(const std::string& formatted)>;
    /// Discards all warnings, but counts them.
    Diagnostics() = default;
    /// `notes`: empty: `sink` receives the notes, too.
    explicit Diagnostics(Sink sink, Sink notes = {})
        : m_sink(std::move(sink)), m_notes(notes ? std::move(notes) : m_sink) {}
    /// Returns an object that only records, for `replayTo`.
    static Diagnostics recorder();
    /// Sends all that was recorded to `other`, in order.
    void replayTo(Diagnostics& other) const;

    /// Reports `message` unless the same message was reported at the same location before.
    void warn(const Location& where, const std::string& message) { report({false, "", where, message}); }
    /// Reports `message` on the first call with this `key`.
    void warnOnce(const std::string& key, const Location& where, const std::string& message) {
        report({false, key, where, message});
    }
    /// As warn and warnOnce, of what does not change the image.
    void note(const Location& where, const std::string& message) { report({true, "", where, message}); }
    void noteOnce(const std::string& key, const Location& where, const std::string& message) {
        report({true, key, where, message});
    }
    /// Returns the number of warnings reported, without notes.
    int count() const { return m_count; }
    /// Whether readers refuse files that do not conform to their format; else they warn and carry on.
    bool isStrict() const { return m_isStrict; }
    void setStrict(bool isStrict) { m_isStrict = isStrict; }

  private:
    struct Record {
        bool isNote;
        std::string key; ///< of warnOnce and noteOnce; else empty
        Location where;
        std::string message;
    };
    void report(const Record& record);

    Sink m_sink, m_notes;
    bool m_isRecorder = false, m_isStrict = false;
    std::vector<Record> m_records;
    std::set<std::string> m_reported; ///< keys and formatted messages
    int m_count = 0;
};

} // namespace strobe
