// How pixels become files: the options that a render and strobe merge have in common.
#pragma once

#include "core/film/film.h"

#include <memory>

namespace CLI {
class App;
}

namespace strobe {

struct PictureOptions {
    ViewSettings view;  ///< of PNGs
    float exposure = 0; ///< of PNGs, in stops
    ExrSettings exr;
    std::shared_ptr<const ColorConfig> color = std::make_shared<const ColorConfig>();
};

/// Takes the config of $OCIO, too. `options` is referred to until the command line is parsed.
void addPictureOptions(CLI::App& app, PictureOptions& options);

/// Throws where there is no such view. `threads`: as of OutputSettings.
OutputSettings outputSettingsOf(const PictureOptions& options, int threads);

/// What of the picture a PNG shows, as far as options say so.
void addViewMetadata(const PictureOptions& options, Metadata& metadata);

} // namespace strobe
