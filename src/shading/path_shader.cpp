#include "shading/path_shader.h"

#include "shading/path_worker.h"

namespace strobe {

namespace {

/// The largest `maxdepth`: between perfect mirrors Russian roulette ends almost no path.
constexpr int kMaxDepthLimit = 1024;
const ParamDef<int> kMaxDepth{"maxdepth",
                              5,
                              "maximum number of vertices of a path; directlighting: of specular bounces + 1",
                              nullptr,
                              {0, kMaxDepthLimit}};
const ParamDef<std::string> kStrategy{
    "strategy", "auto",
    "lights that a vertex samples. all: each light at the first non-specular vertex (with its nsamples), one "
    "by power later; one, power: one by power; uniform: one, equally likely; tree, bvh, spatial: by the "
    "light "
    "tree; exhaustive: as tree, but without a tree; auto: all up to 128 lights, else tree",
    "lightsamplestrategy"};
const ParamDef<std::string> kLightSampler{"lightsampler", "", "name of strategy in pbrt-v4"};
const ParamDef<int> kLightSamples{"lightsamples",
                                  0,
                                  "all: samples per light and vertex, 0: each light's own nsamples; tree: "
                                  "samples at the first non-specular "
                                  "vertex, 0: 4",
                                  nullptr,
                                  {0, kMaxLightSamples}};
const ParamDef<std::string> kLightMotion{
    "lightmotion", "split",
    "bounds of moving lights in the light tree: swept (over the shutter), linear (moving), or split (moving, "
    "with trees of their own for intervals of the shutter)"};

/// A name of a strategy.
struct StrategyName {
    const char* name;
    LightStrategy strategy;
    bool isExhaustive = false;
};
/// The names of strobe, pbrt-v2, v3 and v4. pbrt-v3's "spatial" chooses by irradiance in cells of space; the
/// tree does so at each point.
constexpr StrategyName kStrategyNames[] = {
    {"auto", LightStrategy::Auto},    {"all", LightStrategy::All},
    {"weighted", LightStrategy::All}, {"one", LightStrategy::Power},
    {"power", LightStrategy::Power},  {"uniform", LightStrategy::Uniform},
    {"tree", LightStrategy::Tree},    {"bvh", LightStrategy::Tree},
    {"spatial", LightStrategy::Tree}, {"exhaustive", LightStrategy::Tree, true}};

/// Reads the strategy into `settings`. Throws Error if it is unknown; in a lenient file, warns and takes
/// "auto".
void readStrategy(const ParamSet& params, const BuildContext& context, PathSettings& settings) {
    const ParamDef<std::string>& def = params.has(kStrategy) ? kStrategy : kLightSampler;
    const std::string name = params.has(def) ? params.get(def) : kStrategy.fallback;
    for (const StrategyName& known : kStrategyNames)
        if (name == known.name) {
            settings.strategy = known.strategy;
            settings.tree.isExhaustive = known.isExhaustive;
            return;
        }
    std::string must = std::string("\"") + def.name + "\" must be ";
    for (const StrategyName& known : kStrategyNames)
        must += std::string(&known == kStrategyNames ? "\"" : ", \"") + known.name + "\"";
    must += "; not \"" + name + "\"";
    if (!context.isLenient)
        throw Error(params.whereIs(def), must);
    context.diagnostics.warn(params.whereIs(def), must + "; \"auto\" takes its place");
}

const ParamDef<int> kTransparentDepth{"transparentdepth",
                                      0,
                                      "vertices where a path passes a transmissive surface, and that do not "
                                      "count for maxdepth; scenes with glTF "
                                      "files: 16",
                                      nullptr,
                                      {0, kMaxDepthLimit}};

class PathShader : public Shader {
  public:
    PathShader(const ParamSet& params, const BuildContext& context, bool hasIndirectLight) {
        m_settings.hasIndirectLight = hasIndirectLight;
        m_settings.maxDepth = params.get(kMaxDepth);
        m_settings.lightSamples = params.get(kLightSamples);
        m_settings.transparentDepth = params.get(kTransparentDepth);
        readStrategy(params, context, m_settings);
        m_settings.tree.motion = parseWord<LightMotion>(
            params, kLightMotion,
            {{"swept", LightMotion::Swept}, {"linear", LightMotion::Linear}, {"split", LightMotion::Split}});
    }
    std::unique_ptr<ShaderWorker> makeWorker(const Scene& scene, const Sampler& sampler,
                                             const LightComponents& lightComponents) const override {
        return std::make_unique<PathWorker>(scene, sampler, m_settings, lightComponents);
    }
    bool hasIndirectLight() const override { return m_settings.hasIndirectLight && m_settings.maxDepth > 1; }

  private:
    PathSettings m_settings;
};

ShaderPlugin plugin(const char* name, const char* doc, bool hasIndirectLight) {
    return {name,
            doc,
            {kMaxDepth, kStrategy, kLightSampler, kLightSamples, kLightMotion, kTransparentDepth},
            [hasIndirectLight](const ParamSet& params, const BuildContext& context) {
                return std::make_shared<const PathShader>(params, context, hasIndirectLight);
            }};
}

} // namespace

ShaderPlugin directLightingPlugin() {
    return plugin("directlighting",
                  "direct light at the first non-specular vertex, and what its delta lobes show", false);
}

ShaderPlugin pathPlugin() {
    return plugin("path", "path tracing: direct light at up to maxdepth vertices, Russian roulette", true);
}

} // namespace strobe
