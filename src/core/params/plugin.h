// Plugin tables: what exists, what it is called, which parameters it takes, how it is made.
#pragma once

#include "core/color/color_config.h"
#include "core/params/params.h"

#include <functional>

namespace strobe {

/// Which renderer's conventions a scene file follows, where they differ. `.scene` files are PbrtV4 unless
/// they say `Option "string conventions" "pbrt-v2"`.
enum class Conventions {
    PbrtV2, ///< world-to-object motion; lights and textures still; image row 0 at v = 0; directlighting
    PbrtV4, ///< object-to-world motion; image row 0 at v = 1; path
};

class TextureCache;

/// What a plugin may want to know beyond its own parameters.
struct BuildContext {
    Diagnostics& diagnostics;
    Conventions conventions = Conventions::PbrtV4;
    std::vector<float> keyTimes{0, 1}; ///< of the scene's TransformTimes
    std::shared_ptr<TextureCache> textureCache{};
    /// Of the colors in files.
    std::shared_ptr<const ColorConfig> colorConfig = std::make_shared<const ColorConfig>();
    bool isLenient = false; ///< the scene is what another program wrote: trifles are warned about
};

/// One row of a plugin table. `Product` is what `create` returns; `Args` is what it gets besides the
/// parameters.
template <class Product, class... Args>
struct Plugin {
    std::string name;
    std::string doc; ///< one line
    std::vector<ParamInfo> params;
    std::function<Product(const ParamSet&, const BuildContext&, Args...)> create;
};

/// The row called `name`; an unknown name is an Error at `where` that names the nearest and lists all.
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
