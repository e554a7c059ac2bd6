#include "materials/normals.h"

namespace strobe {
namespace {

class NormalMap final : public Normals {
  public:
    NormalMap(std::shared_ptr<const Texture> map, float scale) : m_map(std::move(map)), m_scale(scale) {}
    V3f normal(const TextureQuery& q, const TangentFrame& frame) const override {
        const Rgb c = m_map->rgb(q) * 2 - Rgb(1);
        const V3f n = frame.n, t = normalize(frame.dpdu - n * dot(n, frame.dpdu)), b = cross(n, t);
        const float x = c.x * m_scale, y = c.y * m_scale;
        return t * x + b * std::copysign(y, y * dot(b, frame.dpdv)) + n * c.z;
    }
    bool needsFootprint() const override { return m_map->needsFootprint(); }

  private:
    std::shared_ptr<const Texture> m_map;
    float m_scale;
};

class BumpMap final : public Normals {
  public:
    BumpMap(FloatInput displacement, BumpTangents tangents)
        : m_displacement(std::move(displacement)), m_tangents(tangents) {}

    V3f normal(const TextureQuery& q, const TangentFrame& frame) const override {
        V3f dpdu, dpdv;
        tangentsAt(frame, dpdu, dpdv);
        const float height = m_displacement.at(q);
        const V2f du(stepOf(q.duvdx.x, q.duvdy.x), 0), dv(0, stepOf(q.duvdx.y, q.duvdy.y));
        const float alongU = (m_displacement.at(shifted(q, du, dpdu * du.x)) - height) / du.x;
        const float alongV = (m_displacement.at(shifted(q, dv, dpdv * dv.y)) - height) / dv.y;
        const V3f n = cross(dpdu + frame.n * alongU, dpdv + frame.n * alongV);
        return dot(n, frame.n) < 0 ? -n : n;
    }
    bool needsFootprint() const override { return true; }

  private:
    /// Returns the distance in u or v of the second evaluation, given the axes of the footprint.
    static float stepOf(float x, float y) {
        constexpr float kWithoutFootprint = 0.0005f;
        const float step = (std::abs(x) + std::abs(y)) / 2;
        return step > 0 ? step : kWithoutFootprint;
    }
    static TextureQuery shifted(TextureQuery q, const V2f& duv, const V3f& dp) {
        q.uv += duv;
        q.p += dp;
        return q;
    }
    void tangentsAt(const TangentFrame& frame, V3f& dpdu, V3f& dpdv) const {
        const V3f n = frame.n;
        dpdu = frame.dpdu;
        dpdv = frame.dpdv;
        if (!(length2(cross(dpdu, dpdv)) > 0)) { // no texture coordinates
            const Frame any = Frame::fromNormal(n);
            dpdu = any.s;
            dpdv = any.t;
        } else if (frame.hasVertexNormals) {
            const float length = m_tangents == BumpTangents::Unit ? 1 : std::sqrt(length2(dpdu));
            const float side = dot(cross(n, dpdu), dpdv) < 0 ? -1.f : 1.f;
            const float lengthV = m_tangents == BumpTangents::Exact ? std::sqrt(length2(dpdv)) : length;
            dpdu = normalizeAny(dpdu - n * dot(n, dpdu)) * length;
            dpdv = m_tangents == BumpTangents::Exact ? normalizeAny(dpdv - n * dot(n, dpdv)) * lengthV
                                                     : normalizeAny(cross(n, dpdu)) * (side * lengthV);
        }
    }
    FloatInput m_displacement;
    BumpTangents m_tangents;
};

/// Forwards everything but the shading normal to another material.
class MaterialWithNormals final : public Material {
  public:
    MaterialWithNormals(std::shared_ptr<const Material> base, NormalsPtr normals)
        : Material(flagsOf(*base, *normals)), m_base(std::move(base)), m_normals(std::move(normals)) {}

    void prepare(const TextureQuery& q, Bsdf& bsdf) const override { m_base->prepare(q, bsdf); }
    void prepareSoA(const TextureQuerySoA& q, int begin, int end, Bsdf* bsdf) const override {
        m_base->prepareSoA(q, begin, end, bsdf);
    }
    void evalCos(const Bsdf& bsdf, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const override {
        m_base->evalCos(bsdf, wo, wi, n, f, pdf);
    }
    void evalCosSoA(const BsdfQuerySoA& query, const V3SoA& wi, RgbSoA& f, float* pdf) const override {
        m_base->evalCosSoA(query, wi, f, pdf);
    }
    bool sample(const Bsdf& bsdf, const V3f& wo, float uc, const V2f& u, BsdfSample& out) const override {
        return m_base->sample(bsdf, wo, uc, u, out);
    }
    void sampleSoA(const BsdfQuerySoA& query, const float* uc, const V2SoA& u,
                   BsdfSampleSoA& out) const override {
        m_base->sampleSoA(query, uc, u, out);
    }
    void sampleDirectionSoA(const BsdfQuerySoA& query, const float* uc, const V2SoA& u,
                            BsdfSampleSoA& out) const override {
        m_base->sampleDirectionSoA(query, uc, u, out);
    }
    float maxPdf(const Bsdf& bsdf, const V3f& wo) const override { return m_base->maxPdf(bsdf, wo); }
    void maxPdfSoA(const BsdfQuerySoA& query, float* out) const override { m_base->maxPdfSoA(query, out); }
    bool isSpecular(const Bsdf& bsdf) const override { return m_base->isSpecular(bsdf); }
    Rgb albedo(const Bsdf& bsdf) const override { return m_base->albedo(bsdf); }
    Rgb reflectance(const Bsdf& bsdf, const V3f& wo) const override { return m_base->reflectance(bsdf, wo); }
    V3f mappedNormal(const TextureQuery& q, const TangentFrame& frame) const override {
        return m_normals->normal(q, frame);
    }

  private:
    static MaterialFlags flagsOf(const Material& base, const Normals& normals) {
        MaterialFlags flags = base.flags();
        flags.needsFootprint |= normals.needsFootprint();
        flags.shadingNormal = ShadingNormal::Mapped;
        return flags;
    }
    std::shared_ptr<const Material> m_base;
    NormalsPtr m_normals;
};

} // namespace

NormalsPtr makeNormalMap(std::shared_ptr<const Texture> map, float scale) {
    return std::make_shared<const NormalMap>(std::move(map), scale);
}

NormalsPtr makeBumpMap(FloatInput displacement, BumpTangents tangents) {
    return std::make_shared<const BumpMap>(std::move(displacement), tangents);
}

std::shared_ptr<const Material> withNormals(std::shared_ptr<const Material> material, NormalsPtr normals) {
    return std::make_shared<const MaterialWithNormals>(std::move(material), std::move(normals));
}

} // namespace strobe
