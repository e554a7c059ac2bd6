#include "integrators/indirect_cache.h"

#include "integrators/cache_settings.h"

namespace strobe {

namespace {

const ParamDef<float> kBlockSize{"blocksize", 4,
                                 "distance in pixels of the points where indirect light is shaded; 0: every "
                                 "sample shades all its light for itself",
                                 nullptr, kNotNegative};
const ParamDef<int> kShades{"shades", 0,
                            "shades of indirect light per point; 0: as many as samples per pixel", nullptr,
                            kNotNegative};
const ParamDef<int> kTimeBins{"timebins", 1, "parts of the shutter that are shaded apart", nullptr,
                              kAtLeastOne};

class IndirectCache : public Integrator {
  public:
    explicit IndirectCache(const ParamSet& params) : m_size(params) {
        m_settings = {CacheSettings::Scope::Shared,
                      params.get(kBlockSize),
                      params.get(kShades),
                      params.get(kTimeBins),
                      false,
                      m_size.bytes,
                      true};
    }

    SampleDependence dependence() const override { return SampleDependence::None; }

    BiasBound biasBound(const Scene& scene) const override {
        if (m_settings.blockSize == 0)
            return {};
        return {SurfaceLattice::kReach * m_settings.blockSize,
                scene.moves() ? 1 / float(m_settings.timeBins) : 0};
    }

    bool needsShadeCost(const RenderContext& context) const override {
        return m_settings.blockSize > 0 && context.hasIndirectLight &&
               (m_size.automatic || m_settings.bytes == SIZE_MAX);
    }

    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext& context) const override {
        CacheSettings settings = m_settings;
        settings.lightComponents = context.lightComponents;
        if (!context.hasIndirectLight)
            settings.blockSize = 0;
        settings.shadesFollowSamples = settings.shades == 0;
        if (settings.shadesFollowSamples)
            settings.shades = context.samplesPerPixel;
        if (needsShadeCost(context))
            settings.bytes =
                automaticBytes(context, settings.blockSize, settings.timeBins, context.lightComponents == 0);
        else if (settings.blockSize == 0)
            settings.bytes = 0;
        return beginLatticeSharing(scene, settings, context.seed);
    }

  private:
    CacheSize m_size;
    CacheSettings m_settings; ///< shades 0: by the samples
};

} // namespace

IntegratorPlugin indirectCachePlugin() {
    return {"indirect-cache",
            "direct light for every sample, indirect light shared by the points around it; biased in "
            "indirect light",
            {kBlockSize, kShades, kTimeBins, CacheSize::kParam},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const IndirectCache>(params);
            }};
}

} // namespace strobe
