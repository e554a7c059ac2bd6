#include "shapes/mesh_params.h"

namespace strobe {
namespace {

using namespace mesh_params;

std::string count(size_t n, const char* noun, const char* plural) {
    return std::to_string(n) + " " + (n == 1 ? noun : plural);
}

std::string vertices(size_t n) { return count(n, "vertex", "vertices"); }

KeyedPoints splitKeys(const std::vector<V3f>& values, size_t keys) {
    const size_t n = values.size() / keys;
    KeyedPoints split;
    for (size_t k = 0; k < keys; ++k)
        split.emplace_back(values.begin() + k * n, values.begin() + (k + 1) * n);
    return split;
}

} // namespace

void requireFinite(const std::vector<V3f>& values, const char* noun, const std::string& ofKey,
                   const Location& where) {
    for (size_t i = 0; i < values.size(); ++i) {
        const V3f& p = values[i];
        if (!(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)))
            throw Error(where, "the " + std::string(noun) + " of vertex " + std::to_string(i) + ofKey +
                                   " is not finite");
    }
}

void requireFinite(const KeyedPoints& values, const char* noun, const Location& where) {
    for (size_t k = 0; k < values.size(); ++k)
        requireFinite(values[k], noun, values.size() > 1 ? " of key " + std::to_string(k) : "", where);
}

std::vector<uint32_t> readIndices(const ParamSet& params, size_t vertexCount) {
    if (!params.has(kIndices)) {
        if (vertexCount == 3)
            return {0, 1, 2};
        throw Error(params.where(), "parameter \"indices\" is missing (it is optional only for exactly 3 "
                                    "vertices; there are " +
                                        std::to_string(vertexCount) + ")");
    }
    const std::vector<int> indices = params.get(kIndices);
    const Location where = params.whereIs(kIndices);
    if (indices.empty())
        throw Error(where, "the mesh has no triangles: \"indices\" is empty");
    if (indices.size() % 3 != 0)
        throw Error(where, "\"indices\" has " + std::to_string(indices.size()) +
                               " numbers, which is not a multiple of 3");
    for (size_t i = 0; i < indices.size(); ++i) {
        if (indices[i] < 0 || static_cast<size_t>(indices[i]) >= vertexCount)
            throw Error(where, "index " + std::to_string(indices[i]) + " (number " + std::to_string(i) +
                                   " of \"indices\", in triangle " + std::to_string(i / 3) +
                                   ") is out of range: the mesh has " + vertices(vertexCount));
    }
    return {indices.begin(), indices.end()};
}

KeyedPoints readPositions(const ParamSet& params) {
    const std::vector<V3f> points = params.require(kP);
    const Location where = params.whereIs(kP);
    const int keys = params.get(kKeys);
    if (keys < 1)
        throw Error(params.whereIs(kKeys), "\"keys\" must be at least 1, not " + std::to_string(keys));
    if (points.empty())
        throw Error(where, "the mesh has no vertices: \"P\" is empty");
    if (points.size() % keys != 0)
        throw Error(where, "\"P\" has " + count(points.size(), "point", "points") +
                               ", which do not divide into " + std::to_string(keys) + " keys");
    KeyedPoints positions = splitKeys(points, keys);
    requireFinite(positions, "position", where);
    return positions;
}

void checkNormals(std::vector<V3f>& normals, const std::string& ofKey, const Location& where,
                  const BuildContext& context) {
    if (!context.isLenient)
        return requireFinite(normals, "normal", ofKey, where);
    for (V3f& n : normals)
        if (!(std::isfinite(n.x) && std::isfinite(n.y) && std::isfinite(n.z))) {
            n = V3f(0);
            context.diagnostics.warnOnce("normals", where,
                                         "some normals are not finite; geometric normals are used instead");
        }
}

void warnOfEmptyMesh(const Location& where, const BuildContext& context) {
    context.diagnostics.noteOnce("empty mesh", where, "a mesh without triangles is ignored");
}

KeyedPoints readNormals(const ParamSet& params, const KeyedPoints& positions, const BuildContext& context) {
    if (!params.has(kN))
        return {};
    const std::vector<V3f> values = params.get(kN);
    const Location where = params.whereIs(kN);
    const size_t perKey = positions.front().size(), keys = positions.size();
    KeyedPoints normals;
    if (values.size() == perKey * keys)
        normals = splitKeys(values, keys);
    else if (values.size() == perKey)
        normals.assign(keys, values);
    else
        throw Error(where, "\"N\" has " + count(values.size(), "normal", "normals") + ", but the mesh has " +
                               vertices(perKey) +
                               (keys > 1 ? " in each of " + std::to_string(keys) + " keys" : ""));
    for (size_t k = 0; k < keys; ++k)
        checkNormals(normals[k], keys > 1 ? " of key " + std::to_string(k) : "", where, context);
    return normals;
}

std::vector<float> readKeyTimes(const ParamSet& params, size_t keyCount, const BuildContext& context) {
    if (params.has(kKeyTimes)) {
        const std::vector<float> times = params.get(kKeyTimes);
        const Location where = params.whereIs(kKeyTimes);
        if (times.size() != keyCount)
            throw Error(where, "\"keytimes\" has " + count(times.size(), "number", "numbers") +
                                   ", but the mesh has " + count(keyCount, "key", "keys"));
        for (size_t i = 0; i < times.size(); ++i) {
            if (!std::isfinite(times[i]) || (i > 0 && !(times[i] > times[i - 1])))
                throw Error(where, "\"keytimes\" must be finite and ascending; number " + std::to_string(i) +
                                       " is not");
        }
        return keyCount > 1 ? times : std::vector<float>{};
    }
    if (keyCount <= 1)
        return {};
    if (context.keyTimes.size() == keyCount)
        return context.keyTimes;
    const float first = context.keyTimes.empty() ? 0 : context.keyTimes.front();
    const float last = context.keyTimes.empty() ? 1 : context.keyTimes.back();
    if (!(last > first))
        throw Error(params.where(),
                    "a deforming mesh needs \"keytimes\": the TransformTimes of the scene span no time");
    std::vector<float> times;
    for (size_t i = 0; i < keyCount; ++i)
        times.push_back(lerp(first, last, static_cast<float>(i) / static_cast<float>(keyCount - 1)));
    return times;
}

FloatInput readAlpha(const ParamSet& params, const BuildContext& context) {
    if (params.has(kShadowAlpha)) {
        params.get(kShadowAlpha); // checks its type
        context.diagnostics.warn(params.whereIs(kShadowAlpha),
                                 "\"shadowalpha\" is ignored: shadow rays use \"alpha\"");
    }
    return params.get(kAlpha);
}

} // namespace strobe
