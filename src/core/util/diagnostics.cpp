#include "core/util/diagnostics.h"

#include <fmt/format.h>

#include <algorithm>

namespace strobe {
namespace {

constexpr size_t kMaxShown = 110;   ///< maximum number of columns shown of a source line
constexpr size_t kShownBefore = 70; ///< columns shown left of the caret, if the line is cut there

struct Line {
    size_t begin, end;
};

/// Returns the line that contains `offset`, without its line break.
Line lineAround(std::string_view text, size_t offset) {
    const size_t before = offset == 0 ? std::string_view::npos : text.rfind('\n', offset - 1);
    const size_t begin = before == std::string_view::npos ? 0 : before + 1;
    const size_t end = std::min(text.find('\n', offset), text.size());
    return {begin, end};
}

std::string printable(std::string_view bytes) {
    std::string shown(bytes);
    for (char& c : shown)
        c = c == '\t' ? ' ' : (c < ' ' || c > '~') ? '?' : c;
    return shown;
}

/// Returns the source line and a line with the caret.
std::string excerpt(std::string_view text, size_t offset) {
    Line line = lineAround(text, offset);
    if (line.end > line.begin && text[line.end - 1] == '\r')
        --line.end;
    const char* left = "";
    const char* right = "";
    if (offset > line.begin + kShownBefore && line.end - line.begin > kMaxShown) {
        line.begin = offset - kShownBefore;
        left = "...";
    }
    if (line.end > line.begin + kMaxShown) {
        line.end = line.begin + kMaxShown;
        right = "...";
    }
    const std::string shown = left + printable(text.substr(line.begin, line.end - line.begin)) + right;
    const size_t column = offset - line.begin + std::string_view(left).size();
    return fmt::format("  {}\n  {:>{}}", shown, "^", column + 1);
}

} // namespace

std::string formatDiagnostic(const Location& where, std::string_view severity, std::string_view message) {
    if (!where)
        return fmt::format("{}: {}", severity, message);
    const std::string_view text = where.source->text;
    return fmt::format("{}: {}: {}\n{}", where.toString(), severity, message,
                       excerpt(text, std::min(where.offset, text.size())));
}

Diagnostics Diagnostics::recorder() {
    Diagnostics diagnostics;
    diagnostics.m_isRecorder = true;
    return diagnostics;
}

void Diagnostics::replayTo(Diagnostics& other) const {
    for (const Record& record : m_records)
        other.report(record);
}

void Diagnostics::report(const Record& record) {
    if (m_isRecorder)
        m_records.push_back(record);
    if (!m_isRecorder && !record.key.empty() && !m_reported.insert("key:" + record.key).second)
        return;
    const std::string formatted =
        formatDiagnostic(record.where, record.isNote ? "note" : "warning", record.message);
    if (!m_reported.insert("text:" + formatted).second)
        return;
    m_count += !record.isNote;
    if (const Sink& sink = record.isNote ? m_notes : m_sink)
        sink(formatted);
}

} // namespace strobe
