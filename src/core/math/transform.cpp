#include "core/math/transform.h"

#include "core/math/fast_math.h"
#include "core/math/simd4.h"

#include <Imath/ImathMatrixAlgo.h>

#include <stdexcept>

namespace strobe {

namespace {

M44f linearPart(const M44f& m) {
    return {m[0][0], m[0][1], m[0][2], 0, m[1][0], m[1][1], m[1][2], 0,
            m[2][0], m[2][1], m[2][2], 0, 0,       0,       0,       1};
}

/// Of rows `begin` to `end`: 0 to 2 are the linear part, 3 is the translation.
float largestElement(const M44f& m, int begin, int end) {
    float largest = 0;
    for (int i = begin; i < end; ++i)
        for (int j = 0; j < 3; ++j)
            largest = std::max(largest, std::abs(m[i][j]));
    return largest;
}

constexpr float kRounding = 1e-6f;

bool turnAlike(const M44f& a, const M44f& b) {
    return largestElement(a - b, 0, 3) <= kRounding * largestElement(a, 0, 3);
}

/// Far from the origin, a turn is small beside the translation, but no smaller in the picture.
bool nearlyEqual(const M44f& a, const M44f& b) {
    return turnAlike(a, b) && largestElement(a - b, 3, 4) <= kRounding * largestElement(a, 0, 4);
}

M44f lerp(const M44f& a, const M44f& b, float t) { return a * (1 - t) + b * t; }

/// The rotation of the polar decomposition of a matrix with positive determinant.
M44f nearestRotation(const M44f& linear) {
    Imath::M44d r(linear);
    for (int i = 0; i < 100; ++i) {
        const Imath::M44d next = (r + r.inverse().transposed()) * 0.5;
        double change = 0;
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b)
                change = std::max(change, std::abs(next[a][b] - r[a][b]));
        r = next;
        if (change < 1e-12)
            break;
    }
    return M44f(r);
}

/// Embree's decomposition: rotation by Gram-Schmidt on the images of the axes, so that the stretch is
/// triangular.
Decomposed decomposeTriangular(const M44f& m) {
    const V3f x(m[0][0], m[0][1], m[0][2]), y(m[1][0], m[1][1], m[1][2]), z(m[2][0], m[2][1], m[2][2]);
    const V3f e0 = normalize(x);
    const float yx = dot(y, e0);
    const V3f e1 = normalize(y - e0 * yx);
    const V3f e2 = cross(e0, e1);
    Decomposed d;
    d.translation = {m[3][0], m[3][1], m[3][2]};
    d.rotation =
        Imath::extractQuat(M44f(e0.x, e0.y, e0.z, 0, e1.x, e1.y, e1.z, 0, e2.x, e2.y, e2.z, 0, 0, 0, 0, 1))
            .normalized();
    d.stretch =
        M44f(dot(x, e0), 0, 0, 0, yx, dot(y, e1), 0, 0, dot(z, e0), dot(z, e1), dot(z, e2), 0, 0, 0, 0, 1);
    return d;
}

void alignRotations(std::vector<Decomposed>& parts) {
    for (size_t i = 1; i < parts.size(); ++i)
        if ((parts[i].rotation ^ parts[i - 1].rotation) < 0)
            parts[i].rotation = -parts[i].rotation;
}

/// Segment and fraction of `time` among ascending `times`, clamped to the ends.
std::pair<size_t, float> locate(const std::vector<float>& times, float time) {
    const size_t last = times.size() - 1;
    if (time <= times.front())
        return {0, 0.f};
    if (time >= times.back())
        return {last - 1, 1.f};
    const size_t i = std::upper_bound(times.begin(), times.end(), time) - times.begin() - 1;
    return {i, (time - times[i]) / (times[i + 1] - times[i])};
}

} // namespace

Decomposed decompose(const M44f& m) {
    const M44f linear = linearPart(m);
    const float sign = determinant3(linear) < 0 ? -1.f : 1.f;
    const M44f rotation = nearestRotation(linearPart(linear * sign));
    Decomposed d;
    d.translation = {m[3][0], m[3][1], m[3][2]};
    d.rotation = Imath::extractQuat(rotation).normalized();
    d.stretch = linear * rotation.transposed();
    return d;
}

M44f compose(const Decomposed& d) {
    M44f m = d.stretch * d.rotation.toMatrix44();
    m[3][0] = d.translation.x;
    m[3][1] = d.translation.y;
    m[3][2] = d.translation.z;
    return m;
}

