// Plugin tables: names, parameters and factory functions of plugins.
#pragma once

#include "core/color/color_config.h"
#include "core/params/params.h"
#include "core/util/diagnostics.h"
#include "core/util/nearest_name.h"

#include <functional>

namespace strobe {

/// The version of pbrt whose conventions a scene file follows. The default for `.scene` files is PbrtV4;
/// `Option "string conventions" "pbrt-v2"` selects PbrtV2.
enum class Conventions {
    /// World-to-object is interpolated, lights and textures are static, image row 0 is at v = 0, and the
    /// default
    /// shader is directlighting.
    PbrtV2,
    /// Object-to-world is interpolated, image row 0 is at v = 1, and the default shader is path.
    PbrtV4,
};

class TextureCache;

/// The context in which plugins are created.
struct BuildContext {
    Diagnostics& diagnostics;
    Conventions conventions = Conventions::PbrtV4;
    std::vector<float> keyTimes{0, 1}; ///< from TransformTimes
    std::shared_ptr<TextureCache> textureCache{};
    /// For the color spaces of image files.
    std::shared_ptr<const ColorConfig> colorConfig = std::make_shared<const ColorConfig>();
    int pbrtVersion = 4;    ///< 2, 3 or 4: the conventions of values that differ between v3 and v4
    bool isLenient = false; ///< the scene was written by another program: minor errors are only warnings
};

/// A row of a plugin table. `Args` are the arguments of `create` in addition to the parameters and the
/// context.
template <class Product, class... Args>
struct Plugin {
    std::string name;
    std::string doc; ///< a line of help
    std::vector<ParamInfo> params;
    std::function<Product(const ParamSet&, const BuildContext&, Args...)> create;
};

/// Returns the row with this name. Throws Error at `where` if there is none; the message lists the known
/// names.
template <class Row>
const Row& findPlugin(const std::vector<Row>& table, const std::string& name, const char* kind,
                      const Location& where) {
    std::vector<std::string> names;
    for (const Row& row : table) {
        if (row.name == name)
            return row;
        names.push_back(row.name);
    }
    throw Error(where, unknownName(kind, name, names), where ? ErrorKind::Scene : ErrorKind::Usage);
}

} // namespace strobe
