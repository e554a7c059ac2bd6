#include "session/files/part.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace strobe {

namespace {

constexpr int kMaxResolution = 1 << 16; ///< pixels along a side

bool isInside(const PixelBounds& inner, const PixelBounds& outer) {
    return inner.x0 >= outer.x0 && inner.y0 >= outer.y0 && inner.x1 <= outer.x1 && inner.y1 <= outer.y1 &&
           inner.x0 < inner.x1 && inner.y0 < inner.y1;
}

bool isConsistent(const PartSlices& slices, const PartHeader& part) {
    const InterleavedTiles& tiles = slices.tiles;
    return tiles.window == part.pixelBounds && tiles.edge >= 1 && tiles.edge <= kMaxResolution &&
           tiles.count >= 1 && tiles.count <= kMaxSlices && tiles.count <= tiles.tileCount() &&
           !slices.numbers.empty() && std::is_sorted(slices.numbers.begin(), slices.numbers.end()) &&
           slices.numbers.back() < tiles.count;
}

/// Whether the rows of all boxes are few enough for CoveredPixels.
bool haveFewRows(const std::vector<SampleBox>& boxes) {
    constexpr uint64_t kMaxRows = 1 << 26;
    uint64_t rows = 0;
    for (const SampleBox& box : boxes)
        rows += uint64_t(box.pixelBounds.height());
    return rows <= kMaxRows;
}

} // namespace

std::string changedFiles(const std::vector<std::pair<std::string, uint64_t>>& before,
                         const std::vector<std::pair<std::string, uint64_t>>& now) {
    const std::map<std::string, uint64_t> old(before.begin(), before.end()), current(now.begin(), now.end());
    std::string text;
    const auto add = [&](const std::string& name, const char* change) {
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, change);
    };
    for (const auto& [name, hash] : current)
        if (const auto it = old.find(name); it == old.end())
            add(name, "is new");
        else if (it->second != hash)
            add(name, "has changed");
    for (const auto& [name, hash] : old)
        if (!current.contains(name))
            add(name, "is no longer used");
    return text.empty() ? "a file has changed" : text;
}

std::string PartHeader::keyValue(const std::string& name) const {
    const auto it =
        std::find_if(key.begin(), key.end(), [&](const auto& entry) { return entry.first == name; });
    return it == key.end() ? "" : it->second;
}

std::string differenceOf(const PartHeader& part, const PartHeader& more) {
    for (size_t i = 0; i < std::max(part.key.size(), more.key.size()); ++i) {
        if (i >= part.key.size() || i >= more.key.size() || part.key[i].first != more.key[i].first)
            return "it is a part of another render: the settings differ";
        if (part.key[i].second == more.key[i].second)
            continue;
        if (part.key[i].first == PartHeader::kScene)
            return "it is a part of another scene: " + changedFiles(more.files, part.files);
        return fmt::format("it is a part of another render: {} is {}, not {}", part.key[i].first,
                           more.key[i].second, part.key[i].second);
    }
    if (part.fullWidth != more.fullWidth || part.fullHeight != more.fullHeight)
        return fmt::format("it is a part of another render: the frame has {}x{} pixels, not {}x{}",
                           more.fullWidth, more.fullHeight, part.fullWidth, part.fullHeight);
    if (part.samplesPerPixel != more.samplesPerPixel)
        return fmt::format("it is a part of another render: pixels have {} samples, not {}",
                           more.samplesPerPixel, part.samplesPerPixel);
    return "";
}

bool isWithin(const PartHeader& part, const PixelBounds& pixels, const SampleSlice& samples) {
    return isInside(pixels, part.pixelBounds) && samples.first < samples.end &&
           samples.end <= uint32_t(part.samplesPerPixel);
}

bool isConsistent(const PartHeader& part) {
    if (part.fullWidth < 1 || part.fullHeight < 1 || part.fullWidth > kMaxResolution ||
        part.fullHeight > kMaxResolution || part.samplesPerPixel < 1 || part.boxes.empty() ||
        !isInside(part.pixelBounds, {0, 0, part.fullWidth, part.fullHeight}) || part.layout.cryptoLevels == 0)
        return false;
    return (!part.slices || isConsistent(*part.slices, part)) &&
           std::all_of(part.boxes.begin(), part.boxes.end(),
                       [&](const SampleBox& box) { return isWithin(part, box.pixelBounds, box.samples); }) &&
           haveFewRows(part.boxes);
}

CoveredPixels::CoveredPixels(const PartHeader& part)
    : m_firstRow(part.pixelBounds.y0), m_rows(size_t(part.pixelBounds.height())) {
    for (const SampleBox& box : part.boxes)
        for (int y = box.pixelBounds.y0; y < box.pixelBounds.y1; ++y)
            m_rows[size_t(y - m_firstRow)].emplace_back(box.pixelBounds.x0, box.pixelBounds.x1);
    for (auto& row : m_rows) {
        std::sort(row.begin(), row.end());
        std::vector<std::pair<int, int>> joined;
        for (const auto& [x0, x1] : row)
            if (!joined.empty() && x0 <= joined.back().second)
                joined.back().second = std::max(joined.back().second, x1);
            else
                joined.emplace_back(x0, x1);
        row = std::move(joined);
    }
}

size_t CoveredPixels::countOf(int y) const {
    size_t count = 0;
    forRow(y, [&](int x0, int x1) { count += size_t(x1 - x0); });
    return count;
}

} // namespace strobe
