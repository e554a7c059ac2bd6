#include "integrators/msaa_cache.h"

#include "integrators/cache_settings.h"

namespace strobe {

namespace {

const ParamDef<float> kBlockSize{"blocksize", 1,
                                 "distance of shading points in pixels; 0: every sample shades for itself",
                                 nullptr, kNotNegative};
const ParamDef<int> kShades{"shades", 1, "shades per point or block", nullptr, kAtLeastOne};
const ParamDef<int> kTimeBins{
    "timebins", 0,
    "parts of the shutter that are shaded apart; 0: 4 if anything moves (scope shared), else 1", nullptr,
    kNotNegative};
const ParamDef<std::string> kInterpolate{"interpolate", "lattice",
                                         "lattice: between the points around; nearest: the nearest"};
const ParamDef<std::string> kScope{"scope", "shared",
                                   "shared: one cache, whose blocks depend on their key alone; the paper's, "
                                   "decided by the first ray: thread, "
                                   "mutex, tile"};
/// Measured on moving scenes (docs/results): with fewer, what a moving thing covers now and then is shaded
/// while it is covered; more take time and change little.
constexpr int kTimeBinsOfMotion = 4;
class MsaaCache : public Integrator {
  public:
    explicit MsaaCache(const ParamSet& params) : m_size(params) {
        using Scope = CacheSettings::Scope;
        const Scope scope = oneOf<Scope>(params, kScope,
                                         {{"shared", Scope::Shared},
                                          {"thread", Scope::Thread},
                                          {"mutex", Scope::Mutex},
                                          {"tile", Scope::Tile}});
        const bool nearest = oneOf<bool>(params, kInterpolate, {{"lattice", false}, {"nearest", true}});
        m_settings = {
            scope, params.get(kBlockSize), params.get(kShades), params.get(kTimeBins), nearest, m_size.bytes};
    }

    SampleDependence dependence() const override {
        return isShared() || m_settings.blockSize == 0 ? SampleDependence::None : SampleDependence::Render;
    }

    BiasBound biasBound(const Scene& scene) const override {
        if (m_settings.blockSize == 0)
            return {};
        const float blocks = isShared() ? SurfaceLattice::kReach : kFirstRayReach;
        return {blocks * m_settings.blockSize, scene.moves() ? 1 / float(binsFor(scene)) : 0};
    }

    bool needsShadeCost(const RenderContext&) const override {
        return m_settings.blockSize > 0 && (m_size.automatic || (isShared() && m_settings.bytes == SIZE_MAX));
    }

    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext& context) const override {
        CacheSettings settings = m_settings;
        settings.timeBins = binsFor(scene);
        settings.lightComponents = context.lightComponents;
        if (!isShared() && context.lightComponents > 0)
            throw Error("the caches of scope thread, mutex and tile hold no parts of light: layers of direct "
                        "light, indirect light and light groups need another scope or integrator",
                        ErrorKind::Usage);
        if (needsShadeCost(context))
            settings.bytes = automaticBytes(context, settings.blockSize, settings.timeBins,
                                            isShared() && context.lightComponents == 0);
        else if (m_size.automatic)
            settings.bytes = 0;
        return isShared() ? beginLatticeSharing(scene, settings, context.seed)
                          : beginFirstRaySharing(scene, settings);
    }

  private:
    bool isShared() const { return m_settings.scope == CacheSettings::Scope::Shared; }
    int binsFor(const Scene& scene) const {
        if (m_settings.timeBins > 0)
            return m_settings.timeBins;
        return isShared() && scene.moves() ? kTimeBinsOfMotion : 1;
    }
    CacheSize m_size;
    CacheSettings m_settings; ///< timeBins 0: by the scene
};

} // namespace

IntegratorPlugin msaaCachePlugin() {
    return {"msaa-cache",
            "samples of any pixel and time share the shading points around them; biased by the block's size",
            {kBlockSize, kShades, kTimeBins, kInterpolate, kScope, CacheSize::kParam},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const MsaaCache>(params);
            }};
}

} // namespace strobe
