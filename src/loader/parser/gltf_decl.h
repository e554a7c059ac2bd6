// glTF files in scenes: the parameters of Shape "gltf", and reading the files that scenes name.
#pragma once

#include "core/params/plugin.h"
#include "core/util/diagnostics.h"
#include "loader/parser/description.h"

namespace strobe {

/// Returns the row of Shape "gltf" for the table of shapes. Its `create` throws: the parser turns each such
/// shape into a GltfDecl, before any plugin is created.
Plugin<Shape> gltfPlugin();

/// Reads the file that the parameters of a Shape "gltf" name. Throws a located Error if the file or a
/// parameter is invalid; an unknown parameter is an Error if `strict`, else a warning.
GltfDecl readGltf(const ParamSet& params, bool strict, Diagnostics& diagnostics);

/// Reads a whole file named by Include at `where`, or on the command line. `policy`: which files may be read;
/// null: all. Throws an Error at `where` if the file is invalid.
GltfDecl readGltf(const std::filesystem::path& path, const Location& where,
                  std::shared_ptr<const ResourcePolicy> policy);

} // namespace strobe
