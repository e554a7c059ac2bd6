#include "integrators/indirect_cache.h"

#include "integrators/cache_size.h"
#include "integrators/sharing_settings.h"

namespace strobe {

namespace {

const ParamDef<float> kBlockSize{
    "blocksize", 4,
    "spacing of the points where indirect light is shaded, in pixels; 0: one shade per sample", nullptr,
    kNotNegative};
const ParamDef<int> kShades{"shades", 0,
                            "shades of indirect light per point; 0: the number of samples per pixel", nullptr,
                            kNotNegative};
const ParamDef<int> kTimeBins{"timebins", 1, "number of intervals of the shutter that do not share shades",
                              nullptr, kAtLeastOne};

class IndirectCache : public Integrator {
  public:
    explicit IndirectCache(const ParamSet& params) : m_size(params) {
        m_settings.blockSize = params.get(kBlockSize);
        m_settings.shades = params.get(kShades);
        m_settings.timeBins = params.get(kTimeBins);
        m_settings.cacheBytes = m_size.bytes;
        m_settings.indirectOnly = true;
    }

    SampleDependence dependence() const override { return SampleDependence::None; }

    BiasBound biasBound(const Scene& scene) const override {
        if (m_settings.blockSize == 0)
            return {};
        return {SurfaceLattice::kReach * m_settings.blockSize,
                scene.moves() ? 1 / float(m_settings.timeBins) : 0};
    }

    double shadesPerPixel(int samplesPerPixel) const override {
        const double blockSize = double(m_settings.blockSize);
        const int shades = m_settings.shades > 0 ? m_settings.shades : samplesPerPixel;
        return samplesPerPixel + (blockSize > 0 ? shades * m_settings.timeBins / (blockSize * blockSize) : 0);
    }
    bool needsShadeCost(const RenderContext& context) const override {
        return m_settings.blockSize > 0 && context.hasIndirectLight &&
               (m_size.isAutomatic || m_settings.cacheBytes == SIZE_MAX);
    }

    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext& context) const override {
        SharingSettings settings = m_settings;
        settings.lightComponents = context.lightComponents;
        if (!context.hasIndirectLight)
            settings.blockSize = 0;
        settings.shadesFollowSamples = settings.shades == 0;
        if (settings.shadesFollowSamples)
            settings.shades = context.samplesPerPixel;
        if (needsShadeCost(context))
            settings.cacheBytes = automaticCacheBytes(context, settings.blockSize, settings.timeBins,
                                                      context.lightComponents == 0);
        else if (settings.blockSize == 0)
            settings.cacheBytes = 0;
        return beginLatticeSharing(scene, settings, context.sampling.seed);
    }

  private:
    CacheSize m_size;
    SharingSettings m_settings; ///< shades 0: the number of samples per pixel
};

} // namespace

IntegratorPlugin indirectCachePlugin() {
    return {
        "indirect-cache",
        "one shade of direct light per sample; indirect light is interpolated between shared shading points; "
        "biased in indirect light",
        {kBlockSize, kShades, kTimeBins, CacheSize::kParam},
        [](const ParamSet& params, const BuildContext&) {
            return std::make_shared<const IndirectCache>(params);
        }};
}

} // namespace strobe
