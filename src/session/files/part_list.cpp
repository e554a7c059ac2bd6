#include "session/files/part_list.h"

#include "core/util/error.h"
#include "session/files/part_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace strobe {

namespace {

namespace fs = std::filesystem;

/// A file and its header.
struct Part {
    fs::path file;
    PartHeader header;
};

/// The errors of a merge.
class Problems {
  public:
    void add(std::string text) { m_texts.push_back(std::move(text)); }
    /// Throws Error of kind Usage if there are any.
    void throwIfAny() const {
        constexpr size_t kMaxShown = 20;
        if (m_texts.empty())
            return;
        std::string text = m_texts.front();
        for (size_t i = 1; i < std::min(m_texts.size(), kMaxShown); ++i)
            text += "\n       " + m_texts[i]; // below the first, after "error: "
        if (m_texts.size() > kMaxShown)
            text += fmt::format("\n       and {} more", m_texts.size() - kMaxShown);
        throw Error(text, ErrorKind::Usage);
    }

  private:
    std::vector<std::string> m_texts;
};

/// Returns the parts of the render with the most parts. Adds the others to `problems`.
std::vector<Part> partsOfOneRender(std::vector<Part> parts, Problems& problems) {
    std::vector<std::vector<Part>> renders;
    for (Part& part : parts) {
        const auto same = std::find_if(renders.begin(), renders.end(), [&](const auto& render) {
            return differenceOf(render.front().header, part.header).empty();
        });
        if (same == renders.end()) {
            renders.emplace_back();
            renders.back().push_back(std::move(part));
        } else {
            part.header.files = {}; // equal to those of the first
            same->push_back(std::move(part));
        }
    }
    const auto most = std::max_element(renders.begin(), renders.end(),
                                       [](const auto& a, const auto& b) { return a.size() < b.size(); });
    for (auto render = renders.begin(); render != renders.end(); ++render)
        if (render != most)
            for (const Part& part : *render)
                problems.add(part.file.string() + ": " +
                             differenceOf(most->front().header, render->front().header));
    return std::move(*most);
}

bool overlap(const SampleBox& a, const SampleBox& b) {
    return a.pixelBounds.x0 < b.pixelBounds.x1 && b.pixelBounds.x0 < a.pixelBounds.x1 &&
           a.pixelBounds.y0 < b.pixelBounds.y1 && b.pixelBounds.y0 < a.pixelBounds.y1 &&
           a.samples.first < b.samples.end && b.samples.first < a.samples.end;
}

/// Finds parts with common samples. Boxes are compared with those that share a cell of 64x64 pixels.
class OverlapSearch {
  public:
    explicit OverlapSearch(Problems& problems) : m_problems(problems) {}

    /// Compares a part with those added before.
    void add(const Part& part) {
        if (reportSameSlice(part))
            return;
        for (const SampleBox& box : part.header.boxes)
            if (const Entry* other = findOverlap(part, box)) {
                m_problems.add(fmt::format("{}: samples {}:{} of pixels {} {} {} {} overlap those of {}",
                                           part.file.string(), box.samples.first, box.samples.end,
                                           box.pixelBounds.x0, box.pixelBounds.x1, box.pixelBounds.y0,
                                           box.pixelBounds.y1, other->part->file.string()));
                break;
            }
        for (const SampleBox& box : part.header.boxes)
            forCellsOf(box, [&](auto& entries) { entries.push_back({&part, &box}); });
    }

  private:
    struct Entry {
        const Part* part;
        const SampleBox* box;
    };
    static bool haveSameTiles(const Part& a, const Part& b) {
        return a.header.slices && b.header.slices && a.header.slices->tiles == b.header.slices->tiles;
    }
    /// Reports the first slice of the part that another part has.
    bool reportSameSlice(const Part& part) {
        if (!part.header.slices)
            return false;
        for (const uint32_t number : part.header.slices->numbers) {
            const auto [first, isNew] = m_partOfSlice.emplace(number, &part);
            if (isNew || !haveSameTiles(*first->second, part))
                continue;
            m_problems.add(fmt::format("{}: slice {} of {} is also in {}", part.file.string(), number + 1,
                                       part.header.slices->tiles.count, first->second->file.string()));
            return true;
        }
        return false;
    }
    template <class Work>
    void forCellsOf(const SampleBox& box, const Work& work) {
        constexpr int kCell = 64;
        const PixelBounds& b = box.pixelBounds;
        for (int y = b.y0 / kCell; y <= (b.y1 - 1) / kCell; ++y)
            for (int x = b.x0 / kCell; x <= (b.x1 - 1) / kCell; ++x)
                work(m_cells[{y, x}]);
    }
    /// Returns an entry of another part that overlaps the box; null if there is none. Different slices of the
    /// same tiles do not overlap.
    const Entry* findOverlap(const Part& part, const SampleBox& box) {
        const Entry* found = nullptr;
        forCellsOf(box, [&](const auto& entries) {
            for (const Entry& entry : entries)
                if (!haveSameTiles(*entry.part, part) && overlap(*entry.box, box))
                    found = &entry;
        });
        return found;
    }

