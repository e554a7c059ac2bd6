#include "session/aov_recorder.h"

namespace strobe {

namespace {

bool isExr(const std::filesystem::path& output) { return output.extension() == ".exr"; }

} // namespace

AovRecorder::AovRecorder(const Options& options, const BuiltScene& built, spdlog::logger& log) {
    if (!options.aovs.empty() && std::none_of(options.outputs.begin(), options.outputs.end(), isExr))
        log.warn("--aov: there is no .exr output to hold the layers");
    if (const auto light = aovsOf(options.aovs, AovGroup::Light); !light.empty())
        m_lightAovs = std::make_unique<LightFilm>(built.pixelBounds, light, built.lightGroups);
    const std::vector<Aov> visible = aovsOf(options.aovs, AovGroup::Visible);
    if (visible.empty())
        return;
    m_surfaceAovs = std::make_unique<AovFilm>(
        *built.scene, *built.sampler.sampler, built.pixelBounds,
        AovFilmSettings{visible, built.cryptomatteMaterialNames, options.cryptoLevels});
    for (const std::string& warning : m_surfaceAovs->warnings())
        log.warn("{}", warning);
}

RecordedAovs AovRecorder::recorded() const {
    RecordedAovs aovs;
    if (m_surfaceAovs)
        aovs.values = m_surfaceAovs->channels();
    if (m_lightAovs)
        for (AovChannel& channel : m_lightAovs->channels())
            aovs.values.push_back(std::move(channel));
    for (const AovChannel& channel : aovs.values) {
        if (aovs.parts.empty() || aovs.parts.back().name != channel.layer)
            aovs.parts.push_back({channel.layer, {}});
        aovs.parts.back().channels.push_back(
            {channel.layer + '.' + channel.name, channel.values.data(), 1, channel.exact});
    }
    if (m_surfaceAovs)
        aovs.metadata = m_surfaceAovs->metadata();
    return aovs;
}

} // namespace strobe
