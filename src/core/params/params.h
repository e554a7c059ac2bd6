// The parameters of a directive, with their locations, and typed definitions that read them.
//
// A plugin declares each of its parameters once, as a `ParamDef` constant with its name, default and a line
// of help. The same constants read the values and describe the parameters in `strobe --list`, so that both
// agree.
#pragma once

#include "core/interfaces/texture.h"
#include "core/math/api.h"
#include "core/math/math.h"
#include "core/util/diagnostics.h"
#include "core/util/nearest_name.h"

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace STROBE_API strobe {

/// The type of a parameter in the scene file.
enum class ParamType { Int, Float, Bool, String, Point2, Vector3, Rgb, Spectrum, Blackbody, Texture };
const char* toString(ParamType type);

/// A parameter `"type name" value` of a directive, as parsed.
struct Param {
    std::string name;
    ParamType type;
    Location where;            ///< of the quoted declaration
    std::vector<float> floats; ///< Float, Point2, Vector3, Rgb, Blackbody, and Spectrum given by numbers
    /// Int; Bool as 0 or 1; Texture: the indices of the float texture and of the rgb texture of this name in
    /// the scene description, -1 if there is none.
    std::vector<int> ints;
    std::vector<std::string> strings; ///< String; Texture: its name; Spectrum given by a name or a file
    mutable bool used = false;        ///< the parameter was read
    bool isDefault =
        false; ///< from an `Attribute` directive of pbrt-v4; parameters of the directive override it
    bool isOverride = false; ///< from an option -D
};

using TexturePtr = std::shared_ptr<const Texture>;

/// The textures of a scene, by the indices in Param::ints.
struct TextureTable {
    std::vector<TexturePtr> floats, rgbs;
};

/// The range of a numeric parameter, from `min` (exclusive if `aboveMin`) to `max`. NaN is outside. The
/// default range has no limits and accepts everything.
struct ParamRange {
    double min = -kInfinity, max = kInfinity;
    bool aboveMin = false;

    bool isUnlimited() const { return min == -kInfinity && max == kInfinity; }
    bool contains(double value) const {
        return isUnlimited() || ((aboveMin ? value > min : value >= min) && value <= max);
    }
    /// Returns the error message for a value outside the range, e.g. "must be at least 1".
    std::string problem(double value) const;
    /// Returns a text for `strobe --list`, e.g. "at least 1" or "0 to 2"; empty without limits.
    std::string description() const;
};
inline constexpr ParamRange kUnlimited{}, kUnitRange{0, 1};
inline constexpr ParamRange kNotNegative{0}, kPositive{0, kInfinity, true}, kAtLeastOne{1};

/// The definition of a plugin's parameter.
template <class T>
struct ParamDef {
    const char* name;
    T fallback;                  ///< value if the parameter is absent
    const char* doc;             ///< a line of help
    const char* alias = nullptr; ///< alternative name, e.g. of pbrt-v4
    ParamRange range{};          ///< for int, float and a FloatInput that is not a texture
    /// Numbers outside have no physical meaning: see ParamSet::checkPhysical.
    ParamRange physical{};
};

/// A string parameter that is a file name. `get` resolves it with resolveFile. Empty if the parameter is
/// absent.
struct FilePath {
    std::filesystem::path path;
};

/// The description of a parameter, for `strobe --list`.
struct ParamInfo {
    std::string name, type, fallback, doc, alias, range;
    ParamRange physical;
    template <class T>
    ParamInfo(const ParamDef<T>& def); // implicit, for tables {kKd, kKs, kRoughness}
};

/// The parameters of one directive.
class ParamSet {
  public:
    ParamSet() = default;
    explicit ParamSet(Location where) : m_where(std::move(where)) {}
    /// Appends a parameter. Throws Error if there is one with this name.
    void add(Param param);
    /// Appends a parameter after removing parameters with the same name or with its alias in `known`.
    void replace(Param param, const std::vector<ParamInfo>& known);
    const Location& where() const { return m_where; }
    const std::vector<Param>& all() const { return m_params; }
    std::vector<Param>& all() { return m_params; }

    /// Returns the value of a parameter, or its default if it is absent. Throws Error at its location if the
    /// type, the number of values or the range is wrong. T: int, float, bool, std::string, V2f, V3f, Rgb
    /// (rgb, color, spectrum or blackbody), FilePath, FloatInput and RgbInput (a value or a texture),
    /// std::vector of int, float, std::string, V2f, V3f.
    template <class T>
    T get(const ParamDef<T>& def) const;
    /// Compares numbers and colors with the physical ranges of `known`. A value outside is an error, or, if
    /// `strict` is false, a warning.
    void checkPhysical(const std::vector<ParamInfo>& known, bool strict, Diagnostics& diagnostics) const;
    template <class T>
    bool has(const ParamDef<T>& def) const {
        return find(def.name, def.alias) != nullptr;
    }
    /// Returns the type of the parameter in the scene file; nothing if it is absent. For parameters that may
    /// have several types.
    template <class T>
    std::optional<ParamType> typeOf(const ParamDef<T>& def) const {
        const Param* p = find(def.name, def.alias);
        return p ? std::optional(p->type) : std::nullopt;
    }
    /// Returns the location of the parameter; the location of the directive if it is absent.
    template <class T>
    Location whereIs(const ParamDef<T>& def) const {
        const Param* p = find(def.name, def.alias);
        return p ? p->where : m_where;
    }
    /// Returns the value of a parameter. Throws Error if it is absent.
    template <class T>
    T require(const ParamDef<T>& def) const {
        if (!has(def))
            throw Error(m_where, std::string("parameter \"") + def.name + "\" is missing");
        return get(def);
    }
    /// Sets the textures that FloatInput and RgbInput refer to. To be called before `get` of such a
    /// parameter.
    void bindTextures(std::shared_ptr<const TextureTable> textures) { m_textures = std::move(textures); }

    /// Marks all parameters as used, for directives that are skipped.
    void markAllUsed() const;
    /// Reports each parameter that was not read, with the most similar name in `known`: throws Error if
    /// `strict`, else warns. Parameters from `Attribute` are never errors, and are reported only if `known`
    /// has no such name.
    void reportUnused(const std::vector<ParamInfo>& known, bool strict, Diagnostics& diagnostics) const;

  private:
    /// Returns the parameter and marks it as used; null if it is absent. Throws Error if both name and alias
    /// are given.
    const Param* find(std::string_view name, const char* alias) const;
    Location m_where;
    std::vector<Param> m_params;
    std::shared_ptr<const TextureTable> m_textures;
};

/// The words that a string parameter may have, and their values. Synonyms have the same value.
template <class T>
using WordTable = std::initializer_list<std::pair<const char*, T>>;

/// Returns the value in `table` of the word that a string parameter has. Throws Error at the location of the
/// parameter if the table lacks the word; the message lists the words. Precondition: the table has the
/// default.
template <class T>
T parseWord(const ParamSet& params, const ParamDef<std::string>& def, WordTable<T> table) {
    const std::string word = params.get(def);
    std::vector<std::string> known;
    for (const auto& [name, value] : table) {
        if (word == name)
            return value;
        known.push_back(name);
    }
    throw Error(params.whereIs(def), unknownName(def.name, word, known));
}

/// Parses the argument `name=value` of the option -D. The type of the parameter is its type in `known`.
/// Throws Error of kind Usage if the name is not in `known` or the value does not have this type.
Param parseOverride(const std::string& option, const std::vector<ParamInfo>& known);

/// Returns the path of an existing regular file that a scene refers to by `name`, checked with the
/// ResourcePolicy of `where`. `name` is an absolute path, a path relative to the directory of the source or
/// of the main scene file (in this order), or starts with `$STROBE_SCENES/`. The rest of a name with this
/// prefix is relative to the value of the environment variable, or, if it is not set, to `shared/scenes` in
/// the directory of the source or the nearest parent that contains the file. Throws Error at `where` that
/// lists the paths tried.
std::filesystem::path resolveFile(const std::string& name, const Location& where);

} // namespace strobe
