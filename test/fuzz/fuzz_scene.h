// Builds scenes in fuzz targets.
#pragma once

#include "core/util/diagnostics.h"
#include "loader/build/builder.h"
#include "loader/parser/parser.h"

/// Builds a scene for an image of 4 x 4 pixels. Throws Error.
inline void buildSmall(strobe::SceneDescription&& description, strobe::Diagnostics& diagnostics) {
    strobe::BuildOptions options;
    options.resolution = strobe::V2i(4, 4);
    options.samplesPerPixel = 1;
    strobe::buildScene(std::move(description), options, diagnostics);
}
