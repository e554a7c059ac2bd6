// The scene language: text to SceneDescription. See docs/scene-format.md.
#pragma once

#include "core/util/diagnostics.h"
#include "loader/parser/description.h"

#include <filesystem>
#include <set>
#include <string>

namespace strobe {

/// True for the names of files that other programs write: .pbrt, .pbrt.gz.
bool isPbrtName(const std::filesystem::path& name);

/// Parses the files one after another as if they were one (pbrt's habit). `.pbrt` files are lenient about
/// unread parameters and follow pbrt-v2's or v4's conventions by what they contain; others are strict and
/// follow v4's. `guard`: what the scene may read and take; null: all. `sharingNames`: names of integrators
/// that choose how shading is shared, so that `Integrator "msaa"` can be told from `Integrator "path"`.
/// Throws Error with the location of the mistake.
SceneDescription parseFiles(const std::vector<std::filesystem::path>& files,
                            const std::set<std::string>& sharingNames, Diagnostics& messages,
                            std::shared_ptr<const ResourcePolicy> guard = nullptr);
/// The same for a text in memory; `name` stands for the file in messages, its extension and directory count.
SceneDescription parseText(const std::string& text, const std::filesystem::path& name,
                           const std::set<std::string>& sharingNames, Diagnostics& messages,
                           std::shared_ptr<const ResourcePolicy> guard = nullptr);

} // namespace strobe
