// AOVs of surfaces and of light, recorded while rendering, for EXR outputs.
#pragma once

#include "core/render/aov_film.h"
#include "core/render/render.h"
#include "session/log.h"
#include "session/options.h"

namespace strobe {

/// Recorded AOVs, ready to be written.
struct RecordedAovs {
    std::vector<AovChannel> channels;
    std::vector<ExrPart> parts;     ///< of an EXR, without alpha; they refer to `channels`
    std::span<const float> alpha{}; ///< per pixel; refers to `channels`; empty: none
    Metadata metadata;              ///< of the whole file
};

/// Returns these channels with their parts.
RecordedAovs recordedAovs(std::vector<AovChannel> channels);
/// Returns the means of the samples so far. `surfaces` and `lights` may be null.
RecordedAovs recordedAovs(const AovSums* surfaces, const LightFilm* lights);

/// Records the AOVs of AovGroup::Visible and AovGroup::Light. (The film holds those of AovGroup::Sharing.)
class AovRecorder {
  public:
    /// Warns of names with equal Cryptomatte hashes. `cryptomatteEntries`: names per pixel. `built` outlives
    /// the recorder.
    AovRecorder(const std::vector<Aov>& aovs, int cryptomatteEntries, const BuiltScene& built,
                const Log& log);
    /// Makes a render with these settings fill the recorder, which outlives the render.
    void attachTo(RenderSettings& settings) {
        settings.aovs = m_surfaceAovs.get();
        settings.lights = m_lightAovs.get();
    }
    /// Returns the means of the samples so far.
    RecordedAovs recorded() const {
        return recordedAovs(m_surfaceAovs ? &m_surfaceAovs->sums() : nullptr, m_lightAovs.get());
    }

  private:
    std::unique_ptr<AovFilm> m_surfaceAovs; ///< null if there are none
    std::unique_ptr<LightFilm> m_lightAovs; ///< null if there are none
};

/// Returns the AOVs that `settings` record.
AovLayout layoutOf(const RenderSettings& settings);

} // namespace strobe
