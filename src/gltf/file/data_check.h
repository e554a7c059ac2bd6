// Checks of the data of a glTF file: accessors and images.
#pragma once

#include "gltf/file/conformance.h"

#include <filesystem>

namespace strobe::gltf {

class Document;

/// Returns the deviations of the data of accessors and of images from the specification, the first one of
/// each kind: numbers beyond the bounds of their accessor or that are not finite, indices out of range,
/// colors above 1, tangents and inverse bind matrices of a wrong form, and images that are missing or
/// truncated. Data that cannot be read are skipped: their readers report them.
Deviations findDataDeviations(const Document& document);

/// Returns the message for an image file that is missing.
std::string cannotRead(const std::filesystem::path& image);

} // namespace strobe::gltf
