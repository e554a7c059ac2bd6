// The interfaces that plugins implement, and the entry of a library of plugins. See docs/plugins.md and
// examples/.
#pragma once

#include "core/math/api.h"
#include "core/math/fast_math.h"
#include "core/math/hash.h"
#include "core/math/sampling.h"
#include "loader/build/plugin_rows.h"
#include "materials/inputs.h"
#include "strobe/abi.h"

/// Makes a library of plugins. `addPlugins` is a function `void (strobe::PluginRows&)` that adds their rows:
///
///     STROBE_PLUGIN_LIBRARY([](strobe::PluginRows& rows) { rows.add(quadPlugin()); })
///
/// To be used once in a library, outside of namespaces.
#define STROBE_PLUGIN_LIBRARY(...)                                                                           \
    extern "C" STROBE_API __attribute__((used)) const char strobe_plugin_abi[] =                             \
        STROBE_ABI_MARKER STROBE_ABI;                                                                        \
    extern "C" STROBE_API void strobe_add_plugins(strobe::PluginRows& rows) { (__VA_ARGS__)(rows); }
