#include "core/util/error.h"

#include <fmt/format.h>

#include <algorithm>

namespace strobe {

size_t Source::linesBefore(size_t offset) const {
    const auto countLineBreaks = [&](size_t begin, size_t end) {
        return size_t(std::count(text.begin() + ptrdiff_t(begin), text.begin() + ptrdiff_t(end), '\n'));
    };
    std::call_once(m_indexOnce, [&] {
        m_lineIndex.push_back(0);
        for (size_t begin = 0; begin + kIndexStride <= text.size(); begin += kIndexStride)
            m_lineIndex.push_back(m_lineIndex.back() + countLineBreaks(begin, begin + kIndexStride));
    });
    const size_t end = std::min(offset, text.size());
    const size_t entry = end / kIndexStride;
    return m_lineIndex[entry] + countLineBreaks(entry * kIndexStride, end);
}

std::pair<int, int> Location::lineColumn() const {
    if (!source)
        return {0, 0};
    const size_t end = std::min(offset, source->text.size());
    const size_t lineBreak = end == 0 ? std::string_view::npos : source->text.rfind('\n', end - 1);
    const size_t lineBegin = lineBreak == std::string_view::npos ? 0 : lineBreak + 1;
    return {static_cast<int>(source->linesBefore(end)) + 1, static_cast<int>(end - lineBegin) + 1};
}

std::string Location::toString() const {
    if (!source)
        return {};
    const auto [line, column] = lineColumn();
    return fmt::format("{}:{}:{}", source->path.string(), line, column);
}

} // namespace strobe
