#include "shading/path_shader.h"

#include "shading/path_worker.h"

namespace strobe {

namespace {

/// A bound, since among perfect mirrors Russian roulette ends no path.
constexpr int kMaxDepthAllowed = 1024;
const ParamDef<int> kMaxDepth{"maxdepth",
                              5,
                              "surfaces along a path; direct lighting: mirror and glass bounces + 1",
                              nullptr,
                              {0, kMaxDepthAllowed}};
const ParamDef<std::string> kStrategy{
    "strategy", "all", "lights at the first surface: all (each with its nsamples) or one, picked by power",
    "lightsamplestrategy"};
const ParamDef<int> kLightSamples{"lightsamples",
                                  0,
                                  "samples of each light at a surface; 0: each light's own nsamples",
                                  nullptr,
                                  {0, kMaxLightSamples}};

/// Whether all lights are sampled at the first surface. pbrt-v3's and v4's names for ways to pick one mean
/// "one", and so does what nobody knows in a lenient file.
bool readStrategy(const ParamSet& params, const BuildContext& context) {
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

class PathShader : public Shader {
  public:
    PathShader(const ParamSet& params, const BuildContext& context, bool path) {
        m_settings = {path, params.get(kMaxDepth), readStrategy(params, context), params.get(kLightSamples)};
    }
    std::unique_ptr<ShaderWorker> makeWorker(const Scene& scene, const Sampler& sampler,
                                             const LightComponents& lightComponents) const override {
        return std::make_unique<PathWorker>(scene, sampler, m_settings, lightComponents);
    }
    bool hasIndirectLight() const override { return m_settings.path && m_settings.maxDepth > 1; }

  private:
    ShadeSettings m_settings;
};

ShaderPlugin plugin(const char* name, const char* doc, bool path) {
    return {name,
            doc,
            {kMaxDepth, kStrategy, kLightSamples},
            [path](const ParamSet& params, const BuildContext& context) {
                return std::make_shared<const PathShader>(params, context, path);
            }};
}

} // namespace

ShaderPlugin directLightingPlugin() {
    return plugin("directlighting", "direct light at the first surface, through mirrors and glass", false);
}

ShaderPlugin pathPlugin() {
    return plugin("path", "path tracing: direct light at up to maxdepth surfaces, Russian roulette", true);
}

} // namespace strobe
