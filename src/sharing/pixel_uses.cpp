#include "sharing/pixel_uses.h"

#include <algorithm>
#include <numeric>

namespace strobe {

PixelUses::PixelUses(const std::vector<std::vector<CellUse>>& batches, size_t pixels)
    : m_first(pixels + 1, 0) {
    for (const auto& batch : batches)
        for (const CellUse& use : batch)
            ++m_first[use.pixel + 1];
    std::partial_sum(m_first.begin(), m_first.end(), m_first.begin());
    std::vector<uint32_t> next(m_first.begin(), m_first.end() - 1);
    m_uses.resize(m_first.back());
    for (const auto& batch : batches)
        for (const CellUse& use : batch)
            m_uses[next[use.pixel]++] = use;
}

std::vector<CellUse> merged(const std::vector<std::vector<CellUse>>& batches, size_t pixels) {
    const PixelUses sorted(batches, pixels);
    std::vector<CellUse> out;
    for (size_t pixel = 0; pixel < pixels; ++pixel) {
        const auto first = std::ptrdiff_t(out.size());
        for (const CellUse& use : sorted.of(pixel)) {
            const auto same = std::find_if(out.begin() + first, out.end(), [&](const CellUse& other) {
                return other.cell == use.cell && other.half == use.half;
            });
            if (same == out.end())
                out.push_back(use);
            else
                same->albedo += use.albedo;
        }
    }
    return out;
}

} // namespace strobe