    Problems& m_problems;
    std::map<uint32_t, const Part*> m_partOfSlice;
    std::map<std::pair<int, int>, std::vector<Entry>> m_cells; ///< by row and column
};

/// Returns the slices of all parts, if all of them are slices of the same tiles.
std::optional<PartSlices> slicesOf(const std::vector<Part>& parts) {
    std::optional<PartSlices> all = parts.front().header.slices;
    for (size_t i = 1; i < parts.size() && all; ++i) {
        const std::optional<PartSlices>& slices = parts[i].header.slices;
        if (!slices || !(slices->tiles == all->tiles))
            return std::nullopt;
        all->numbers.insert(all->numbers.end(), slices->numbers.begin(), slices->numbers.end());
    }
    if (all)
        std::sort(all->numbers.begin(), all->numbers.end());
    return all;
}

PartHeader mergedHeader(const std::vector<Part>& parts) {
    PartHeader merged = parts.front().header;
    PixelBounds& bounds = merged.pixelBounds;
    merged.slices = slicesOf(parts);
    for (size_t i = 1; i < parts.size(); ++i) {
        const PartHeader& more = parts[i].header;
        merged.boxes.insert(merged.boxes.end(), more.boxes.begin(), more.boxes.end());
        bounds = {std::min(bounds.x0, more.pixelBounds.x0), std::min(bounds.y0, more.pixelBounds.y0),
                  std::max(bounds.x1, more.pixelBounds.x1), std::max(bounds.y1, more.pixelBounds.y1)};
    }
    return merged;
}

} // namespace

PartList::PartList(const std::vector<fs::path>& files, bool allowMissing) {
    Problems problems;
    std::vector<Part> parts;
    for (const fs::path& file : files) {
        std::error_code ignored; // of a folder that cannot be read
        if (allowMissing && !fs::exists(file, ignored)) {
            m_absent.push_back(file);
            continue;
        }
        try {
            parts.push_back({file, PartReader(file).header()});
        } catch (const Error& e) {
            problems.add(e.what());
        }
    }
    if (parts.empty()) {
        problems.throwIfAny();
        throw Error("none of the parts exists", ErrorKind::Usage);
    }
    parts = partsOfOneRender(std::move(parts), problems);
    OverlapSearch search(problems);
    for (const Part& part : parts)
        search.add(part);
    problems.throwIfAny();
    m_merged = mergedHeader(parts);
    for (const Part& part : parts)
        m_files.push_back(part.file);
}

bool PartList::hasSlicesOfSamples() const {
    return std::any_of(m_merged.boxes.begin(), m_merged.boxes.end(), [&](const SampleBox& box) {
        return box.samples != SampleSlice{0, uint32_t(m_merged.samplesPerPixel)};
    });
}

std::string missingSlices(const PartHeader& part) {
    if (!part.slices)
        return "";
    const auto& [tiles, numbers] = *part.slices;
    std::string text;
    size_t missing = 0;
    for (uint32_t number = 0, first = 0; number <= tiles.count; ++number) {
        const bool isMissing =
            number < tiles.count && !std::binary_search(numbers.begin(), numbers.end(), number);
        if (isMissing)
            continue;
        const uint32_t count = number - first;
        if (count > 0)
            text += fmt::format("{}{}", text.empty() ? "" : ", ", first + 1);
        if (count > 1)
            text += fmt::format("-{}", number);
        missing += count;
        first = number + 1;
    }
    if (text.empty())
        return "";
    return missing == 1 ? fmt::format("slice {} of {} is missing", text, tiles.count)
                        : fmt::format("slices {} of {} are missing", text, tiles.count);
}

} // namespace strobe
