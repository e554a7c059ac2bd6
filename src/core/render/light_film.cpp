#include "core/render/light_film.h"

#include <algorithm>

namespace strobe {

LightFilm::LightFilm(const PixelBounds& pixelBounds, std::vector<Aov> layers, std::vector<std::string> groups)
    : m_pixelBounds(pixelBounds), m_layers(std::move(layers)),
      m_groups(std::move(groups)), m_components{has(Aov::Direct) || has(Aov::Indirect),
                                                has(Aov::LightGroups) ? int(m_groups.size()) : 0},
      m_sums(size_t(m_components.count()),
             std::vector<PixelAccumulator>(size_t(pixelBounds.width()) * size_t(pixelBounds.height()))) {}

bool LightFilm::has(Aov layer) const {
    return std::find(m_layers.begin(), m_layers.end(), layer) != m_layers.end();
}

std::vector<AovChannel> LightFilm::channels() const {
    std::vector<AovChannel> out;
    if (has(Aov::Direct))
        appendChannels(aovInfo(Aov::Direct).name, 0, out);
    if (has(Aov::Indirect))
        appendChannels(aovInfo(Aov::Indirect).name, 1, out);
    for (size_t group = 0; group < size_t(m_components.groups); ++group)
        appendChannels("light_" + m_groups[group], (m_components.byBounce ? 2 : 0) + group, out);
    return out;
}

void LightFilm::appendChannels(const std::string& layer, size_t component,
                               std::vector<AovChannel>& out) const {
    const std::vector<PixelAccumulator>& sums = m_sums[component];
    for (int c = 0; c < 3; ++c) {
        AovChannel& channel = out.emplace_back();
        channel.layer = layer;
        channel.name = "RGB"[c];
        for (const PixelAccumulator& sum : sums)
            channel.values.push_back(sum.mean()[c]);
    }
}

void LightFilm::store(const PixelBounds& tile, std::string& bytes) const {
    for (const auto& sums : m_sums)
        for (int y = tile.y0; y < tile.y1; ++y)
            for (int x = tile.x0; x < tile.x1; ++x)
                storeSum(sums[index(x, y)], bytes);
}

bool LightFilm::load(const PixelBounds& tile, std::string_view& bytes) {
    for (auto& sums : m_sums)
        for (int y = tile.y0; y < tile.y1; ++y)
            for (int x = tile.x0; x < tile.x1; ++x)
                if (!loadSum(sums[index(x, y)], bytes))
                    return false;
    return true;
}

} // namespace strobe
