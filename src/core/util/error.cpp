#include "core/util/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace strobe {
namespace {

constexpr size_t kMaxShown = 110;     // columns of a source line that are shown
constexpr size_t kShownBefore = 70;   // of these, left of the caret
constexpr size_t kMaxNameLength = 64; // longer names resemble nothing: keeps the edit distance cheap

struct Line {
    size_t begin, end;
};

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

/// The source line and the caret below it.
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

size_t Source::linesBefore(size_t offset) const {
    const auto linesIn = [&](size_t begin, size_t end) {
        return size_t(std::count(text.begin() + ptrdiff_t(begin), text.begin() + ptrdiff_t(end), '\n'));
    };
    std::call_once(m_once, [&] { // large scenes are asked for the lines of all their materials
        m_lines.push_back(0);
        for (size_t begin = 0; begin + kBlock <= text.size(); begin += kBlock)
            m_lines.push_back(m_lines.back() + linesIn(begin, begin + kBlock));
    });
    const size_t end = std::min(offset, text.size()), block = end / kBlock;
    return m_lines[block] + linesIn(block * kBlock, end);
}

std::pair<int, int> Location::lineColumn() const {
    if (!source)
        return {0, 0};
    const size_t end = std::min(offset, source->text.size()), lines = source->linesBefore(end);
    return {static_cast<int>(lines) + 1, static_cast<int>(end - lineAround(source->text, end).begin) + 1};
}

std::string Location::toString() const {
    if (!source)
        return {};
    const auto [line, column] = lineColumn();
    return fmt::format("{}:{}:{}", source->path.string(), line, column);
}

std::string formatDiagnostic(const Location& where, std::string_view severity, std::string_view message) {
    if (!where)
        return fmt::format("{}: {}", severity, message);
    const std::string_view text = where.source->text;
    return fmt::format("{}: {}: {}\n{}", where.toString(), severity, message,
                       excerpt(text, std::min(where.offset, text.size())));
}

Diagnostics Diagnostics::recorder() {
    Diagnostics messages;
    messages.m_records = true;
    return messages;
}

void Diagnostics::replayTo(Diagnostics& other) const {
    for (const Told& told : m_told)
        if (told.key.empty())
            other.warn(told.where, told.message);
        else
            other.warnOnce(told.key, told.where, told.message);
}

void Diagnostics::warn(const Location& where, const std::string& message) {
    if (m_records)
        m_told.push_back({"", where, message});
    const std::string formatted = formatDiagnostic(where, "warning", message);
    if (!m_seen.insert("text:" + formatted).second)
        return;
    ++m_count;
    if (m_sink)
        m_sink(formatted);
}

void Diagnostics::warnOnce(const std::string& key, const Location& where, const std::string& message) {
    if (m_records)
        m_told.push_back({key, where, message});
    else if (m_seen.insert("key:" + key).second)
        warn(where, message);
}

size_t editDistance(std::string_view a, std::string_view b) {
    if (a.size() > kMaxNameLength || b.size() > kMaxNameLength)
        return a == b ? 0 : std::max(a.size(), b.size());
    // Levenshtein's table, row by row; a swap of neighbors counts once (optimal string alignment).
    std::array<std::array<size_t, kMaxNameLength + 1>, 3> rows{};
    for (size_t j = 0; j <= b.size(); ++j)
        rows[0][j] = j;
    for (size_t i = 1; i <= a.size(); ++i) {
        auto& row = rows[i % 3];
        const auto& above = rows[(i + 2) % 3];
        row[0] = i;
        for (size_t j = 1; j <= b.size(); ++j) {
            const size_t substitution = above[j - 1] + (a[i - 1] != b[j - 1]);
            row[j] = std::min({above[j] + 1, row[j - 1] + 1, substitution});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = std::min(row[j], rows[(i + 1) % 3][j - 2] + 1);
        }
    }
    return rows[a.size() % 3][b.size()];
}

std::string unknownName(const std::string& kind, const std::string& name,
                        const std::vector<std::string>& known) {
    std::string message = "unknown " + kind + " \"" + name + "\"";
    if (const std::string nearest = nearestName(name, known); !nearest.empty())
        message += "; did you mean \"" + nearest + "\"?";
    message += known.empty() ? " (there is none" : " (known: ";
    for (size_t i = 0; i < known.size(); ++i)
        message += (i ? ", " : "") + known[i];
    return message + ")";
}

} // namespace strobe
