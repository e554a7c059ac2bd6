#include "materials/mix.h"

#include "core/math/hash.h"

#include <bit>

namespace strobe {
namespace {

class Mix final : public Material {
  public:
    Mix(std::shared_ptr<const Material> first, std::shared_ptr<const Material> second, FloatInput amount,
        uint32_t salt)
        : Material(flagsOf(first->flags(), second->flags(), amount)), m_first(std::move(first)),
          m_second(std::move(second)), m_amount(std::move(amount)), m_salt(salt) {}

    const Material& chosen(const TextureQuery& q) const override {
        const auto bits = [](float x) { return std::bit_cast<uint32_t>(x); };
        const uint64_t hash = fastHashOf(bits(q.p.x), bits(q.p.y), bits(q.p.z), m_salt);
        const bool isSecond = unitFloat(uint32_t(hash >> 32)) < m_amount.at(q);
        return (isSecond ? m_second : m_first)->chosen(q);
    }

    // Not called by the renderer, which calls those of the chosen material.
    void prepare(const TextureQuery& q, Bsdf& bsdf) const override { m_first->prepare(q, bsdf); }
    void evalCos(const Bsdf& bsdf, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const override {
        m_first->evalCos(bsdf, wo, wi, n, f, pdf);
    }
    bool sample(const Bsdf& bsdf, const V3f& wo, float uc, const V2f& u, BsdfSample& out) const override {
        return m_first->sample(bsdf, wo, uc, u, out);
    }
    float maxPdf(const Bsdf& bsdf, const V3f& wo) const override { return m_first->maxPdf(bsdf, wo); }

  private:
    static MaterialFlags flagsOf(const MaterialFlags& a, const MaterialFlags& b, const FloatInput& amount) {
        MaterialFlags flags;
        flags.isMix = true;
        flags.smooth = a.smooth || b.smooth;
        flags.delta = flags.smooth && (a.delta || b.delta || !a.smooth || !b.smooth);
        flags.diffuse = a.diffuse && b.diffuse;
        flags.textured = true; // the choice modulates the reflection
        flags.transmissive = a.transmissive || b.transmissive;
        flags.needsFootprint = a.needsFootprint || b.needsFootprint || amount.needsFootprint();
        return flags;
    }
    std::shared_ptr<const Material> m_first, m_second;
    FloatInput m_amount;
    uint32_t m_salt;
};

} // namespace

std::shared_ptr<const Material> makeMix(std::shared_ptr<const Material> first,
                                        std::shared_ptr<const Material> second, FloatInput amount,
                                        uint32_t salt) {
    return std::make_shared<const Mix>(std::move(first), std::move(second), std::move(amount), salt);
}

} // namespace strobe
