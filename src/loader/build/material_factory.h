// Creates the materials of a description.
#pragma once

#include "loader/build/plugin_factory.h"

namespace strobe {

struct BuiltMaterial {
    std::shared_ptr<const Material> material;
    bool isInterface =
        false;             ///< boundary of a medium: shapes with it are skipped unless they are area lights
    FloatInput opacity{1}; ///< alpha of shapes that have no alpha of their own
};

/// Returns the materials of all declarations, in order. Throws located Errors.
std::vector<BuiltMaterial> makeMaterials(std::vector<MaterialDecl>& decls,
                                         const std::vector<MaterialRow>& table, PluginFactory& factory);

} // namespace strobe
