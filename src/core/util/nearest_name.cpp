#include "core/util/nearest_name.h"

#include <algorithm>
#include <array>

namespace strobe {
namespace {

constexpr size_t kMaxNameLength = 64; ///< bounds the cost of editDistance

} // namespace

size_t editDistance(std::string_view a, std::string_view b) {
    if (a.size() > kMaxNameLength || b.size() > kMaxNameLength)
        return a == b ? 0 : std::max(a.size(), b.size());
    // The dynamic programming table of the Levenshtein distance, of which the last three rows are kept.
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
