// Suggestions for misspelled names, in error messages.
#pragma once

#include "core/math/api.h"

#include <string>
#include <string_view>
#include <vector>

namespace STROBE_API strobe {

/// Returns the edit distance of two names (optimal string alignment: insertions, deletions, substitutions and
/// swaps of neighboring letters). For names longer than 64 bytes, returns 0 if they are equal, else the
/// longer length.
size_t editDistance(std::string_view a, std::string_view b);

/// Returns the element of `names` with the smallest edit distance to `name`; an empty string if more than a
/// third of the letters of `name` would have to change.
template <class Range>
std::string nearestName(std::string_view name, const Range& names) {
    std::string best;
    size_t bestDistance = name.size() / 3 + 1;
    for (const auto& candidate : names) {
        const size_t distance = editDistance(name, candidate);
        if (distance < bestDistance) {
            bestDistance = distance;
            best = candidate;
        }
    }
    return best;
}

/// Returns the error message `unknown KIND "NAME"; did you mean "…"? (known: …)`.
std::string unknownName(const std::string& kind, const std::string& name,
                        const std::vector<std::string>& known);

} // namespace strobe
