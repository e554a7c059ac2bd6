#include "shapes/sphere.h"

#include "core/fast_math.h"
#include "core/lanes.h"
#include "shapes/quadric_params.h"

namespace strobe {
namespace {

const ParamDef<float> kRadius{"radius", 1, "radius"};
const ParamDef<float> kZMin{"zmin", -kInfinity, "the part below this z is cut away; default: -radius"};
const ParamDef<float> kZMax{"zmax", kInfinity, "the part above this z is cut away; default: radius"};

/// By how much rays miss the sphere, which is positive for those that surely do: what `Sphere::intersect`
/// does before it knows where the hit is. Roots are compared with a margin, since here they are less exact.
STROBE_LANES void missesOfSphere(double radius, const QuadricRays& rays, float* miss) {
    STROBE_INDEPENDENT
    for (int i = 0; i < rays.n; ++i) {
        const double ox = rays.ox[i], oy = rays.oy[i], oz = rays.oz[i];
        const double dx = rays.dx[i], dy = rays.dy[i], dz = rays.dz[i];
        const double inverse = 1 / (dx * dx + dy * dy + dz * dz);
        const double middle = -(ox * dx + oy * dy + oz * dz) * inverse;
        const double x = ox + dx * middle, y = oy + dy * middle, z = oz + dz * middle;
        const double discriminant = (radius * radius - (x * x + y * y + z * z)) * inverse;
        const double half = std::sqrt(std::max(discriminant, 0.)), margin = 1e-6 * (std::abs(middle) + half);
        const double apart = std::max(middle - half - rays.tmax[i], rays.tmin[i] - middle - half) - margin;
        miss[i] = float(discriminant < 0 ? 1. : apart);
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
        // In double: float loses the hit of a small sphere far away. The discriminant is that of the point
        // of closest approach, which does not cancel (Haines et al. 2019, "Precision Improvements for
        // Ray/Sphere Intersection").
        const V3d origin(o), direction(d);
        const double dd = direction.dot(direction);
        if (!(dd > 0))
            return false;
        const double inverse = 1 / dd, middle = -origin.dot(direction) * inverse;
        const V3d nearest = origin + direction * middle;
        const double discriminant = (m_radius * m_radius - nearest.dot(nearest)) * inverse;
        if (!(discriminant >= 0))
            return false;
        const double half = std::sqrt(discriminant), margin = 1e-6 * (std::abs(middle) + half);
        if (middle - half > tmax + margin || middle + half < tmin - margin)
            return false;
        // The root farther from 0 is exact; the other follows from their product.
        const double far = middle + std::copysign(half, middle);
        const double product = (origin.dot(origin) - m_radius * m_radius) * inverse;
        const double other = far != 0 ? product / far : 0;
        for (const double root : {std::min(far, other), std::max(far, other)}) {
            const auto candidate = static_cast<float>(root);
            if (candidate > tmin && candidate < tmax && parametrise(origin + direction * root, u, v)) {
                t = candidate;
                return true;
            }
        }
        return false;
    }

    void leaveOutMisses(const QuadricRays& rays, int32_t* may) const override {
        alignas(64) float miss[QuadricRays::kMost];
        missesOfSphere(m_radius, rays, miss);
        for (int i = 0; i < rays.n; ++i)
            may[i] = miss[i] > 0 ? 0 : may[i];
    }

    QuadricPoint point(float u, float v) const override {
        const double theta = m_thetaMin + v * (m_thetaMax - m_thetaMin);
        const V2d polar = unitVector(theta);
        return at({u, v}, polar.x, polar.y);
    }

    float area() const override { return static_cast<float>(m_phiMax * m_radius * (m_zMax - m_zMin)); }

    QuadricPoint samplePoint(const V2f& u) const override {
        // Equal slices in z have equal areas (Archimedes).
        const double cosTheta = (m_zMin + u.x * (m_zMax - m_zMin)) / m_radius;
        const double sinTheta = std::sqrt(std::max(0., 1 - cosTheta * cosTheta));
        return at({u.y, alongTheta(fastAtan2(float(sinTheta), float(cosTheta)))}, cosTheta, sinTheta);
    }

    float wholeSphereRadius() const override {
        const bool whole = m_phiMax >= kTwoPi && m_zMin <= -m_radius && m_zMax >= m_radius;
        return whole ? static_cast<float>(m_radius) : 0;
    }

  private:
    /// The uv of a point on the sphere; false where the sphere is cut away.
    bool parametrise(const V3d& p, float& u, float& v) const {
        // Whole ends are not compared with: rounding must not open holes at the poles.
        if ((m_zMin > -m_radius && p.z < m_zMin) || (m_zMax < m_radius && p.z > m_zMax))
            return false;
        const float phi = azimuth(float(p.x), float(p.y));
        if (m_phiMax < kTwoPi && phi > m_phiMax)
            return false;
        u = std::min(static_cast<float>(phi * m_perPhi), 1.f);
        v = std::clamp(alongTheta(fastAtan2(float(std::sqrt(p.x * p.x + p.y * p.y)), float(p.z))), 0.f, 1.f);
        return true;
    }
    float alongTheta(double theta) const { return static_cast<float>((theta - m_thetaMin) * m_perTheta); }

    QuadricPoint at(const V2f& uv, double cosTheta, double sinTheta) const {
        const V2d phi = unitVector(uv.x * m_phiMax);
        const double cosPhi = phi.x, sinPhi = phi.y;
        const V3d n(cosPhi * sinTheta, sinPhi * sinTheta, cosTheta);
        const double thetaSpan = m_thetaMax - m_thetaMin;
        QuadricPoint q;
        q.n = V3f(n);
        q.p = V3f(n * m_radius);
        // Not zero at the poles, where only the direction is wanted.
        q.dpdu = V3f(V3d(-sinPhi, cosPhi, 0) * (m_phiMax * m_radius * std::max(sinTheta, kPoleRadius)));
        q.dpdv = V3f(V3d(cosPhi * cosTheta, sinPhi * cosTheta, -sinTheta) * (m_radius * thetaSpan));
        q.uv = uv;
        return q;
    }

    double m_radius, m_phiMax, m_zMin, m_zMax, m_thetaMin, m_thetaMax;
    double m_perPhi, m_perTheta; ///< of u and of v
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
