#include "core/params/params.h"

#include "core/util/nearest_name.h"

#include <fmt/format.h>

namespace strobe {
namespace {

bool hasName(const Param& param, std::string_view name, const char* alias) {
    return param.name == name || (alias && param.name == alias);
}

/// Returns the message for a parameter that was not read. If not `strict`, the parameter may be valid in
/// another renderer.
std::string unusedMessage(const Param& param, const std::vector<ParamInfo>& known, bool strict) {
    std::vector<std::string> names;
    for (const ParamInfo& info : known) {
        if (info.name == param.name || info.alias == param.name)
            return fmt::format("parameter \"{}\" has no effect here", param.name);
        names.push_back(info.name);
        if (!info.alias.empty())
            names.push_back(info.alias);
    }
    std::string message = strict ? fmt::format("unknown parameter \"{}\"", param.name)
                                 : fmt::format("parameter \"{}\" is ignored", param.name);
    if (const std::string nearest = nearestName(param.name, names); !nearest.empty())
        message += fmt::format("; did you mean \"{}\"?", nearest);
    return message +
           (names.empty() ? " (there are none here)" : fmt::format(" (known: {})", fmt::join(names, ", ")));
}

bool isKnown(const Param& param, const std::vector<ParamInfo>& known) {
    return std::any_of(known.begin(), known.end(), [&](const ParamInfo& info) {
        return info.name == param.name || info.alias == param.name;
    });
}

} // namespace

const char* toString(ParamType type) {
    switch (type) {
    case ParamType::Int:
        return "integer";
    case ParamType::Float:
        return "float";
    case ParamType::Bool:
        return "bool";
    case ParamType::String:
        return "string";
    case ParamType::Point2:
        return "point2";
    case ParamType::Vector3:
        return "vector3";
    case ParamType::Rgb:
        return "rgb";
    case ParamType::Spectrum:
        return "spectrum";
    case ParamType::Blackbody:
        return "blackbody";
    case ParamType::Texture:
        return "texture";
    }
    return "unknown";
}

void ParamSet::add(Param param) {
    for (const Param& p : m_params)
        if (p.name == param.name)
            throw Error(param.where, fmt::format("parameter \"{}\" is given twice", param.name));
    m_params.push_back(std::move(param));
}

void ParamSet::replace(Param param, const std::vector<ParamInfo>& known) {
    std::string name = param.name, alias;
    for (const ParamInfo& info : known)
        if (info.name == param.name || (!info.alias.empty() && info.alias == param.name)) {
            name = info.name;
            alias = info.alias;
        }
    std::erase_if(m_params,
                  [&](const Param& p) { return hasName(p, name, alias.empty() ? nullptr : alias.c_str()); });
    m_params.push_back(std::move(param));
}

const Param* ParamSet::find(std::string_view name, const char* alias) const {
    const Param* found = nullptr;
    for (const Param& p : m_params) {
        if (!hasName(p, name, alias))
            continue;
        p.used = true;
        if (found && !found->isDefault && !p.isDefault)
            throw Error(p.where,
                        fmt::format("\"{}\" and \"{}\" are names of the same parameter; give one of them",
                                    found->name, p.name));
        if (!found || found->isDefault)
            found = &p;
    }
    return found;
}

void ParamSet::markAllUsed() const {
    for (const Param& p : m_params)
        p.used = true;
}

void ParamSet::reportUnused(const std::vector<ParamInfo>& known, bool strict,
                            Diagnostics& diagnostics) const {
    for (const Param& p : m_params) {
        if (p.used)
            continue;
        if (p.isDefault && isKnown(p, known))
            continue;
        const std::string message = unusedMessage(p, known, strict);
        if (strict && !p.isDefault)
            throw Error(p.where, message);
        diagnostics.warnOnce(message, p.where, message);
    }
}

void ParamSet::checkPhysical(const std::vector<ParamInfo>& known, bool strict,
                             Diagnostics& diagnostics) const {
    for (const Param& p : m_params)
        for (const ParamInfo& info : known) {
            if (p.name != info.name && p.name != info.alias)
                continue;
            if (p.type == ParamType::Blackbody) // temperature and scale
                continue;
            const size_t step = p.type == ParamType::Spectrum ? 2 : 1; // pairs of wavelength and value
            for (size_t i = step - 1; i < p.floats.size(); i += step) {
                const auto value = double(p.floats[i]);
                if (info.physical.contains(value))
                    continue;
                const std::string problem = fmt::format("\"{}\" {}", p.name, info.physical.problem(value));
                if (strict)
                    throw Error(p.where, problem);
                diagnostics.warn(p.where, problem);
                break;
            }
        }
}

} // namespace strobe
