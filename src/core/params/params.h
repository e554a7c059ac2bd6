// Parameters of a directive, each with the place it was written, and typed definitions to read them by.
//
// A plugin declares each of its parameters once, as a `ParamDef` constant: name, default, one line of help.
// The same constants read the values and fill the table behind `strobe --list`, so the two cannot drift
// apart.
#pragma once

#include "core/interfaces/texture.h"
#include "core/math/math.h"
#include "core/util/error.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace strobe {

/// What a parameter's type word in the scene file meant.
enum class ParamType { Int, Float, Bool, String, Point2, Vector3, Rgb, Spectrum, Blackbody, Texture };
const char* toString(ParamType type);

/// One `"type name" value` of a directive, unconverted.
struct Param {
    std::string name;
    ParamType type;
    Location where;                   ///< of the quoted declaration
    std::vector<float> floats;        ///< Float, Point2, Vector3, Rgb, Blackbody; Spectrum given by numbers
    std::vector<int> ints;            ///< Int; Bool as 0/1; Texture: {index of the float texture, of the rgb
                                      ///< texture} in the scene description, -1 where there is none
    std::vector<std::string> strings; ///< String; Texture: its name; Spectrum given by name or file
    mutable bool used = false;
    bool isDefault = false; ///< from pbrt-v4's `Attribute`: the directive itself overrides it
};

using TexturePtr = std::shared_ptr<const Texture>;

/// Textures already built, by the indices that `Param::ints` holds.
struct TextureTable {
    std::vector<TexturePtr> floats, rgbs;
};

/// The values that a numeric parameter may have: from `min` (exclusive if `aboveMin`) to `max`, but not NaN.
/// The default range accepts everything.
struct ParamRange {
    double min = -kInfinity, max = kInfinity;
    bool aboveMin = false;

    bool isUnlimited() const { return min == -kInfinity && max == kInfinity; }
    bool contains(double value) const {
        return isUnlimited() || ((aboveMin ? value > min : value >= min) && value <= max);
    }
    /// What is wrong with a value outside: "must be at least 1" and the like.
    std::string problem(double value) const;
};
inline constexpr ParamRange kNotNegative{0}, kPositive{0, kInfinity, true}, kAtLeastOne{1};

/// A parameter as a plugin declares it. `alias` is another spelling of the same parameter (pbrt-v4's names).
/// `range` holds for numbers, and for the constant of a FloatInput.
template <class T>
struct ParamDef {
    const char* name;
    T fallback;
    const char* doc;
    const char* alias = nullptr;
    ParamRange range{};
};

/// A string parameter that names a file; `get` resolves it (absolute, `$STROBE_SCENES/…`, relative to the
/// scene file that says it, relative to the main scene file). Empty when not given.
struct FilePath {
    std::filesystem::path path;
};

/// A row of the table of a plugin's parameters.
struct ParamInfo {
    std::string name, type, fallback, doc, alias;
    template <class T>
    ParamInfo(const ParamDef<T>& def); // implicit: tables are written {Kd, Ks, roughness}
};

/// The parameters of one directive.
class ParamSet {
  public:
    ParamSet() = default;
    explicit ParamSet(Location where) : m_where(std::move(where)) {}
    /// Appends; throws when the name is there already.
    void add(Param param);
    /// Appends, in place of a parameter that has this name or the other spelling that `known` gives for it.
    void replace(Param param, const std::vector<ParamInfo>& known);
    const Location& where() const { return m_where; }
    const std::vector<Param>& all() const { return m_params; }
    std::vector<Param>& all() { return m_params; }

    /// The value, or the default. Throws a located Error when the type, the count of values or the range is
    /// wrong. T: int, float, bool, std::string, V2f, V3f, Rgb (rgb, color, spectrum or blackbody), FilePath,
    /// FloatInput and RgbInput (a value or a texture), std::vector of int, float, std::string, V2f, V3f.
    template <class T>
    T get(const ParamDef<T>& def) const;
    template <class T>
    bool has(const ParamDef<T>& def) const {
        return find(def.name, def.alias) != nullptr;
    }
    /// The type it was written with, or nothing when it is absent: for parameters that may be of several
    /// kinds.
    template <class T>
    std::optional<ParamType> typeOf(const ParamDef<T>& def) const {
        const Param* p = find(def.name, def.alias);
        return p ? std::optional(p->type) : std::nullopt;
    }
    /// Where the parameter was written, or the directive's place.
    template <class T>
    Location whereIs(const ParamDef<T>& def) const {
        const Param* p = find(def.name, def.alias);
        return p ? p->where : m_where;
    }
    /// As get, but the parameter must be there.
    template <class T>
    T require(const ParamDef<T>& def) const {
        if (!has(def))
            throw Error(m_where, std::string("parameter \"") + def.name + "\" is missing");
        return get(def);
    }
    /// Textures that FloatInput and RgbInput refer to; must be set before such a `get`.
    void bindTextures(std::shared_ptr<const TextureTable> textures) { m_textures = std::move(textures); }

    /// Marks every parameter used (for directives that are skipped as a whole).
    void markAllUsed() const;
    /// For each parameter that nobody read: an Error (strict) or a warning that names the nearest of `known`.
    /// An `Attribute` default is only ever a warning, and only if `known` has no such name.
    void reportUnused(const std::vector<ParamInfo>& known, bool strict, Diagnostics& messages) const;

  private:
    /// Marks it used; an Error when both spellings are given.
    const Param* find(std::string_view name, const char* alias) const;
    Location m_where;
    std::vector<Param> m_params;
    std::shared_ptr<const TextureTable> m_textures;
};

/// The value of a command-line word (`-D name=value`) as a parameter of the type that `known` gives that
/// name. Throws a usage Error that lists the known names, or says what the value should have been.
Param parseOverride(const std::string& nameEqualsValue, const std::vector<ParamInfo>& known);

/// Finds an existing file (see FilePath); throws a located Error that says where it looked.
std::filesystem::path resolveFile(const std::string& name, const Location& where);

} // namespace strobe
