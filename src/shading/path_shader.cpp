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
    "strategy", "all",
    "lights at the first non-specular vertex: all (each with its nsamples) or one, chosen by power",
    "lightsamplestrategy"};
const ParamDef<int> kLightSamples{"lightsamples",
                                  0,
                                  "samples per light and vertex; 0: each light's own nsamples",
                                  nullptr,
                                  {0, kMaxLightSamples}};

/// Returns true when all lights are sampled at the first non-specular vertex. The names of pbrt-v3 and
/// pbrt-v4 for ways to choose one light mean "one". Throws Error if the strategy is unknown; in a lenient
/// file, warns and takes "one".
bool samplesAllLights(const ParamSet& params, const BuildContext& context) {
    const std::string strategy = params.get(kStrategy);
    for (const char* one : {"one", "power", "uniform", "spatial", "bvh", "exhaustive"})
        if (strategy == one)
            return false;
    if (strategy == "all" || strategy == "weighted")
        return true;
    const std::string must = "\"strategy\" must be \"all\" or \"one\", not \"" + strategy + "\"";
    if (!context.isLenient)
        throw Error(params.whereIs(kStrategy), must);
    context.diagnostics.warn(params.whereIs(kStrategy), must + "; \"one\" takes its place");
    return false;
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
        m_settings = {hasIndirectLight, params.get(kMaxDepth), samplesAllLights(params, context),
                      params.get(kLightSamples), params.get(kTransparentDepth)};
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
            {kMaxDepth, kStrategy, kLightSamples, kTransparentDepth},
            [hasIndirectLight](const ParamSet& params, const BuildContext& context) {
                return std::make_shared<const PathShader>(params, context, hasIndirectLight);
            }};
}

} // namespace

ShaderPlugin directLightingPlugin() {
    return plugin("directlighting", "direct light at the first non-specular vertex", false);
}

ShaderPlugin pathPlugin() {
    return plugin("path", "path tracing: direct light at up to maxdepth vertices, Russian roulette", true);
}

} // namespace strobe
