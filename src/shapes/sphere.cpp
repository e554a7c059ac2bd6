#include "shapes/sphere.h"

#include "core/math/fast_math.h"
#include "core/math/soa.h"
#include "shapes/quadric_params.h"

namespace strobe {
namespace {

const ParamDef<float> kRadius{"radius", 1, "positive radius"};
const ParamDef<float> kZMin{"zmin", -kInfinity, "lower end in z; default: -radius"};
const ParamDef<float> kZMax{"zmax", kInfinity, "upper end in z; default: radius"};

/// The clipping of a sphere. A pole that is not clipped has an infinite limit, so that rounding opens no
/// hole.
struct SphereClip {
    double radius;
    float zMin = -kInfinity, zMax = kInfinity;
    int32_t isBeyondHalf = 1; ///< phiMax > π
    float cosPhiMax = 1, sinPhiMax = 0;
    float minSide = -kInfinity; ///< lower limit of `side`: 0, or -infinity for a full sweep

    STROBE_FORCE_INLINE int32_t contains(float x, float y, float z) const {
        const float side = x * sinPhiMax - y * cosPhiMax; // positive in the half circle before phiMax
        const int32_t afterZero = y >= 0 ? 1 : 0, beforeMax = side >= minSide ? 1 : 0;
        const int32_t inSweep = (afterZero & beforeMax) | (isBeyondHalf & (afterZero | beforeMax));
        return inSweep & (z >= zMin ? 1 : 0) & (z <= zMax ? 1 : 0);
    }
};

/// The intersection of a ray with a clipped sphere. Branch-free, so that loops over rays vectorize.
struct SphereHit {
    int32_t isHit; ///< 0 or 1
    float t, x, y, z;

    /// Computes in double, because float misses small, distant spheres. The discriminant is computed from the
    /// point of closest approach, which avoids cancellation (Haines et al. 2019, "Precision Improvements for
    /// Ray/Sphere Intersection"). For a direction of length 0 it is NaN, for which all comparisons are false:
    /// no hit.
    STROBE_FORCE_INLINE SphereHit(const SphereClip& s, const V3f& o, const V3f& d, float tmin, float tmax) {
        const double ox = o.x, oy = o.y, oz = o.z, dx = d.x, dy = d.y, dz = d.z;
        const double inverse = 1 / (dx * dx + dy * dy + dz * dz), radius2 = s.radius * s.radius;
        const double middle = -(ox * dx + oy * dy + oz * dz) * inverse;
        const double nx = ox + dx * middle, ny = oy + dy * middle, nz = oz + dz * middle;
        const double discriminant = (radius2 - (nx * nx + ny * ny + nz * nz)) * inverse;
        const double half = std::sqrt(discriminant > 0 ? discriminant : 0.);
        // The root of larger magnitude is accurate; the other root follows from their product.
        const double far = middle + (middle < 0 ? -half : half);
        const double product = (ox * ox + oy * oy + oz * oz - radius2) * inverse, ratio = product / far;
        const double other = far != 0 ? ratio : 0.;
        const double root0 = far < other ? far : other, root1 = far < other ? other : far;

        const float x0 = float(ox + dx * root0), x1 = float(ox + dx * root1);
        const float y0 = float(oy + dy * root0), y1 = float(oy + dy * root1);
        const float z0 = float(oz + dz * root0), z1 = float(oz + dz * root1);
        const float t0 = float(root0), t1 = float(root1), disc = float(discriminant);
        const int32_t is0 = (t0 > tmin ? 1 : 0) & (t0 < tmax ? 1 : 0) & s.contains(x0, y0, z0);
        const int32_t is1 = (t1 > tmin ? 1 : 0) & (t1 < tmax ? 1 : 0) & s.contains(x1, y1, z1);
        isHit = (disc >= 0 ? 1 : 0) & (is0 | is1);
        t = is0 ? t0 : t1;
        x = is0 ? x0 : x1;
        y = is0 ? y0 : y1;
        z = is0 ? z0 : z1;
    }
};

/// Returns θ in [0, π], the angle from the z axis.
STROBE_FORCE_INLINE float polarAngle(float x, float y, float z) {
    return fastAtan2(std::sqrt(x * x + y * y), z);
}

struct SphereHitSoA {
    alignas(64) float t[QuadricRaySoA::kMax], x[QuadricRaySoA::kMax], y[QuadricRaySoA::kMax],
        z[QuadricRaySoA::kMax];
};

/// Intersects the rays for which hit[i] is not 0; sets hit[i] to 0 if ray i misses. Returns 0 if all miss.
STROBE_TARGET_CLONES int32_t findHits(const SphereClip& sphere, const QuadricRaySoA& rays, int32_t* hit,
                                      SphereHitSoA& out) {
    const SphereClip s = sphere;
    const float *tmin = rays.tmin, *tmax = rays.tmax;
    const int n = rays.n;
    int32_t any = 0;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const SphereHit h(s, rays.o(i), rays.d(i), tmin[i], tmax[i]);
        hit[i] = h.isHit ? hit[i] : 0;
        out.t[i] = h.t;
        out.x[i] = h.x;
        out.y[i] = h.y;
        out.z[i] = h.z;
        any |= hit[i];
    }
    return any;
}

STROBE_TARGET_CLONES void findAngles(const SphereHitSoA& hits, int n, float* phi, float* theta) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const float x = hits.x[i], y = hits.y[i], z = hits.z[i];
        phi[i] = azimuth(x, y);
        theta[i] = polarAngle(x, y, z);
    }
}

