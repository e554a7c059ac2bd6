#include "shapes/sphere.h"

#include "core/math/fast_math.h"
#include "core/math/soa.h"
#include "shapes/quadric_params.h"

namespace strobe {
namespace {

const ParamDef<float> kRadius{"radius", 1, "radius"};
const ParamDef<float> kZMin{"zmin", -kInfinity, "the part below this z is cut away; default: -radius"};
const ParamDef<float> kZMax{"zmax", kInfinity, "the part above this z is cut away; default: radius"};

/// What is there of a sphere. Whole ends have no limits: rounding must not open holes at the poles.
struct Part {
    double radius;
    float zMin = -kInfinity, zMax = kInfinity;
    int32_t beyondHalf = 1;   ///< phiMax > pi
    float cos = 1, sin = 0;   ///< of phiMax
    float least = -kInfinity; ///< what `across` must be; 0, unless all the way round is there

    STROBE_FORCE_INLINE int32_t has(float x, float y, float z) const {
        const float across = x * sin - y * cos; // positive in the half circle before phiMax
        const int32_t first = y >= 0 ? 1 : 0, second = across >= least ? 1 : 0;
        const int32_t inSweep = (first & second) | (beyondHalf & (first | second));
        return inSweep & (z >= zMin ? 1 : 0) & (z <= zMax ? 1 : 0);
    }
};

/// Where a ray hits. Without branches, for loops over rays.
struct SphereHit {
    int32_t met; ///< 0 or 1
    float t, x, y, z;

    /// In double: float loses the hit of a small sphere far away. The discriminant is that of the point of
    /// closest approach, which does not cancel (Haines et al. 2019, "Precision Improvements for Ray/Sphere
    /// Intersection"). Directions of no length make it no number, which no comparison holds for.
    STROBE_FORCE_INLINE SphereHit(const Part& s, const V3f& o, const V3f& d, float tmin, float tmax) {
        const double ox = o.x, oy = o.y, oz = o.z, dx = d.x, dy = d.y, dz = d.z;
        const double inverse = 1 / (dx * dx + dy * dy + dz * dz), radius2 = s.radius * s.radius;
        const double middle = -(ox * dx + oy * dy + oz * dz) * inverse;
        const double nx = ox + dx * middle, ny = oy + dy * middle, nz = oz + dz * middle;
        const double discriminant = (radius2 - (nx * nx + ny * ny + nz * nz)) * inverse;
        const double half = std::sqrt(discriminant > 0 ? discriminant : 0.);
        // The root farther from 0 is exact; the other follows from their product.
        const double far = middle + (middle < 0 ? -half : half);
        const double product = (ox * ox + oy * oy + oz * oz - radius2) * inverse, ratio = product / far;
        const double other = far != 0 ? ratio : 0.;
        const double root0 = far < other ? far : other, root1 = far < other ? other : far;

        const float x0 = float(ox + dx * root0), x1 = float(ox + dx * root1);
        const float y0 = float(oy + dy * root0), y1 = float(oy + dy * root1);
        const float z0 = float(oz + dz * root0), z1 = float(oz + dz * root1);
        const float t0 = float(root0), t1 = float(root1), exists = float(discriminant);
        const int32_t is0 = (t0 > tmin ? 1 : 0) & (t0 < tmax ? 1 : 0) & s.has(x0, y0, z0);
        const int32_t is1 = (t1 > tmin ? 1 : 0) & (t1 < tmax ? 1 : 0) & s.has(x1, y1, z1);
        met = (exists >= 0 ? 1 : 0) & (is0 | is1);
        t = is0 ? t0 : t1, x = is0 ? x0 : x1, y = is0 ? y0 : y1, z = is0 ? z0 : z1;
    }
};

STROBE_FORCE_INLINE float polarAngle(float x, float y, float z) {
    return fastAtan2(std::sqrt(x * x + y * y), z);
}

struct SphereHits {
    alignas(64) float t[QuadricRaySoA::kMax], x[QuadricRaySoA::kMax], y[QuadricRaySoA::kMax],
        z[QuadricRaySoA::kMax];
};

STROBE_TARGET_CLONES int32_t findHits(const Part& sphere, const QuadricRaySoA& rays, int32_t* hit,
                                      SphereHits& out) {
    const Part s = sphere;
    const float *tmin = rays.tmin, *tmax = rays.tmax;
    const int n = rays.n;
    int32_t any = 0;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const SphereHit found(s, rays.o(i), rays.d(i), tmin[i], tmax[i]);
        hit[i] = found.met ? hit[i] : 0;
        out.t[i] = found.t, out.x[i] = found.x, out.y[i] = found.y, out.z[i] = found.z;
        any |= hit[i];
    }
    return any;
}

STROBE_TARGET_CLONES void findAngles(const SphereHits& hits, int n, float* phi, float* theta) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const float x = hits.x[i], y = hits.y[i], z = hits.z[i];
        phi[i] = azimuth(x, y), theta[i] = polarAngle(x, y, z);
    }
}

