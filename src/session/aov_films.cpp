#include "session/aov_films.h"

namespace strobe {

namespace {

bool isExr(const std::filesystem::path& output) { return output.extension() == ".exr"; }

} // namespace

AovFilms::AovFilms(const Options& options, const BuiltScene& built, spdlog::logger& log) {
    if (!options.aovs.empty() && std::none_of(options.outputs.begin(), options.outputs.end(), isExr))
        log.warn("--aov: there is no .exr output to hold the layers");
    if (const auto light = aovsOf(options.aovs, AovGroup::Light); !light.empty())
        m_lights = std::make_unique<LightFilm>(built.pixelBounds, light, built.lightGroups);
    const std::vector<Aov> visible = aovsOf(options.aovs, AovGroup::Visible);
    if (visible.empty())
        return;
    m_features = std::make_unique<AovFilm>(
        *built.scene, *built.sampler.sampler, built.pixelBounds,
        AovFilmSettings{visible, built.cryptomatteMaterialNames, options.cryptoLevels});
    for (const std::string& warning : m_features->warnings())
        log.warn("{}", warning);
}

DevelopedAovs AovFilms::develop() const {
    DevelopedAovs aovs;
    if (m_features)
        aovs.values = m_features->channels();
    if (m_lights)
        for (AovChannel& channel : m_lights->channels())
            aovs.values.push_back(std::move(channel));
    for (const AovChannel& channel : aovs.values) {
        if (aovs.parts.empty() || aovs.parts.back().name != channel.layer)
            aovs.parts.push_back({channel.layer, {}});
        aovs.parts.back().channels.push_back(
            {channel.layer + '.' + channel.name, channel.values.data(), 1, channel.exact});
    }
    if (m_features)
        aovs.metadata = m_features->metadata();
    return aovs;
}

} // namespace strobe