/// The parametrization of a sphere.
struct SphereParametrization {
    double radius, phiMax, thetaMin, thetaSpan;

    STROBE_FORCE_INLINE QuadricPoint point(float u, float v, double cosTheta, double sinTheta) const {
        const V2d phi = unitVector(u * phiMax);
        const double cosPhi = phi.x, sinPhi = phi.y;
        const double x = cosPhi * sinTheta, y = sinPhi * sinTheta, z = cosTheta;
        // The minimum radius keeps the direction of dp/du at the poles.
        const double perU = phiMax * radius * (sinTheta > kPoleRadius ? sinTheta : kPoleRadius);
        const double perV = radius * thetaSpan;
        return {
            V3f(float(x * radius), float(y * radius), float(z * radius)), V3f(float(x), float(y), float(z)),
            V3f(float(-sinPhi * perU), float(cosPhi * perU), 0.f),
            V3f(float(cosPhi * cosTheta * perV), float(sinPhi * cosTheta * perV), float(-sinTheta * perV)),
            V2f(u, v)};
    }
    STROBE_FORCE_INLINE QuadricPoint point(float u, float v) const {
        const V2d polar = unitVector(thetaMin + v * thetaSpan);
        return point(u, v, polar.x, polar.y);
    }
};

STROBE_TARGET_CLONES void findPoints(const SphereParametrization& sphere, const float* u, const float* v,
                                     int begin, int end, QuadricPointSoA& points) {
    const SphereParametrization s = sphere;
    V3SoA &p = points.p, &n = points.n, &dpdu = points.dpdu, &dpdv = points.dpdv;
    V2SoA& uv = points.uv;
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const QuadricPoint q = s.point(u[i], v[i]);
        p.x[i] = q.p.x;
        p.y[i] = q.p.y;
        p.z[i] = q.p.z;
        n.x[i] = q.n.x;
        n.y[i] = q.n.y;
        n.z[i] = q.n.z;
        dpdu.x[i] = q.dpdu.x;
        dpdu.y[i] = q.dpdu.y;
        dpdu.z[i] = q.dpdu.z;
        dpdv.x[i] = q.dpdv.x;
        dpdv.y[i] = q.dpdv.y;
        dpdv.z[i] = q.dpdv.z;
        uv.x[i] = q.uv.x;
        uv.y[i] = q.uv.y;
    }
}

class Sphere : public Quadric {
  public:
    explicit Sphere(const ParamSet& params) : m_radius(positive(params, kRadius)), m_phiMax(sweep(params)) {
        const double zMin = params.get(kZMin), zMax = params.get(kZMax);
        m_zMin = std::clamp(std::min(zMin, zMax), -m_radius, m_radius);
        m_zMax = std::clamp(std::max(zMin, zMax), -m_radius, m_radius);
        if (!(m_zMin < m_zMax)) // also catches NaN
            throw Error(params.has(kZMin) ? params.whereIs(kZMin) : params.whereIs(kZMax),
                        "\"zmin\" and \"zmax\" leave nothing of the sphere");
        m_clip.radius = m_radius;
        if (m_zMin > -m_radius)
            m_clip.zMin = float(m_zMin);
        if (m_zMax < m_radius)
            m_clip.zMax = float(m_zMax);
        if (m_phiMax < kTwoPi) {
            m_clip.isBeyondHalf = m_phiMax > kTwoPi / 2;
            m_clip.cosPhiMax = float(std::cos(m_phiMax));
            m_clip.sinPhiMax = float(std::sin(m_phiMax));
            m_clip.minSide = 0;
        }
        m_thetaMin = std::acos(m_zMin / m_radius);
        m_thetaMax = std::acos(m_zMax / m_radius);
        m_uPerPhi = 1 / m_phiMax;
        m_vPerTheta = 1 / (m_thetaMax - m_thetaMin);
    }

