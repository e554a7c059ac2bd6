// Arbitrary output variables (AOVs): every layer that a render can write beside its color, in one table.
#pragma once

#include <string>
#include <vector>

namespace strobe {

/// A layer. Its group decides what gathers it.
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
    Variance
};

/// Visible: properties of the surfaces that visibility samples hit (AovFilm). Light: components of the
/// radiance (LightFilm). Sharing: numbers per pixel that describe how its value was computed (Film).
enum class AovGroup { Visible, Light, Sharing };

struct AovInfo {
    Aov aov;
    AovGroup group;
    const char*
        name; ///< for --aov, and of the layer in files (Cryptomatte and light groups name theirs differently)
    const char* doc;
    std::vector<const char*> channels; ///< for Cryptomatte: the name of the layer in files
    const char* formerName = nullptr;  ///< accepted by --aov, not listed
};

/// All AOVs, in the order of the enumeration.
const std::vector<AovInfo>& aovTable();
const AovInfo& aovInfo(Aov aov);
/// The row with this name or former name; null if there is none.
const AovInfo* findAov(const std::string& name);
/// The names of one group, separated by commas.
std::string aovNames(AovGroup group);
/// Those of `aovs` that belong to `group`, in the same order.
std::vector<Aov> aovsOf(const std::vector<Aov>& aovs, AovGroup group);

/// One channel of an EXR file, ready to be written.
struct AovChannel {
    std::string layer, name; ///< in files: "layer.name"
    std::vector<float> values;
    bool exact = false; ///< see ExrChannel
};

} // namespace strobe
