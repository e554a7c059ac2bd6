#include "shapes/disk.h"

#include "core/math/fast_math.h"
#include "shapes/quadric_params.h"

namespace strobe {
namespace {

const ParamDef<float> kHeight{"height", 0, "z coordinate of the disk"};
const ParamDef<float> kRadius{"radius", 1, "positive outer radius"};
const ParamDef<float> kInnerRadius{"innerradius", 0,
                                   "radius of the hole, 0 (no hole) to less than \"radius\""};

/// Samples an annulus uniformly by area.
struct AnnulusSampler {
    float height;
    float inner2, width2; ///< squared inner radius; difference of the squared radii
    float turns;          ///< sweep in full turns

    STROBE_FORCE_INLINE V3f sample(const V2f& u) const {
        const float r = std::sqrt(inner2 + u.x * width2);
        const SinCos phi = sinCosOfTurns(u.y * turns);
        return {r * phi.cos, r * phi.sin, height};
    }
};

STROBE_TARGET_CLONES void sampleAnnulus(const AnnulusSampler& sampler, const V2SoA& u, int n, V3SoA& p,
                                        V3SoA& normal) {
    const AnnulusSampler s = sampler;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const V3f q = s.sample(u.at(i));
        p.x[i] = q.x;
        p.y[i] = q.y;
        p.z[i] = q.z;
        normal.x[i] = 0;
        normal.y[i] = 0;
        normal.z[i] = 1;
    }
}

class Disk : public Quadric {
  public:
    explicit Disk(const ParamSet& params)
        : m_height(params.get(kHeight)), m_radius(positive(params, kRadius)),
          m_inner(params.get(kInnerRadius)), m_phiMax(sweep(params)) {
        if (!std::isfinite(m_height))
            throw Error(params.whereIs(kHeight), "\"height\" must be finite");
        if (!(m_inner >= 0 && m_inner < m_radius))
            throw Error(params.whereIs(kInnerRadius),
                        "\"innerradius\" must be at least 0 and less than \"radius\"");
    }

    Box3f bounds() const override {
        const auto r = static_cast<float>(m_radius), z = static_cast<float>(m_height);
        return {{-r, -r, z}, {r, r, z}};
    }

    bool intersect(const V3f& o, const V3f& d, float tmin, float tmax, float& t, float& u,
                   float& v) const override {
        if (d.z == 0)
            return false;
        const double tExact = (m_height - o.z) / d.z;
        const auto tHit = static_cast<float>(tExact);
        if (!(tHit > tmin && tHit < tmax))
            return false;
        const double x = o.x + tExact * d.x, y = o.y + tExact * d.y;
        const double r = std::sqrt(x * x + y * y), phi = azimuth(float(x), float(y));
        if (!(r <= m_radius && r >= m_inner && (phi <= m_phiMax || m_phiMax >= kTwoPi)))
            return false;
        t = tHit;
        u = std::min(static_cast<float>(phi / m_phiMax), 1.f);
        v = static_cast<float>((m_radius - r) / (m_radius - m_inner));
        return true;
    }

    QuadricPoint point(float u, float v) const override {
        return pointAt(u, m_radius - v * (m_radius - m_inner));
    }

    float area() const override {
        return static_cast<float>(m_phiMax / 2 * (m_radius * m_radius - m_inner * m_inner));
    }

    QuadricPoint samplePoint(const V2f& u) const override {
        const AnnulusSampler s = sampler();
        QuadricPoint q = pointAt(u.y, std::sqrt(double(s.inner2 + u.x * s.width2)));
        q.p = s.sample(u);
        return q;
    }
    void samplePointSoA(const V2SoA& u, int n, V3SoA& p, V3SoA& normal) const override {
        sampleAnnulus(sampler(), u, n, p, normal);
    }

  private:
    AnnulusSampler sampler() const {
        return {float(m_height), float(m_inner * m_inner), float(m_radius * m_radius - m_inner * m_inner),
                float(m_phiMax / kTwoPi)};
    }
    /// Returns the point at parameter u and radius r.
    QuadricPoint pointAt(float u, double r) const {
        const double width = m_radius - m_inner;
        const V2d phi = unitVector(u * m_phiMax);
        const V3d outward(phi.x, phi.y, 0);
        QuadricPoint q;
        q.p = V3f(outward * r + V3d(0, 0, m_height));
        q.n = {0, 0, 1};
        // The minimum radius keeps the direction of dp/du at the center.
        q.dpdu = V3f(V3d(-outward.y, outward.x, 0) * (m_phiMax * std::max(r, kPoleRadius * m_radius)));
        q.dpdv = V3f(outward * -width);
        q.uv = {u, static_cast<float>((m_radius - r) / width)};
        return q;
    }

    double m_height, m_radius, m_inner, m_phiMax;
};

Shape createDisk(const ParamSet& params, const BuildContext&) {
    return {nullptr, std::make_shared<Disk>(params)};
}

} // namespace

Plugin<Shape> diskPlugin() {
    return {"disk",
            "disk, annulus or sector with normal +z",
            {kHeight, kRadius, kInnerRadius, kPhiMax},
            createDisk};
}

} // namespace strobe
