#include "core/render/light_film.h"

#include <algorithm>

namespace strobe {

const std::vector<LightLayerInfo>& lightLayerTable() {
    static const std::vector<LightLayerInfo> table = {
        {LightLayer::Direct, "direct", "light that comes straight from where it shines"},
        {LightLayer::Indirect, "indirect", "the rest"},
        {LightLayer::Groups, "lightgroups", "a layer for each group of lights"},
    };
    return table;
}

LightFilm::LightFilm(const PixelBounds& pixelBounds, std::vector<LightLayer> layers,
                     std::vector<std::string> groups)
    : m_pixelBounds(pixelBounds), m_layers(std::move(layers)),
      m_groups(std::move(groups)), m_split{has(LightLayer::Direct) || has(LightLayer::Indirect),
                                           has(LightLayer::Groups) ? int(m_groups.size()) : 0},
      m_sums(size_t(m_split.count()),
             std::vector<PixelAccumulator>(size_t(pixelBounds.width()) * size_t(pixelBounds.height()))) {}

bool LightFilm::has(LightLayer layer) const {
    return std::find(m_layers.begin(), m_layers.end(), layer) != m_layers.end();
}

std::vector<AovChannel> LightFilm::channels() const {
    std::vector<AovChannel> out;
    for (const LightLayer layer : {LightLayer::Direct, LightLayer::Indirect})
        if (has(layer))
            append(lightLayerTable()[size_t(layer)].name, size_t(layer), out);
    for (size_t group = 0; group < size_t(m_split.groups); ++group)
        append("light_" + m_groups[group], (m_split.byBounce ? 2 : 0) + group, out);
    return out;
}

void LightFilm::append(const std::string& layer, size_t component, std::vector<AovChannel>& out) const {
    const std::vector<PixelAccumulator>& sums = m_sums[component];
    for (int c = 0; c < 3; ++c) {
        AovChannel& channel = out.emplace_back();
        channel.layer = layer;
        channel.name = "RGB"[c];
        for (const PixelAccumulator& sum : sums)
            channel.values.push_back(sum.mean()[c]);
    }
}

} // namespace strobe
