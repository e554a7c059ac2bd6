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

/// Returns the largest absolute value in rows begin … end-1. Rows 0 to 2 are the linear part, row 3 is the
/// translation.
float largestElement(const M44f& m, int begin, int end) {
    float largest = 0;
    for (int i = begin; i < end; ++i)
        for (int j = 0; j < 3; ++j)
            largest = std::max(largest, std::abs(m[i][j]));
    return largest;
}

constexpr float kRounding = 1e-6f; ///< relative difference of matrices that count as equal

bool haveSameLinearPart(const M44f& a, const M44f& b) {
    return largestElement(a - b, 0, 3) <= kRounding * largestElement(a, 0, 3);
}

/// Compares the linear part separately: far from the origin, a rotation is small relative to the translation,
/// but as visible as near the origin.
bool nearlyEqual(const M44f& a, const M44f& b) {
    return haveSameLinearPart(a, b) && largestElement(a - b, 3, 4) <= kRounding * largestElement(a, 0, 4);
}

M44f lerp(const M44f& a, const M44f& b, float t) { return a * (1 - t) + b * t; }

/// Returns the rotation of the polar decomposition of a matrix with positive determinant.
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

/// Returns Embree's decomposition: the rotation orthonormalizes the images of the axes (Gram-Schmidt), so
/// that the stretch is triangular.
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

/// Negates quaternions such that neighboring rotations lie in one hemisphere.
void alignRotations(std::vector<Decomposed>& keys) {
    for (size_t i = 1; i < keys.size(); ++i)
        if ((keys[i].rotation ^ keys[i - 1].rotation) < 0)
            keys[i].rotation = -keys[i].rotation;
}

/// Returns the segment between ascending `times` that contains `time`, and the fraction within it. Times
/// beyond the ends are clamped.
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

KeyedTransform::KeyedTransform(const M44f& matrix) : m_times{0}, m_keys{matrix} {}

KeyedTransform::KeyedTransform(std::vector<float> times, std::vector<M44f> keys, MotionConvention convention)
    : m_times(std::move(times)), m_keys(std::move(keys)), m_convention(convention) {
    if (m_times.size() != m_keys.size() || m_keys.empty())
        throw std::logic_error("KeyedTransform needs as many times as keys, and at least one");
    const bool isConstant =
        std::all_of(m_keys.begin(), m_keys.end(), [&](const M44f& k) { return nearlyEqual(k, m_keys[0]); });
    if (isConstant) {
        m_times.resize(1);
        m_keys.resize(1);
        return;
    }
    for (const M44f& key : m_keys)
        m_decomposed.push_back(
            decompose(convention == MotionConvention::WorldToObject ? key.inverse() : key));
    alignRotations(m_decomposed);
}

M44f KeyedTransform::at(float time) const {
    if (isStatic())
        return m_keys[0];
    const auto [i, t] = locate(m_times, time);
    if (t == 0)
        return m_keys[i];
    if (t == 1)
        return m_keys[i + 1];
    const M44f m = compose(interpolate(m_decomposed[i], m_decomposed[i + 1], t));
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

/// Returns the shutter fractions where a fit with `segments` segments is compared with the path: at the keys
/// of the path, where its derivative may be discontinuous, and inside each segment. The keys come first,
/// since most fits fail there.
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

Motion::Motion(const M44f& matrix) : m_matrices{matrix} {}

Motion::Motion(const TransformChain& path, const Shutter& shutter, const Box3f& bounds, float tolerance,
               int maxKeys) {
    fit(path, shutter, bounds, tolerance, maxKeys);
    m_onlyTranslates = hasConstantLinearPart();
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
            const M44f expected = path.at(shutter.sceneTime(f));
            const M44f fitted = at(f);
            for (const V3f& p : points)
                if (length(transformPoint(expected, p) - transformPoint(fitted, p)) > tolerance)
                    return false;
        }
        return true;
    };
    for (int segments = 1; segments < maxKeys; ++segments) {
        m_count = segments + 1;
        m_matrices.clear();
        m_decomposed.clear();
        m_slerps.clear();
        for (int i = 0; i <= segments; ++i)
            m_matrices.push_back(path.at(shutter.sceneTime(float(i) / segments)));
        if (fits(segments))
            return;
        decomposeKeys();
        if (fits(segments))
            return;
    }
    m_converged = false;
}

bool Motion::hasConstantLinearPart() const {
    return !usesRotation() && std::all_of(m_matrices.begin(), m_matrices.end(), [&](const M44f& key) {
        return haveSameLinearPart(m_matrices[0], key);
    });
}

void Motion::decomposeKeys() {
    for (const M44f& key : m_matrices)
        m_decomposed.push_back(decomposeTriangular(key));
    alignRotations(m_decomposed);
    for (size_t i = 1; i < m_decomposed.size(); ++i)
        m_slerps.emplace_back(m_decomposed[i - 1].rotation, m_decomposed[i].rotation);
}

Motion::Slerp::Slerp(const Quatf& a, const Quatf& b) : start(a), normal(0, 0, 0, 0), angle(0) {
    const Imath::Quatd from(a.r, a.v.x, a.v.y, a.v.z);
    const Imath::Quatd to(b.r, b.v.x, b.v.y, b.v.z);
    const double cosine = from ^ to;
    const Imath::Quatd orthogonal = to - from * cosine;
    const double sine = std::sqrt(orthogonal ^ orthogonal);
    if (!(sine > 0))
        return;
    const Imath::Quatd unit = orthogonal * (1 / sine);
    normal = Quatf(float(unit.r), float(unit.v.x), float(unit.v.y), float(unit.v.z));
    angle = float(std::atan2(sine, cosine) / (2 * M_PI));
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
    const SinCos angle = sinCosOfTurns(slerp.angle * t);
    const Decomposed& a = m_decomposed[size_t(i)];
    const Decomposed& b = m_decomposed[size_t(i) + 1];
    const M44f rotation = (slerp.start * angle.cos + slerp.normal * angle.sin).toMatrix44();
    M44f m;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column) {
            float sum = 0;
            for (int k = 0; k <= row; ++k) // the stretch is triangular
                sum += strobe::lerp(a.stretch[row][k], b.stretch[row][k], t) * rotation[k][column];
            m[row][column] = sum;
        }
    const V3f translation = strobe::lerp(a.translation, b.translation, t);
    m[3][0] = translation.x;
    m[3][1] = translation.y;
    m[3][2] = translation.z;
    return m;
}

namespace {

/// Interpolates the `count` >= 2 matrices at `keys` linearly, at times i … i+3.
void interpolateFour(const float* keys, int count, const float* time, int i, AffineSoA& out) {
    const float* key[4];
    float t[4];
    for (int k = 0; k < 4; ++k) {
        const float x = std::clamp(time[i + k], 0.f, 1.f) * float(count - 1);
        const int before = std::min(int(x), count - 2);
        key[k] = keys + 16 * before;
        t[k] = x - float(before);
    }
    V3SoA* const rows[] = {&out.x, &out.y, &out.z, &out.o};
    for (int row = 0; row < 4; ++row) {
        const auto interpolated = [&](int k) {
            const float* source = key[k] + 4 * row;
            return loadFloat4(source) * (1 - t[k]) + loadFloat4(source + 16) * t[k];
        };
        storeTransposed(interpolated(0), interpolated(1), interpolated(2), interpolated(3), rows[row]->x + i,
                        rows[row]->y + i, rows[row]->z + i);
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
