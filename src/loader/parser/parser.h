// The parser of the scene language: text to SceneDescription. See docs/scene-format.md.
#pragma once

#include "core/math/api.h"
#include "core/util/diagnostics.h"
#include "loader/parser/description.h"

#include <filesystem>
#include <set>
#include <string>

namespace STROBE_API strobe {

/// Returns true for the names of pbrt's files: .pbrt, .pbrt.gz.
bool isPbrtName(const std::filesystem::path& name);

/// Parses the files as one scene, in order, as pbrt does. The extension of the first file selects the mode:
/// `.pbrt` files are lenient and follow the conventions of pbrt-v2 or v4, depending on their content; others
/// are strict and follow v4's. `sharingNames`: names of the sharing integrators, which tell `Integrator
/// "msaa"` from `Integrator "path"`. `policy`: which files the scene may read, and the memory limit; null: no
/// restriction. `defines`: texts NAME=VALUE, the values of $NAME in the files; SceneDescription::values has
/// those that the files use. Throws located Errors.
SceneDescription parseFiles(const std::vector<std::filesystem::path>& files,
                            const std::set<std::string>& sharingNames, Diagnostics& diagnostics,
                            std::shared_ptr<const ResourcePolicy> policy = nullptr,
                            const std::vector<std::string>& defines = {});
/// Parses a text in memory, as parseFiles parses one file. `name` is the file name in diagnostics; its
/// extension selects the mode, and its folder is where relative file names are looked for.
SceneDescription parseText(const std::string& text, const std::filesystem::path& name,
                           const std::set<std::string>& sharingNames, Diagnostics& diagnostics,
                           std::shared_ptr<const ResourcePolicy> policy = nullptr);

} // namespace strobe
