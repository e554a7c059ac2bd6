#include "loader/build/deformation_fit.h"

#include <algorithm>

namespace strobe {
namespace {

using Keys = std::vector<std::vector<V3f>>;

constexpr int kMaxSegments = 128; // Embree's limit

/// Returns the vertex array at scene time `time`, linear between keys.
std::vector<V3f> interpolateKeys(const Keys& keys, const std::vector<float>& times, float time) {
    if (time <= times.front())
        return keys.front();
    if (time >= times.back())
        return keys.back();
    const size_t i = size_t(std::upper_bound(times.begin(), times.end(), time) - times.begin()) - 1;
    const float t = (time - times[i]) / (times[i + 1] - times[i]);
    if (t == 0)
        return keys[i];
    std::vector<V3f> out(keys[i].size());
    for (size_t k = 0; k < out.size(); ++k)
        out[k] = lerp(keys[i][k], keys[i + 1][k], t);
    return out;
}

/// Returns the largest distance between vertices of the same index.
float largestDistance(const std::vector<V3f>& a, const std::vector<V3f>& b) {
    float largest2 = 0;
    for (size_t i = 0; i < a.size(); ++i)
        largest2 = std::max(largest2, length2(a[i] - b[i]));
    return std::sqrt(largest2);
}

/// The motion of a mesh during the shutter, and fits to it.
class MeshMotion {
  public:
    MeshMotion(const TriangleMesh& source, const Shutter& shutter) : m_source(source), m_shutter(shutter) {
        for (float t : source.keyTimes)
            if (t > shutter.open && t < shutter.close)
                m_innerTimes.push_back(t);
    }

    bool isStatic() const {
        const auto start = positionsAt(m_shutter.open);
        bool isStatic = largestDistance(start, positionsAt(m_shutter.close)) <=
                        1e-6f * length(meshBounds(m_source).size());
        for (float t : m_innerTimes)
            isStatic &= largestDistance(start, positionsAt(t)) == 0;
        return isStatic || !(m_shutter.close > m_shutter.open);
    }

    /// Returns `keys` (positions or normals of the source) at segments + 1 uniform times.
    Keys resampled(const Keys& keys, int segments) const {
        Keys out;
        for (int i = 0; i <= segments; ++i)
            out.push_back(interpolateKeys(keys, m_source.keyTimes,
                                          m_shutter.sceneTime(segments ? float(i) / float(segments) : 0)));
        return out;
    }

    /// Returns true if interpolation of the uniform keys `positions` stays within `tolerance` of the source.
    /// The difference of two piecewise linear motions is largest at a key, and it is 0 at the uniform keys,
    /// which are samples of the source.
    bool isWithin(float tolerance, const Keys& positions) const {
        const int segments = int(positions.size()) - 1;
        for (float t : m_innerTimes) {
            const float x = (t - m_shutter.open) / (m_shutter.close - m_shutter.open) * float(segments);
            const int i = std::min(int(x), segments - 1);
            const auto truth = positionsAt(t);
            std::vector<V3f> fitted(truth.size());
            for (size_t k = 0; k < truth.size(); ++k)
                fitted[k] = lerp(positions[i][k], positions[i + 1][k], x - float(i));
            if (largestDistance(truth, fitted) > tolerance)
                return false;
        }
        return true;
    }

  private:
    std::vector<V3f> positionsAt(float time) const {
        return interpolateKeys(m_source.positions, m_source.keyTimes, time);
    }

    const TriangleMesh& m_source;
    const Shutter m_shutter;
    std::vector<float> m_innerTimes; ///< the source's key times inside the shutter
};

} // namespace

Box3f meshBounds(const TriangleMesh& mesh) {
    Box3f box;
    for (const auto& key : mesh.positions)
        for (const V3f& p : key)
            box.extendBy(p);
    return box;
}

std::shared_ptr<TriangleMesh> fitDeformation(const TriangleMesh& source, const Shutter& shutter,
                                             float tolerance) {
    const MeshMotion motion(source, shutter);
    int segments = motion.isStatic() ? 0 : 1;
    Keys positions = motion.resampled(source.positions, segments);
    while (segments > 0 && segments < kMaxSegments && !motion.isWithin(tolerance, positions)) {
        ++segments;
        positions = motion.resampled(source.positions, segments);
    }
    auto mesh = std::make_shared<TriangleMesh>();
    mesh->indices = source.indices;
    mesh->positions = std::move(positions);
    if (!source.normals.empty())
        mesh->normals = motion.resampled(source.normals, segments);
    mesh->tangents = source.tangents;
    mesh->uvs = source.uvs;
    mesh->alpha = source.alpha;
    mesh->culledSide = source.culledSide;
    for (int i = 0; segments > 0 && i <= segments; ++i)
        mesh->keyTimes.push_back(float(i) / float(segments));
    return mesh;
}

} // namespace strobe
