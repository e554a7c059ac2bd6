// Making materials from parameters, and the statistics that check them.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"

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

/// A material at a point without textures.
inline Bsdf prepared(const Material& material) {
    Bsdf bsdf;
    bsdf.material = &material;
    material.prepare({}, bsdf);
    return bsdf;
}

/// Deterministic random numbers.
class Random {
  public:
    explicit Random(uint32_t seed) : m_engine(seed) {}
    float next() { return float(m_engine() >> 8) * 0x1p-24f; }
    V2f next2() {
        const float x = next();
        return {x, next()};
    }
    /// Uniform on the sphere.
    V3f direction();

  private:
    std::mt19937 m_engine;
};

struct NamedMaterial {
    std::string name;
    MaterialPtr material;
    bool conservesEnergy = true; ///< its parameters are physically meaningful
    bool isSharp = false;        ///< its lobe is only a few degrees wide
};

/// Every smooth material, with ordinary and extreme parameters.
std::vector<NamedMaterial> smoothMaterials();

/// Viewing directions: normal, oblique, grazing, and on the other side.
std::vector<V3f> viewDirections();

/// What a quadrature over the bins of the sphere finds: bins are equal in cos θ and φ.
struct Integrals {
    static constexpr int kRows = 16, kColumns = 24;
    std::vector<double> pdf; ///< per bin
    double pdfTotal = 0;
    double albedo = 0; ///< of the green channel
    static int binOf(const V3f& w);
};
Integrals integrate(const Material& material, const Bsdf& bsdf, const V3f& wo);

/// The probability that a chi-square variable of `degrees` degrees of freedom exceeds `x`.
double chiSquareTail(double x, double degrees);

/// The level of each of `tests` tests so that all together err with probability `alpha` (Šidák).
double sidakLevel(double alpha, int tests);

} // namespace strobe::test
