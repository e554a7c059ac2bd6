// Typed reading of parameters: the accepted parameter types and numbers of values of each C++ type.
#include "core/color/spectrum.h"
#include "core/params/params.h"

#include <fmt/format.h>

#include <cstring>
#include <initializer_list>

namespace strobe {
namespace {

void checkType(const Param& p, std::initializer_list<ParamType> accepted) {
    std::string names;
    for (const ParamType type : accepted) {
        if (p.type == type)
            return;
        names += (names.empty() ? "" : " or ") + std::string(toString(type));
    }
    throw Error(p.where, fmt::format("parameter \"{}\" must be {}, not {}", p.name, names, toString(p.type)));
}

void checkCount(const Param& p, size_t count, size_t expected) {
    if (count != expected)
        throw Error(p.where, fmt::format("parameter \"{}\" needs {} value{}, got {}", p.name, expected,
                                         expected == 1 ? "" : "s", count));
}

/// Returns points from a flat list. The parser has checked the count, but a scene may also be built by a
/// program.
template <class V>
std::vector<V> toVectors(const Param& p) {
    constexpr size_t n = sizeof(V) / sizeof(float);
    if (p.floats.size() % n != 0)
        throw Error(p.where, fmt::format("parameter \"{}\" needs a multiple of {} numbers, got {}", p.name, n,
                                         p.floats.size()));
    std::vector<V> values(p.floats.size() / n);
    if (!values.empty())
        std::memcpy(static_cast<void*>(values.data()), p.floats.data(), p.floats.size() * sizeof(float));
    return values;
}

void convert(const Param& p, const TextureTable*, int& out) {
    checkType(p, {ParamType::Int});
    checkCount(p, p.ints.size(), 1);
    out = p.ints[0];
}

void convert(const Param& p, const TextureTable*, float& out) {
    checkType(p, {ParamType::Float, ParamType::Int});
    checkCount(p, p.floats.size() + p.ints.size(), 1);
    out = p.type == ParamType::Int ? static_cast<float>(p.ints[0]) : p.floats[0];
}

void convert(const Param& p, const TextureTable*, bool& out) {
    checkType(p, {ParamType::Bool});
    checkCount(p, p.ints.size(), 1);
    out = p.ints[0] != 0;
}

void convert(const Param& p, const TextureTable*, std::string& out) {
    checkType(p, {ParamType::String});
    checkCount(p, p.strings.size(), 1);
    out = p.strings[0];
}

void convert(const Param& p, const TextureTable*, V2f& out) {
    checkType(p, {ParamType::Point2, ParamType::Float});
    checkCount(p, p.floats.size(), 2);
    out = V2f(p.floats[0], p.floats[1]);
}

void convert(const Param& p, const TextureTable*, V3f& out) {
    checkType(p, {ParamType::Vector3});
    checkCount(p, p.floats.size(), 3);
    out = V3f(p.floats[0], p.floats[1], p.floats[2]);
}

Rgb spectrum(const Param& p) {
    if (!p.strings.empty()) {
        checkCount(p, p.strings.size(), 1);
        if (const auto named = namedSpectrum(p.strings[0]))
            return *named;
        return readSpd(resolveFile(p.strings[0], p.where), p.where);
    }
    if (p.floats.empty() || p.floats.size() % 2 != 0)
        throw Error(p.where, fmt::format("parameter \"{}\" needs pairs of a wavelength and a value", p.name));
    std::vector<float> wavelengths, values;
    for (size_t i = 0; i < p.floats.size(); i += 2) {
        if (!wavelengths.empty() && p.floats[i] <= wavelengths.back())
            throw Error(p.where, fmt::format("the wavelengths of \"{}\" must ascend", p.name));
        wavelengths.push_back(p.floats[i]);
        values.push_back(p.floats[i + 1]);
    }
    return spectrumToRgb(wavelengths, values);
}

void convert(const Param& p, const TextureTable*, Rgb& out) {
    checkType(p, {ParamType::Rgb, ParamType::Spectrum, ParamType::Blackbody});
    if (p.type == ParamType::Spectrum) {
        out = spectrum(p);
        return;
    }
    if (p.type == ParamType::Blackbody) { // followed by a scale in pbrt-v2 and v3, but not in v4
        if (p.floats.size() != 2)
            checkCount(p, p.floats.size(), 1);
        out = blackbodyRgb(p.floats[0], p.floats.size() == 2 ? p.floats[1] : 1.f);
        return;
    }
    checkCount(p, p.floats.size(), 3);
    out = Rgb(p.floats[0], p.floats[1], p.floats[2]);
}

void convert(const Param& p, const TextureTable*, FilePath& out) {
    checkType(p, {ParamType::String});
    checkCount(p, p.strings.size(), 1);
    out.path = resolveFile(p.strings[0], p.where);
}

/// Returns the float texture (`preferFloat`) or the rgb texture that `p` refers to. If it does not exist,
/// returns the texture of the same name and the other type. Null if the texture's plugin is unknown.
TexturePtr findTexture(const Param& p, const TextureTable* table, bool preferFloat) {
    if (!table || p.ints.size() != 2)
        throw Error(p.where, fmt::format("parameter \"{}\" cannot be a texture here", p.name));
    const auto element = [](const std::vector<TexturePtr>& list, int i) {
        return i >= 0 && static_cast<size_t>(i) < list.size() ? list[i] : nullptr;
    };
    const TexturePtr scalar = element(table->floats, p.ints[0]);
    const TexturePtr color = element(table->rgbs, p.ints[1]);
    const TexturePtr& preferred = preferFloat ? scalar : color;
    const TexturePtr& other = preferFloat ? color : scalar;
    const TexturePtr found = preferred ? preferred : other;
    const auto isBuilt = [](const std::vector<TexturePtr>& list, int i) {
        return i >= 0 && size_t(i) < list.size();
    };
    if (!found && !isBuilt(table->floats, p.ints[0]) && !isBuilt(table->rgbs, p.ints[1]))
        throw Error(p.where, fmt::format("texture \"{}\" is not available here",
                                         p.strings.empty() ? p.name : p.strings[0]));
    return found;
}

void convert(const Param& p, const TextureTable* textures, FloatInput& out) {
    checkType(p, {ParamType::Float, ParamType::Int, ParamType::Texture});
    if (p.type == ParamType::Texture)
        out.texture = findTexture(p, textures, true);
    else
        convert(p, textures, out.constant);
}

void convert(const Param& p, const TextureTable* textures, RgbInput& out) {
    checkType(p, {ParamType::Rgb, ParamType::Spectrum, ParamType::Blackbody, ParamType::Texture});
    if (p.type == ParamType::Texture)
        out.texture = findTexture(p, textures, false);
    else
        convert(p, textures, out.constant);
}

void convert(const Param& p, const TextureTable*, std::vector<int>& out) {
    checkType(p, {ParamType::Int});
    out = p.ints;
}

void convert(const Param& p, const TextureTable*, std::vector<float>& out) {
    checkType(p, {ParamType::Float, ParamType::Int});
    if (p.type == ParamType::Int)
        out.assign(p.ints.begin(), p.ints.end());
    else
        out = p.floats;
}

void convert(const Param& p, const TextureTable*, std::vector<std::string>& out) {
    checkType(p, {ParamType::String});
    out = p.strings;
}

void convert(const Param& p, const TextureTable*, std::vector<V2f>& out) {
    checkType(p, {ParamType::Point2, ParamType::Float});
    out = toVectors<V2f>(p);
}

void convert(const Param& p, const TextureTable*, std::vector<V3f>& out) {
    checkType(p, {ParamType::Vector3});
    out = toVectors<V3f>(p);
}

template <class T>
void checkRange(const Param& p, const ParamDef<T>& def, double value) {
    if (def.range.contains(value))
        return;
    const std::string problem = def.range.problem(value);
    if (p.isOverride)
        throw Error(fmt::format("-D {}: {}", p.name, problem), ErrorKind::Usage);
    throw Error(p.where, fmt::format("\"{}\" {}", def.name, problem));
}

} // namespace

template <class T>
T ParamSet::get(const ParamDef<T>& def) const {
    const Param* p = find(def.name, def.alias);
    if (!p)
        return def.fallback;
    T value{};
    convert(*p, m_textures.get(), value);
    if constexpr (std::is_same_v<T, FloatInput> || std::is_same_v<T, RgbInput>)
        if (p->type == ParamType::Texture && !value.texture)
            return def.fallback;
    if constexpr (std::is_same_v<T, int> || std::is_same_v<T, float>)
        checkRange(*p, def, double(value));
    else if constexpr (std::is_same_v<T, FloatInput>)
        if (!value.texture)
            checkRange(*p, def, double(value.constant));
    return value;
}

template int ParamSet::get(const ParamDef<int>&) const;
template float ParamSet::get(const ParamDef<float>&) const;
template bool ParamSet::get(const ParamDef<bool>&) const;
template std::string ParamSet::get(const ParamDef<std::string>&) const;
template V2f ParamSet::get(const ParamDef<V2f>&) const;
template V3f ParamSet::get(const ParamDef<V3f>&) const;
template Rgb ParamSet::get(const ParamDef<Rgb>&) const;
template FilePath ParamSet::get(const ParamDef<FilePath>&) const;
template FloatInput ParamSet::get(const ParamDef<FloatInput>&) const;
template RgbInput ParamSet::get(const ParamDef<RgbInput>&) const;
template std::vector<int> ParamSet::get(const ParamDef<std::vector<int>>&) const;
template std::vector<float> ParamSet::get(const ParamDef<std::vector<float>>&) const;
template std::vector<std::string> ParamSet::get(const ParamDef<std::vector<std::string>>&) const;
template std::vector<V2f> ParamSet::get(const ParamDef<std::vector<V2f>>&) const;
template std::vector<V3f> ParamSet::get(const ParamDef<std::vector<V3f>>&) const;

} // namespace strobe
