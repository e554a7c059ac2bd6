#include "session/aov_recorder.h"

#include "session/files/part.h"

namespace strobe {

namespace {

bool holdsLayers(const std::filesystem::path& image) {
    return imageFormatOf(image) == ImageFormat::Exr || isPart(image);
}

} // namespace

AovRecorder::AovRecorder(const OutputOptions& output, const BuiltScene& built, const Log& log) {
    const bool hasLayers =
        std::any_of(output.aovs.begin(), output.aovs.end(), [](Aov aov) { return aov != Aov::Alpha; });
    if (hasLayers && std::none_of(output.images.begin(), output.images.end(), holdsLayers))
        log.warn("--aov: there is no .exr output to hold the layers");
    if (const auto light = aovsInGroup(output.aovs, AovGroup::Light); !light.empty())
        m_lightAovs = std::make_unique<LightFilm>(built.pixelBounds, light, built.lightGroups);
    const std::vector<Aov> visible = aovsInGroup(output.aovs, AovGroup::Visible);
    if (visible.empty())
        return;
    m_surfaceAovs = std::make_unique<AovFilm>(
        *built.scene, *built.sampler.sampler, built.pixelBounds,
        AovFilmSettings{visible, built.cryptomatteMaterialNames, output.cryptomatteEntries});
    for (const std::string& warning : m_surfaceAovs->sums().warnings())
        log.warn("{}", warning);
}

RecordedAovs recordedAovs(const AovSums* surfaces, const LightFilm* lights) {
    RecordedAovs aovs;
    if (surfaces) {
        aovs.channels = surfaces->channels();
        aovs.metadata = surfaces->metadata();
    }
    if (lights)
        for (AovChannel& channel : lights->channels())
            aovs.channels.push_back(std::move(channel));
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
