#include "integrators/msaa_cache.h"

#include "integrators/cache_size.h"
#include "integrators/sharing_settings.h"

namespace strobe {

namespace {

const ParamDef<float> kBlockSize{"blocksize", 1,
                                 "spacing of the shading points, in pixels; 0: one shade per sample", nullptr,
                                 kNotNegative};
const ParamDef<int> kShades{"shades", 1, "shades per shading point or block", nullptr, kAtLeastOne};
const ParamDef<int> kTimeBins{"timebins", 0,
                              "number of intervals of the shutter that do not share shades; 0: 4 if anything "
                              "moves (scope shared), else 1",
                              nullptr, kNotNegative};
const ParamDef<std::string> kInterpolate{
    "interpolate", "lattice",
    "lattice: weighted mean of the surrounding points or blocks; nearest: the nearest of them"};
const ParamDef<std::string> kScope{
    "scope", "shared",
    "shared: one cache, whose values do not depend on the order of rendering; thread, mutex, tile: the "
    "paper's caches per thread, behind a mutex or per tile, of blocks that the first rays shade"};

/// Measured on moving scenes (docs/results): with fewer time bins, surfaces that are covered for a part of
/// the shutter are shaded while they are covered; more bins take more time and change little.
constexpr int kTimeBinsOfMotion = 4;

class MsaaCache : public Integrator {
  public:
    explicit MsaaCache(const ParamSet& params) : m_size(params) {
        using Scope = SharingSettings::Scope;
        m_settings.scope = parseWord<Scope>(params, kScope,
                                            {{"shared", Scope::Shared},
                                             {"thread", Scope::Thread},
                                             {"mutex", Scope::Mutex},
                                             {"tile", Scope::Tile}});
        m_settings.nearest = parseWord<bool>(params, kInterpolate, {{"lattice", false}, {"nearest", true}});
        m_settings.blockSize = params.get(kBlockSize);
        m_settings.shades = params.get(kShades);
        m_settings.timeBins = params.get(kTimeBins);
        m_settings.cacheBytes = m_size.bytes;
    }

    SampleDependence dependence() const override {
        return isShared() || m_settings.blockSize == 0 ? SampleDependence::None : SampleDependence::Render;
    }

    BiasBound biasBound(const Scene& scene) const override {
        if (m_settings.blockSize == 0)
            return {};
        const float reachBlocks = isShared() ? SurfaceLattice::kReach : kFirstRayReach;
        return {reachBlocks * m_settings.blockSize, scene.moves() ? 1 / float(timeBinsFor(scene)) : 0};
    }

    double shadesPerPixel(int samplesPerPixel) const override {
        const double blockSize = double(m_settings.blockSize);
        return blockSize > 0 ? m_settings.shades * std::max(m_settings.timeBins, 1) / (blockSize * blockSize)
                             : samplesPerPixel;
    }
    bool needsShadeCost(const RenderContext&) const override {
        const bool isUnbounded = m_settings.cacheBytes == SIZE_MAX;
        return m_settings.blockSize > 0 && (m_size.isAutomatic || (isShared() && isUnbounded));
    }

    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext& context) const override {
        SharingSettings settings = m_settings;
        settings.timeBins = timeBinsFor(scene);
        settings.lightComponents = context.lightComponents;
        if (!isShared() && context.lightComponents > 0)
            throw Error("scope thread, mutex and tile do not support layers of direct light, indirect light "
                        "and light "
                        "groups: use scope shared or another integrator",
                        ErrorKind::Usage);
        if (needsShadeCost(context))
            settings.cacheBytes = automaticCacheBytes(context, settings.blockSize, settings.timeBins,
                                                      isShared() && context.lightComponents == 0);
        else if (m_size.isAutomatic)
            settings.cacheBytes = 0;
        return isShared() ? beginLatticeSharing(scene, settings, context.sampling.seed)
                          : beginFirstRaySharing(scene, settings);
    }

  private:
    bool isShared() const { return m_settings.scope == SharingSettings::Scope::Shared; }
    int timeBinsFor(const Scene& scene) const {
        if (m_settings.timeBins > 0)
            return m_settings.timeBins;
        return isShared() && scene.moves() ? kTimeBinsOfMotion : 1;
    }

    CacheSize m_size;
    SharingSettings m_settings; ///< timeBins 0: see timeBinsFor
};

} // namespace

IntegratorPlugin msaaCachePlugin() {
    return {"msaa-cache",
            "samples of all pixels and times interpolate between shared shading points; biased, less with "
            "smaller "
            "blocks",
            {kBlockSize, kShades, kTimeBins, kInterpolate, kScope, CacheSize::kParam},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const MsaaCache>(params);
            }};
}

} // namespace strobe