/// What a point follows from.
struct Surface {
    double radius, phiMax, thetaMin, thetaSpan;

    STROBE_FORCE_INLINE QuadricPoint at(float u, float v, double cosTheta, double sinTheta) const {
        const V2d phi = unitVector(u * phiMax);
        const double cosPhi = phi.x, sinPhi = phi.y;
        const double x = cosPhi * sinTheta, y = sinPhi * sinTheta, z = cosTheta;
        // Not zero at the poles, where only the direction is wanted.
        const double perU = phiMax * radius * (sinTheta > kPoleRadius ? sinTheta : kPoleRadius);
        const double perV = radius * thetaSpan;
        return {
            V3f(float(x * radius), float(y * radius), float(z * radius)), V3f(float(x), float(y), float(z)),
            V3f(float(-sinPhi * perU), float(cosPhi * perU), 0.f),
            V3f(float(cosPhi * cosTheta * perV), float(sinPhi * cosTheta * perV), float(-sinTheta * perV)),
            V2f(u, v)};
    }
    STROBE_FORCE_INLINE QuadricPoint at(float u, float v) const {
        const V2d polar = unitVector(thetaMin + v * thetaSpan);
        return at(u, v, polar.x, polar.y);
    }
};

STROBE_TARGET_CLONES void findPoints(const Surface& surface, const float* u, const float* v, int begin,
                                     int end, QuadricPointSoA& lanes) {
    const Surface s = surface;
    V3SoA &p = lanes.p, &n = lanes.n, &dpdu = lanes.dpdu, &dpdv = lanes.dpdv;
    V2SoA& uv = lanes.uv;
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const QuadricPoint q = s.at(u[i], v[i]);
        p.x[i] = q.p.x, p.y[i] = q.p.y, p.z[i] = q.p.z;
        n.x[i] = q.n.x, n.y[i] = q.n.y, n.z[i] = q.n.z;
        dpdu.x[i] = q.dpdu.x, dpdu.y[i] = q.dpdu.y, dpdu.z[i] = q.dpdu.z;
        dpdv.x[i] = q.dpdv.x, dpdv.y[i] = q.dpdv.y, dpdv.z[i] = q.dpdv.z;
        uv.x[i] = q.uv.x, uv.y[i] = q.uv.y;
    }
}

/// u = phi / phimax, v = (theta - thetaMin) / (thetaMax - thetaMin), thetaMin being that of zmin.
class Sphere : public Quadric {
  public:
    explicit Sphere(const ParamSet& params) : m_radius(positive(params, kRadius)), m_phiMax(sweep(params)) {
        const double zMin = params.get(kZMin), zMax = params.get(kZMax);
        m_zMin = std::clamp(std::min(zMin, zMax), -m_radius, m_radius);
        m_zMax = std::clamp(std::max(zMin, zMax), -m_radius, m_radius);
        if (!(m_zMin < m_zMax)) // also catches NaN
            throw Error(params.has(kZMin) ? params.whereIs(kZMin) : params.whereIs(kZMax),
                        "\"zmin\" and \"zmax\" leave nothing of the sphere");
        m_part.radius = m_radius;
        if (m_zMin > -m_radius)
            m_part.zMin = float(m_zMin);
        if (m_zMax < m_radius)
            m_part.zMax = float(m_zMax);
        if (m_phiMax < kTwoPi) {
            m_part.beyondHalf = m_phiMax > kTwoPi / 2;
            m_part.cos = float(std::cos(m_phiMax)), m_part.sin = float(std::sin(m_phiMax)), m_part.least = 0;
        }
        m_thetaMin = std::acos(m_zMin / m_radius);
        m_thetaMax = std::acos(m_zMax / m_radius);
        m_perPhi = 1 / m_phiMax, m_perTheta = 1 / (m_thetaMax - m_thetaMin);
    }

