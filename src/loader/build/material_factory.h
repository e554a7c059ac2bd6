// The materials of a description, made.
#pragma once

#include "loader/build/plugin_factory.h"

namespace strobe {

struct BuiltMaterial {
    std::shared_ptr<const Material> material;
    bool isNothing = false; ///< shapes of it are boundaries of media: left out, unless they shine
    FloatInput opacity{1};  ///< alpha of its shapes that have none of their own
};

/// All of them, in order; mixes become their heavier part.
std::vector<BuiltMaterial> makeMaterials(std::vector<MaterialDecl>& decls,
                                         const std::vector<MaterialRow>& table, PluginFactory& maker);

} // namespace strobe
