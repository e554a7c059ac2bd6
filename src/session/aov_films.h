// The layers of --aov that the film itself does not hold.
#pragma once

#include "core/render/aov_film.h"
#include "core/render/render.h"
#include "session/options.h"

#include <spdlog/spdlog.h>

namespace strobe {

/// Parts of a file, and the values that they refer to.
struct DevelopedAovs {
    std::vector<AovChannel> values;
    std::vector<ExrPart> parts;
    Metadata metadata; ///< what the whole file must say of them
};

class AovFilms {
  public:
    /// Warns of names that Cryptomatte cannot tell apart, and of layers that no output holds.
    AovFilms(const Options& options, const BuiltScene& built, spdlog::logger& log);
    /// Has the render fill them; they must outlive it.
    void addTo(RenderSettings& settings) {
        settings.aovs = m_features.get();
        settings.lights = m_lights.get();
    }
    /// What was gathered so far.
    DevelopedAovs develop() const;

  private:
    std::unique_ptr<AovFilm> m_features; ///< null: none are asked for; likewise:
    std::unique_ptr<LightFilm> m_lights;
};

} // namespace strobe