Decomposed interpolate(const Decomposed& a, const Decomposed& b, float t) {
    Decomposed d;
    d.translation = lerp(a.translation, b.translation, t);
    d.rotation = Imath::slerpShortestArc(a.rotation, b.rotation, t);
    d.stretch = lerp(a.stretch, b.stretch, t);
    return d;
}

KeyedTransform::KeyedTransform(const M44f& still) : m_times{0}, m_keys{still} {}

KeyedTransform::KeyedTransform(std::vector<float> times, std::vector<M44f> keys, MotionConvention convention)
    : m_times(std::move(times)), m_keys(std::move(keys)), m_convention(convention) {
    if (m_times.size() != m_keys.size() || m_keys.empty())
        throw std::logic_error("KeyedTransform: as many times as keys are needed");
    const bool still =
        std::all_of(m_keys.begin(), m_keys.end(), [&](const M44f& k) { return nearlyEqual(k, m_keys[0]); });
    if (still) {
        m_times.resize(1);
        m_keys.resize(1);
        return;
    }
    for (const M44f& key : m_keys)
        m_parts.push_back(decompose(convention == MotionConvention::WorldToObject ? key.inverse() : key));
    alignRotations(m_parts);
}

M44f KeyedTransform::at(float time) const {
    if (isStatic())
        return m_keys[0];
    const auto [i, t] = locate(m_times, time);
    if (t == 0)
        return m_keys[i];
    if (t == 1)
        return m_keys[i + 1];
    const M44f m = compose(interpolate(m_parts[i], m_parts[i + 1], t));
    return m_convention == MotionConvention::WorldToObject ? m.inverse() : m;
}

void TransformChain::append(KeyedTransform t) {
    if (!m_chain.empty() && m_chain.back().isStatic() && t.isStatic())
        m_chain.back() = KeyedTransform(m_chain.back().at(0) * t.at(0));
    else
        m_chain.push_back(std::move(t));
}

M44f TransformChain::at(float time) const {
    M44f m;
    for (const KeyedTransform& t : m_chain)
        m = m * t.at(time);
    return m;
}

namespace {

std::array<V3f, 8> corners(const Box3f& box) {
    std::array<V3f, 8> out;
    for (int i = 0; i < 8; ++i)
        out[i] = {i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y,
                  i & 4 ? box.max.z : box.min.z};
    return out;
}

/// Where a fit with `segments` segments is held against the path: at the path's own keys, where it may have
/// corners (first, since they reject a fit soonest), and inside each segment.
std::vector<float> testFractions(const TransformChain& path, const Shutter& shutter, int segments) {
    std::vector<float> fractions;
    const float length = shutter.close - shutter.open;
    for (const KeyedTransform& t : path.chain())
        for (float time : t.times())
            if (time > shutter.open && time < shutter.close && length > 0)
                fractions.push_back((time - shutter.open) / length);
    for (int i = 0; i < segments; ++i)
        for (float f : {0.25f, 0.5f, 0.75f})
            fractions.push_back((float(i) + f) / float(segments));
    return fractions;
}

} // namespace

bool isStaticDuring(const TransformChain& path, const Shutter& shutter) {
    if (path.isStatic() || !(shutter.close > shutter.open))
        return true;
    const M44f start = path.at(shutter.open);
    for (float f : testFractions(path, shutter, 8))
        if (!nearlyEqual(start, path.at(shutter.sceneTime(f))))
            return false;
    return nearlyEqual(start, path.at(shutter.close));
}

Motion::Motion(const M44f& still) : m_matrices{still} {}

Motion::Motion(const TransformChain& path, const Shutter& shutter, const Box3f& bounds, float tolerance,
               int maxKeys) {
    fit(path, shutter, bounds, tolerance, maxKeys);
    m_onlyTranslates = keepsDirections();
}

