// Creation of materials from parameters, and the statistics that check them.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"
#include "support/chi_square.h"

#include <functional>
#include <random>
#include <string>
#include <vector>

namespace strobe::test {

using MaterialPtr = std::shared_ptr<const Material>;
using MaterialPlugin = Plugin<MaterialPtr>;

inline Param floatParam(const std::string& name, float value) {
    return {name, ParamType::Float, {}, {value}, {}, {}};
}
inline Param rgbParam(const std::string& name, const Rgb& c) {
    return {name, ParamType::Rgb, {}, {c.x, c.y, c.z}, {}, {}};
}
inline Param stringParam(const std::string& name, const std::string& value) {
    return {name, ParamType::String, {}, {}, {}, {value}};
}

MaterialPtr makeMaterial(const MaterialPlugin& plugin, const std::vector<Param>& params,
                         Conventions conventions = Conventions::PbrtV4);
/// Creates a material whose parameters `names` are the first texture of the table.
MaterialPtr texturedMaterial(const MaterialPlugin& plugin, const std::vector<std::string>& names,
                             const std::shared_ptr<const TextureTable>& table);

/// Returns the Bsdf of a material without textures.
inline Bsdf prepared(const Material& material) {
    Bsdf bsdf;
    bsdf.material = &material;
    material.prepare({}, bsdf);
    return bsdf;
}

/// A random number generator with a fixed seed.
class Random {
  public:
    explicit Random(uint32_t seed) : m_engine(seed) {}
    float next() { return float(m_engine() >> 8) * 0x1p-24f; }
    V2f next2() {
        const float x = next();
        return {x, next()};
    }
    /// Returns a direction, uniform over the sphere.
    V3f direction();

  private:
    std::mt19937 m_engine;
};

struct NamedMaterial {
    std::string name;
    MaterialPtr material;
    bool conservesEnergy = true; ///< the parameters are physically plausible
    bool isSharp = false;        ///< the lobe is only a few degrees wide
    bool isTwoSided = true;      ///< both sides are alike
    bool hasTightBound = true;   ///< no lobe has its maximum below the horizon
};

/// Returns every smooth material with ordinary and extreme parameters.
std::vector<NamedMaterial> smoothMaterials();

/// Returns viewing directions: normal, oblique, grazing, and below the surface.
std::vector<V3f> viewDirections();

/// Integrals of the pdf and of f |cos wi| by quadrature over bins of the sphere that are equidistant in cos θ
/// and φ.
struct Integrals {
    static constexpr int kRows = 16, kColumns = 24;
    std::vector<double> pdf; ///< per bin
    double pdfTotal = 0;
    double albedo = 0; ///< of the green channel
    static int binOf(const V3f& w);
};
Integrals integrate(const Material& material, const Bsdf& bsdf, const V3f& wo);

/// Returns the significance level of each of `tests` independent tests for which the probability of any false
/// rejection is `alpha` (Šidák).
double sidakLevel(double alpha, int tests);

} // namespace strobe::test
