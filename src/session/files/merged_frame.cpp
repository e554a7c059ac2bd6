#include "session/files/merged_frame.h"

#include "core/render/render_settings.h"

#include <algorithm>

namespace strobe {

MergedFrame::MergedFrame(const PartHeader& header)
    : m_header(header), m_film(header.fullWidth, header.fullHeight, header.pixelBounds) {
    m_film.enableAccumulation();
    const AovLayout& layout = header.layout;
    if (!aovsInGroup(layout.aovs, AovGroup::Visible).empty())
        m_surfaces.emplace(header.pixelBounds, layout);
    if (const auto light = aovsInGroup(layout.aovs, AovGroup::Light); !light.empty())
        m_lights.emplace(header.pixelBounds, light, layout.lightGroups);
}

void MergedFrame::add(PartReader& part) {
    AovSums* const surfaces = m_surfaces ? &*m_surfaces : nullptr;
    LightFilm* const lights = m_lights ? &*m_lights : nullptr;
    part.read({[&](int x, int y, const PixelAccumulator& sum) { m_film.add(x, y, sum); },
               [&](FilmRecord record) { m_film.records().add(std::move(record)); },
               [&](const FilmRecord& record) { loadLayers(record, surfaces, lights); }});
    m_film.records().setNote(part.header().keyValue(PartHeader::kNote));
}

void MergedFrame::writePart(const std::filesystem::path& file) const {
    constexpr int kTile = 64;
    PartWriter writer(m_header);
    writer.addSums(m_film.sums());
    for (const FilmRecord& record : m_film.records().all())
        writer.addRecord(record);
    const PixelBounds& bounds = m_header.pixelBounds;
    const SampleSlice all{0, uint32_t(m_header.samplesPerPixel)};
    for (int y = bounds.y0; y < bounds.y1 && (m_surfaces || m_lights); y += kTile)
        for (int x = bounds.x0; x < bounds.x1; x += kTile) {
            const PixelBounds tile{x, y, std::min(x + kTile, bounds.x1), std::min(y + kTile, bounds.y1)};
            writer.addLayers({tile, all, storeLayers(tile, surfaces(), lights())});
        }
    writer.write(file);
}

uint64_t MergedFrame::missingSamples() const {
    const uint64_t samplesPerPixel = uint64_t(m_header.samplesPerPixel);
    uint64_t missing = 0;
    for (const PixelAccumulator& sum : m_film.sums())
        missing += samplesPerPixel -
                   std::min(samplesPerPixel, uint64_t(sum.validCount()) + uint64_t(sum.invalidCount()));
    return missing;
}

uint64_t invalidSamples(const std::vector<PixelAccumulator>& sums) {
    uint64_t count = 0;
    for (const PixelAccumulator& sum : sums)
        count += sum.invalidCount();
    return count;
}

} // namespace strobe
