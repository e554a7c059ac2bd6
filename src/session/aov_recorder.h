// The layers of --aov that the film itself does not hold.
#pragma once

#include "core/render/aov_film.h"
#include "core/render/render.h"
#include "session/options.h"

#include <spdlog/spdlog.h>

namespace strobe {

/// Parts of a file, and the values that they refer to.
struct RecordedAovs {
    std::vector<AovChannel> values;
    std::vector<Part> parts;
    Metadata metadata; ///< what the whole file must say of them
};

class AovRecorder {
  public:
    /// Warns of names that Cryptomatte cannot tell apart, and of layers that no output holds.
    AovRecorder(const Options& options, const BuiltScene& built, spdlog::logger& log);
    /// Has the render fill them; they must outlive it.
    void attachTo(RenderSettings& settings) {
        settings.aovs = m_surfaceAovs.get();
        settings.lights = m_lightAovs.get();
    }
    /// What was gathered so far.
    RecordedAovs recorded() const;

  private:
    std::unique_ptr<AovFilm> m_surfaceAovs; ///< null: none are asked for; likewise:
    std::unique_ptr<LightFilm> m_lightAovs;
};

} // namespace strobe