void Motion::fit(const TransformChain& path, const Shutter& shutter, const Box3f& bounds, float tolerance,
                 int maxKeys) {
    if (isStaticDuring(path, shutter)) {
        m_matrices = {path.at(shutter.open)};
        return;
    }
    const std::array<V3f, 8> points = corners(bounds);
    const auto fits = [&](int segments) {
        for (float f : testFractions(path, shutter, segments)) {
            const M44f truth = path.at(shutter.sceneTime(f)), fitted = at(f);
            for (const V3f& p : points)
                if (length(transformPoint(truth, p) - transformPoint(fitted, p)) > tolerance)
                    return false;
        }
        return true;
    };
    for (int segments = 1; segments < maxKeys; ++segments) {
        m_count = segments + 1;
        m_matrices.clear();
        m_rotating.clear();
        m_slerps.clear();
        for (int i = 0; i <= segments; ++i)
            m_matrices.push_back(path.at(shutter.sceneTime(float(i) / segments)));
        if (fits(segments))
            return;
        findRotations();
        if (fits(segments))
            return;
    }
    m_converged = false;
}

bool Motion::keepsDirections() const {
    return !usesRotation() && std::all_of(m_matrices.begin(), m_matrices.end(),
                                          [&](const M44f& key) { return turnAlike(m_matrices[0], key); });
}

void Motion::findRotations() {
    for (const M44f& key : m_matrices)
        m_rotating.push_back(decomposeTriangular(key));
    alignRotations(m_rotating);
    for (size_t i = 1; i < m_rotating.size(); ++i)
        m_slerps.emplace_back(m_rotating[i - 1].rotation, m_rotating[i].rotation);
}

Motion::Slerp::Slerp(const Quatf& a, const Quatf& b) : from(a), across(0, 0, 0, 0), turns(0) {
    const Imath::Quatd start(a.r, a.v.x, a.v.y, a.v.z), end(b.r, b.v.x, b.v.y, b.v.z);
    const double cosine = start ^ end;
    const Imath::Quatd rest = end - start * cosine;
    const double sine = std::sqrt(rest ^ rest);
    if (!(sine > 0))
        return;
    const Imath::Quatd unit = rest * (1 / sine);
    across = Quatf(float(unit.r), float(unit.v.x), float(unit.v.y), float(unit.v.z));
    turns = float(std::atan2(sine, cosine) / (2 * M_PI));
}

M44f Motion::at(float time) const {
    if (m_count == 1)
        return m_matrices[0];
    const float x = std::clamp(time, 0.f, 1.f) * float(m_count - 1);
    const int i = std::min(int(x), m_count - 2);
    const float t = x - float(i);
    if (!usesRotation())
        return lerp(m_matrices[i], m_matrices[i + 1], t);
    const Slerp& slerp = m_slerps[size_t(i)];
    const SinCos angle = sinCosOfTurns(slerp.turns * t);
    const Decomposed &a = m_rotating[size_t(i)], &b = m_rotating[size_t(i) + 1];
    const M44f rotation = (slerp.from * angle.cos + slerp.across * angle.sin).toMatrix44();
    M44f m; // the stretch is triangular
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column) {
            float sum = 0;
            for (int k = 0; k <= row; ++k)
                sum += strobe::lerp(a.stretch[row][k], b.stretch[row][k], t) * rotation[k][column];
            m[row][column] = sum;
        }
    const V3f translation = strobe::lerp(a.translation, b.translation, t);
    m[3][0] = translation.x, m[3][1] = translation.y, m[3][2] = translation.z;
    return m;
}

namespace {

/// `keys`: `count` matrices, at least two. For four lanes from `i` on.
void interpolateFour(const float* keys, int count, const float* time, int i, AffineSoA& out) {
    const float* key[4];
    float t[4];
    for (int k = 0; k < 4; ++k) {
        const float x = std::clamp(time[i + k], 0.f, 1.f) * float(count - 1);
        const int before = std::min(int(x), count - 2);
        key[k] = keys + 16 * before, t[k] = x - float(before);
    }
    V3SoA* const rows[] = {&out.x, &out.y, &out.z, &out.o};
    for (int row = 0; row < 4; ++row) {
        const auto at = [&](int k) {
            const float* from = key[k] + 4 * row;
            return loadFloat4(from) * (1 - t[k]) + loadFloat4(from + 16) * t[k];
        };
        storeTransposed(at(0), at(1), at(2), at(3), rows[row]->x + i, rows[row]->y + i, rows[row]->z + i);
    }
}

} // namespace

void Motion::atSoA(const float* time, int begin, int end, AffineSoA& out) const {
    int i = begin;
    if (m_count > 1 && !usesRotation())
        for (; i + 4 <= end; i += 4)
            interpolateFour(m_matrices[0].getValue(), m_count, time, i, out);
    for (; i < end; ++i)
        out.set(i, at(time[i]));
}

} // namespace strobe