    Box3f bounds() const override {
        const bool hasEquator = m_zMin <= 0 && m_zMax >= 0;
        const double z = std::min(std::abs(m_zMin), std::abs(m_zMax));
        const auto rho = static_cast<float>(hasEquator ? m_radius : std::sqrt(m_radius * m_radius - z * z));
        return {{-rho, -rho, static_cast<float>(m_zMin)}, {rho, rho, static_cast<float>(m_zMax)}};
    }

    bool intersect(const V3f& o, const V3f& d, float tmin, float tmax, float& t, float& u,
                   float& v) const override {
        const SphereHit hit(m_part, o, d, tmin, tmax);
        if (!hit.met)
            return false;
        t = hit.t, u = alongPhi(azimuth(hit.x, hit.y)), v = alongTheta(polarAngle(hit.x, hit.y, hit.z));
        return true;
    }

    void intersectSoA(const QuadricRaySoA& rays, int32_t* hit, float* t, float* u, float* v) const override {
        SphereHits hits;
        if (findHits(m_part, rays, hit, hits) == 0)
            return;
        findAngles(hits, rays.n, u, v);
        for (int i = 0; i < rays.n; ++i)
            t[i] = hits.t[i], u[i] = alongPhi(u[i]), v[i] = alongTheta(v[i]);
    }

    QuadricPoint point(float u, float v) const override { return surface().at(u, v); }
    void pointSoA(const float* u, const float* v, int begin, int end, QuadricPointSoA& out) const override {
        findPoints(surface(), u, v, begin, end, out);
    }

    float area() const override { return static_cast<float>(m_phiMax * m_radius * (m_zMax - m_zMin)); }

    QuadricPoint samplePoint(const V2f& u) const override {
        // Equal slices in z have equal areas (Archimedes).
        const double cosTheta = (m_zMin + u.x * (m_zMax - m_zMin)) / m_radius;
        const double sinTheta = std::sqrt(std::max(0., 1 - cosTheta * cosTheta));
        return surface().at(u.y, alongTheta(fastAtan2(float(sinTheta), float(cosTheta))), cosTheta, sinTheta);
    }

    float wholeSphereRadius() const override {
        const bool whole = m_phiMax >= kTwoPi && m_zMin <= -m_radius && m_zMax >= m_radius;
        return whole ? static_cast<float>(m_radius) : 0;
    }

  private:
    float alongPhi(float phi) const { return std::min(static_cast<float>(phi * m_perPhi), 1.f); }
    float alongTheta(double theta) const {
        return std::clamp(static_cast<float>((theta - m_thetaMin) * m_perTheta), 0.f, 1.f);
    }

    Surface surface() const { return {m_radius, m_phiMax, m_thetaMin, m_thetaMax - m_thetaMin}; }

    double m_radius, m_phiMax, m_zMin, m_zMax, m_thetaMin, m_thetaMax;
    double m_perPhi, m_perTheta; ///< of u and of v
    Part m_part;
};

Shape createSphere(const ParamSet& params, const BuildContext&) {
    return {nullptr, std::make_shared<Sphere>(params)};
}

} // namespace

Plugin<Shape> spherePlugin() {
    return {
        "sphere", "sphere about the origin, or a part of it", {kRadius, kZMin, kZMax, kPhiMax}, createSphere};
}

} // namespace strobe
