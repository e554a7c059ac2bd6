// The integrator and the shader of a scene, as the scene and the command line select them.
#pragma once

#include "loader/build/builder.h"
#include "loader/build/plugin_factory.h"

namespace strobe {

/// Moves the statement out; returns one of plugin `name` without parameters if it is absent.
Statement orDefault(std::optional<Statement>& statement, const char* name);

/// Creates the integrator and the shader of `setup`, and adds their names and parameters to its metadata.
/// Throws Errors, located unless the command line causes them.
void makeIntegrators(SceneDescription& description, const BuildOptions& options, const PluginTables& tables,
                     PluginFactory& factory, FrameSetup& setup);

} // namespace strobe
