#include "session/aov_recorder.h"

#include "session/files/part.h"

namespace strobe {

AovRecorder::AovRecorder(const std::vector<Aov>& aovs, int cryptomatteEntries, const BuiltScene& built,
                         const Log& log) {
    if (const auto light = aovsInGroup(aovs, AovGroup::Light); !light.empty())
        m_lightAovs = std::make_unique<LightFilm>(built.pixelBounds, light, built.lightGroups);
    const std::vector<Aov> visible = aovsInGroup(aovs, AovGroup::Visible);
    if (visible.empty())
        return;
    m_surfaceAovs = std::make_unique<AovFilm>(
        *built.scene, *built.sampler.sampler, built.pixelBounds,
        AovFilmSettings{visible, built.cryptomatteMaterialNames, cryptomatteEntries});
    for (const std::string& warning : m_surfaceAovs->sums().warnings())
        log.warn("{}", warning);
}

RecordedAovs recordedAovs(const AovSums* surfaces, const LightFilm* lights) {
    std::vector<AovChannel> channels;
    if (surfaces)
        channels = surfaces->channels();
    if (lights)
        for (AovChannel& channel : lights->channels())
            channels.push_back(std::move(channel));
    RecordedAovs aovs = recordedAovs(std::move(channels));
    if (surfaces)
        aovs.metadata = surfaces->metadata();
    return aovs;
}

RecordedAovs recordedAovs(std::vector<AovChannel> channels) {
    RecordedAovs aovs;
    aovs.channels = std::move(channels);
    for (const AovChannel& channel : aovs.channels) {
        if (channel.layer == aovInfo(Aov::Alpha).name) {
            aovs.alpha = channel.values;
            continue;
        }
        if (aovs.parts.empty() || aovs.parts.back().name != channel.layer)
            aovs.parts.push_back({channel.layer, {}});
        aovs.parts.back().channels.push_back(
            {channel.layer + '.' + channel.name, channel.values.data(), 1, channel.exact});
    }
    return aovs;
}

AovLayout layoutOf(const RenderSettings& settings) {
    AovLayout layout;
    if (settings.aovs)
        layout = settings.aovs->sums().layout();
    if (settings.lights) {
        const auto& light = settings.lights->layers();
        layout.aovs.insert(layout.aovs.end(), light.begin(), light.end());
        layout.lightGroups = settings.lights->groups();
    }
    return layout;
}

} // namespace strobe
