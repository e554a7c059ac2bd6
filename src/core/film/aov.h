// Arbitrary output variables (AOVs): one table of all layers that a render can write besides its color.
#pragma once

#include "core/math/api.h"

#include <string>
#include <vector>

namespace STROBE_API strobe {

/// A layer. Its group determines the class that accumulates it.
enum class Aov {
    // AovGroup::Visible
    Normal,
    Albedo,
    Depth,
    Position,
    Uv,
    MotionVector,
    ObjectId,
    MaterialId,
    PrimitiveId,
    CryptoObject,
    CryptoMaterial,
    Alpha,
    // AovGroup::Light
    Direct,
    Indirect,
    LightGroups,
    // AovGroup::Sharing
    Shades,
    Samples,
    HitRate,
    Cell,
    ShadeTime,
    SharedWeight,
    SharedWidth,
    SharedError,
    Variance
};

/// Visible: properties of the surfaces that visibility samples hit (AovFilm). Light: components of the
/// radiance (LightFilm). Sharing: numbers per pixel that describe how its value was computed (Film).
enum class AovGroup { Visible, Light, Sharing };

struct AovInfo {
    Aov aov;
    AovGroup group;
    /// The name for --aov, and the layer's name in files (but for Cryptomatte, light groups and Aov::Alpha,
    /// which is the channel A of the image).
    const char* name;
    const char* doc;
    std::vector<const char*> channels;    ///< for Cryptomatte: the layer's name in files
    const char* deprecatedName = nullptr; ///< accepted by --aov, but not listed
};

/// Returns all AOVs in the order of the enumeration.
const std::vector<AovInfo>& aovTable();
const AovInfo& aovInfo(Aov aov);
/// Returns the AOV with this name or deprecated name; null if there is none.
const AovInfo* findAov(const std::string& name);
/// Returns the names of a group's AOVs, separated by commas.
std::string aovNames(AovGroup group);
/// Returns the AOVs with their channels in EXR files, as `strobe --list` prints them.
std::string listAovs();
/// Returns the AOVs in `aovs` whose group is `group`, in the same order.
std::vector<Aov> aovsInGroup(const std::vector<Aov>& aovs, AovGroup group);

/// One channel of an EXR file.
struct AovChannel {
    std::string layer, name; ///< the name in files is "layer.name"
    std::vector<float> values;
    bool exact = false; ///< written with 32 bits, see ExrChannel
};

} // namespace strobe
