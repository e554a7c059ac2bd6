#include "session/aov_recorder.h"

namespace strobe {

namespace {

bool isExr(const std::filesystem::path& image) { return image.extension() == ".exr"; }

} // namespace

AovRecorder::AovRecorder(const OutputOptions& output, const BuiltScene& built, const Log& log) {
    if (!output.aovs.empty() && std::none_of(output.images.begin(), output.images.end(), isExr))
        log.warn("--aov: there is no .exr output to hold the layers");
    if (const auto light = aovsInGroup(output.aovs, AovGroup::Light); !light.empty())
        m_lightAovs = std::make_unique<LightFilm>(built.pixelBounds, light, built.lightGroups);
    const std::vector<Aov> visible = aovsInGroup(output.aovs, AovGroup::Visible);
    if (visible.empty())
        return;
    m_surfaceAovs = std::make_unique<AovFilm>(
        *built.scene, *built.sampler.sampler, built.pixelBounds,
        AovFilmSettings{visible, built.cryptomatteMaterialNames, output.cryptomatteEntries});
    for (const std::string& warning : m_surfaceAovs->warnings())
        log.warn("{}", warning);
}

RecordedAovs AovRecorder::recorded() const {
    RecordedAovs aovs;
    if (m_surfaceAovs) {
        aovs.channels = m_surfaceAovs->channels();
        aovs.metadata = m_surfaceAovs->metadata();
    }
    if (m_lightAovs)
        for (AovChannel& channel : m_lightAovs->channels())
            aovs.channels.push_back(std::move(channel));
    for (const AovChannel& channel : aovs.channels) {
        if (aovs.parts.empty() || aovs.parts.back().name != channel.layer)
            aovs.parts.push_back({channel.layer, {}});
        aovs.parts.back().channels.push_back(
            {channel.layer + '.' + channel.name, channel.values.data(), 1, channel.exact});
    }
    return aovs;
}

} // namespace strobe