    Box3f bounds() const override {
        const bool hasEquator = m_zMin <= 0 && m_zMax >= 0;
        const double z = std::min(std::abs(m_zMin), std::abs(m_zMax));
        const auto rho = static_cast<float>(hasEquator ? m_radius : std::sqrt(m_radius * m_radius - z * z));
        return {{-rho, -rho, static_cast<float>(m_zMin)}, {rho, rho, static_cast<float>(m_zMax)}};
    }

    bool intersect(const V3f& o, const V3f& d, float tmin, float tmax, float& t, float& u,
                   float& v) const override {
        const SphereHit hit(m_clip, o, d, tmin, tmax);
        if (!hit.isHit)
            return false;
        t = hit.t;
        u = uOf(azimuth(hit.x, hit.y));
        v = vOf(polarAngle(hit.x, hit.y, hit.z));
        return true;
    }

    void intersectSoA(const QuadricRaySoA& rays, int32_t* hit, float* t, float* u, float* v) const override {
        SphereHitSoA hits;
        if (findHits(m_clip, rays, hit, hits) == 0)
            return;
        findAngles(hits, rays.n, u, v);
        for (int i = 0; i < rays.n; ++i) {
            t[i] = hits.t[i];
            u[i] = uOf(u[i]);
            v[i] = vOf(v[i]);
        }
    }

    QuadricPoint point(float u, float v) const override { return parametrization().point(u, v); }
    void pointSoA(const float* u, const float* v, int begin, int end, QuadricPointSoA& out) const override {
        findPoints(parametrization(), u, v, begin, end, out);
    }

    float area() const override { return static_cast<float>(m_phiMax * m_radius * (m_zMax - m_zMin)); }

    QuadricPoint samplePoint(const V2f& u) const override {
        // The area is proportional to the extent in z (Archimedes).
        const double cosTheta = (m_zMin + u.x * (m_zMax - m_zMin)) / m_radius;
        const double sinTheta = std::sqrt(std::max(0., 1 - cosTheta * cosTheta));
        return parametrization().point(u.y, vOf(fastAtan2(float(sinTheta), float(cosTheta))), cosTheta,
                                       sinTheta);
    }

    float wholeSphereRadius() const override {
        const bool isWhole = m_phiMax >= kTwoPi && m_zMin <= -m_radius && m_zMax >= m_radius;
        return isWhole ? static_cast<float>(m_radius) : 0;
    }

  private:
    // The parameters u and v of the angles.
    float uOf(float phi) const { return std::min(static_cast<float>(phi * m_uPerPhi), 1.f); }
    float vOf(double theta) const {
        return std::clamp(static_cast<float>((theta - m_thetaMin) * m_vPerTheta), 0.f, 1.f);
    }

    SphereParametrization parametrization() const {
        return {m_radius, m_phiMax, m_thetaMin, m_thetaMax - m_thetaMin};
    }

    double m_radius, m_phiMax, m_zMin, m_zMax, m_thetaMin, m_thetaMax;
    double m_uPerPhi, m_vPerTheta;
    SphereClip m_clip;
};

Shape createSphere(const ParamSet& params, const BuildContext& context) {
    if (params.get(kZMin) > params.get(kZMax)) {
        const std::string problem = "\"zmin\" is above \"zmax\"";
        if (!context.isLenient)
            throw Error(params.whereIs(kZMin), problem);
        context.diagnostics.warn(params.whereIs(kZMin), problem + " (they are exchanged)");
    }
    return {nullptr, std::make_shared<Sphere>(params)};
}

} // namespace

Plugin<Shape> spherePlugin() {
    return {"sphere",
            "sphere around the origin, optionally clipped",
            {kRadius, kZMin, kZMax, kPhiMax},
            createSphere};
}

} // namespace strobe
