#include "integrators/adaptive_cache.h"

#include "core/params/plugin.h"
#include "core/util/resource_policy.h"
#include "integrators/cache_size.h"
#include "sharing/light_recorder.h"
#include "sharing/pilots/sample_plan.h"
#include "sharing/pilots/sharing_plan.h"
#include "sharing/reconstruction.h"
#include "sharing/rest_noise.h"

#include <limits>
#include <optional>

namespace strobe {

namespace {

const ParamDef<float> kCellSize{"cellsize", 3, "edge of the cells that sum light, in pixels", nullptr,
                                kPositive};
const ParamDef<std::string> kShare{"share", "auto",
                                   "light to share: auto (as a pilot decides), direct, indirect or both"};

const ParamDef<std::string> kSampling{"sampling", "adaptive",
                                      "samples per pixel: adaptive (up to 16 times as many where a pilot "
                                      "finds noise) or uniform"};

const ParamDef<std::string> kCacheSize{
    "cache-mb", "auto",
    "the most memory that sharing may take, in megabytes, \"unbounded\", or \"auto\": half of the memory. "
    "Nothing is shared if it would take more"};

/// See SharingOptions::chosen.
using ChosenParts = std::optional<LightParts>;

/// Returns the largest number of bytes that sharing may take.
size_t memoryLimitOf(const ParamSet& params) {
    const CacheSize size(params, kCacheSize);
    return size.isAutomatic ? availableMemory() / 2 : size.bytes;
}

double pixelCount(const PixelBounds& bounds) { return double(bounds.width()) * bounds.height(); }

/// How the light of an image was shared.
struct SharedLight {
    std::vector<HugeBuffer<PixelSharing>> parts; ///< empty: not at all
    HugeVector<float> restVariance;              ///< see strobe::restVariance; if it was asked for
};

/// Reconstructs the recorded parts of the light and corrects the image.
SharedLight shareLight(RecordedLight light, Film& film, bool findsErrors) {
    const LightParts shared = light.parts;
    const std::vector<PixelCorrection> corrections = emissionCorrections(light);
    for (const PixelCorrection& correction : corrections)
        film.addToImage(correction.pixel, correction.value);
    SharedLight out;
    if (shared.isEmpty())
        return out;
    if (findsErrors)
        out.restVariance = restVariance(light, corrections);
    LightSharing sharing(std::move(light));
    for (const LightPart part : {LightPart::Direct, LightPart::Indirect})
        if (shared.has(part)) {
            SharedPart sharedPart = sharing.share(part);
            film.addToImage(sharedPart.correction);
            out.parts.push_back(std::move(sharedPart.pixels));
        }
    return out;
}

/// Returns the estimated standard errors of the pixels.
std::vector<float> errorsOf(const SharedLight& light) {
    std::vector<float> errors(light.restVariance.begin(), light.restVariance.end());
    for (const auto& part : light.parts)
        for (size_t i = 0; i < errors.size(); ++i)
            errors[i] += part[i].error;
    for (float& error : errors)
        error = std::sqrt(error);
    return errors;
}

/// The parts of the light to share, and the numbers of samples.
struct AdaptivePlan {
    SharingPlan sharing;
    std::optional<SampleFactors> factors; ///< none: 1 everywhere
};

AdaptivePlan planWithoutPilot(const RenderContext& context, const SharingOptions& options) {
    constexpr double kCells = 1; // per pixel: unknown
    SharingPlan sharing{options.chosen.value_or(LightParts()), {}, {}, EmissionPilot()};
    if (!sharing.parts.isEmpty())
        sharing.bytes = sharingBytes(context, kCells);
    if (sharing.bytes > options.memoryLimit)
        sharing.parts = LightParts();
    return {sharing, {}};
}

AdaptivePlan makePlan(const Scene& scene, const RenderContext& context, const SharingOptions& options) {
    constexpr double kPassSamples = 16; // of passes, whose number is not known
    const double samples = context.isPass ? kPassSamples : context.samplesPerPixel;
    if (samples < kHalves)
        return planWithoutPilot(context, options);
    PairPilot pairs(scene, context, samples);
    pairs.renderFirst();
    if (pairs.isEmpty())
        return planWithoutPilot(context, options);
    AdaptivePlan plan{planSharing(scene, context, pairs, options), {}};
    if (options.adaptsSamples)
        plan.factors = planSamples(pairs, samples, plan.sharing);
    return plan;
}

class AdaptiveState : public IntegratorState {
  public:
    AdaptiveState(const Scene& scene, const RenderContext& context, const SharingOptions& options)
        : m_scene(scene), m_cellSize(options.cellSize), m_clamp(context.clamp),
          m_partOfFrame(pixelCount(context.pixelBounds) / pixelCount(context.pilotBounds)),
          m_plan(makePlan(scene, context, options)),
          m_frame(std::make_unique<FrameLight>(m_plan.sharing.parts)) {
        if (const auto& emission = m_plan.sharing.emission)
            m_refinement.emplace(scene, context.sampling, context.pilotBounds, context.samplesPerPixel,
                                 *emission);
        if (m_refinement && m_refinement->isEmpty())
            m_refinement.reset();
    }
    std::unique_ptr<IntegratorWorker> makeWorker() override {
        return std::make_unique<Worker>(bytesOfFilm(), m_scene, m_cellSize, m_clamp, m_plan.sharing.parts,
                                        *m_frame, m_plan.sharing.rareLimits,
                                        m_refinement ? &*m_refinement : nullptr);
    }
    const SampleFactors* sampleFactors() const override {
        return m_plan.factors ? &*m_plan.factors : nullptr;
    }
    bool observes() const override { return !m_plan.sharing.parts.isEmpty(); }
    bool records() const override { return observes() || m_refinement; }
    std::string note() const override {
        const char* const samples = m_plan.factors ? ", more samples where noise is" : "";
        if (!observes()) {
            const size_t bytes = m_plan.sharing.bytes;
            const std::string none =
                "shares no light" +
                (bytes > 0 ? ", which would take " + formatBytes(bytes) + " (cache-mb)" : "");
            return !records() && !m_plan.factors
                       ? none + ": equals supersample"
                       : none + (m_refinement ? ", more camera rays at the edges of lamps" : "") + samples;
        }
        const bool direct = m_plan.sharing.parts.has(LightPart::Direct);
        const bool indirect = m_plan.sharing.parts.has(LightPart::Indirect);
        return std::string(direct && indirect ? "shares direct and indirect light"
                           : direct           ? "shares direct light"
                                              : "shares indirect light") +
               samples;
    }
    void finish(Film& film, std::vector<float>* errors) const override {
        if (!records())
            return;
        mergeRecordsOfSamePixels(film.records());
        const bool hasLayer = film.has(Aov::SharedError);
        const SharedLight light = shareLight(m_frame->take(film), film, errors || hasLayer);
        if (light.parts.empty())
            return;
        setLayers(light.parts, film);
        std::vector<float> found = errorsOf(light);
        if (hasLayer)
            film.setPlane(Aov::SharedError, found);
        if (errors)
            *errors = std::move(found);
    }

  private:
    /// Reports the memory of sharing.
    class Worker : public RecordingWorker {
      public:
        template <class... Args>
        explicit Worker(size_t bytes, Args&&... args)
            : RecordingWorker(std::forward<Args>(args)...), m_bytes(bytes) {}
        void report(Counters& counters) const override { counters.cacheBytes = m_bytes; }

      private:
        const size_t m_bytes;
    };

    /// Returns about how many bytes sharing takes in this process, which may render a part of the frame.
    size_t bytesOfFilm() const {
        return observes() ? size_t(double(m_plan.sharing.bytes) * m_partOfFrame) : 0;
    }
    void setLayers(const std::vector<HugeBuffer<PixelSharing>>& parts, Film& film) const {
        const auto set = [&](Aov layer, const auto& value) {
            if (!film.has(layer))
                return;
            std::vector<float> values(parts.front().size());
            for (size_t i = 0; i < values.size(); ++i)
                values[i] = value(i);
            film.setPlane(layer, std::move(values));
        };
        // Means over the parts, weighted by their noise without sharing:
        const auto mean = [&](size_t i, const auto& value) {
            float sum = 0, weight = 0;
            for (const auto& part : parts) {
                const PixelSharing& pixel = part[i];
                sum += pixel.ownVariance * value(pixel);
                weight += pixel.ownVariance;
            }
            return weight > 0 ? sum / weight : 0;
        };
        set(Aov::SharedWeight, [&](size_t i) { return mean(i, [](auto& pixel) { return pixel.weight; }); });
        set(Aov::SharedWidth,
            [&](size_t i) { return m_cellSize * mean(i, [](auto& pixel) { return pixel.width; }); });
    }

    const Scene& m_scene;
    const float m_cellSize, m_clamp;
    const double m_partOfFrame; ///< context.pixelBounds in context.pilotBounds
    const AdaptivePlan m_plan;
    const std::unique_ptr<FrameLight> m_frame;
    std::optional<EmissionRefinement> m_refinement; ///< none: no pixel is refined
};

class AdaptiveCache : public Integrator {
  public:
    explicit AdaptiveCache(const ParamSet& params)
        : m_options{.cellSize = params.get(kCellSize),
                    .chosen = parseWord<ChosenParts>(params, kShare,
                                                     {{"auto", {}},
                                                      {"direct", LightParts(1)},
                                                      {"indirect", LightParts(2)},
                                                      {"both", LightParts::all()}}),
                    .adaptsSamples =
                        parseWord<bool>(params, kSampling, {{"adaptive", true}, {"uniform", false}}),
                    .memoryLimit = memoryLimitOf(params)} {}
    /// Estimates use samples up to some tens of pixels away, at any time; larger cells where a lens or motion
    /// spreads the samples of a pixel have no bound.
    BiasBound biasBound(const Scene& scene) const override {
        return {std::numeric_limits<float>::infinity(), scene.moves() ? 1.f : 0.f};
    }
    /// All samples of a pixel determine the size of its cells.
    SampleDependence dependence() const override { return SampleDependence::Pixel; }
    /// The errors follow from the differences of halves.
    int fewestSamplesOfPass() const override { return kHalves; }
    void mergeRecords(FilmRecords& records) const override { mergeRecordsOfSamePixels(records); }
    void finishMerged(Film& film) const override {
        if (!film.records().isEmpty())
            shareLight(RecordedLight(film), film, false);
    }
    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext& context) const override {
        return std::make_unique<AdaptiveState>(scene, context, m_options);
    }

  private:
    const SharingOptions m_options;
};

} // namespace

IntegratorPlugin adaptiveCachePlugin() {
    return {"adaptive-cache",
            "one shade per visibility sample; light is mixed with estimates from nearby samples on the "
            "same surface, weighted by their measured errors",
            {kCellSize, kShare, kSampling, kCacheSize},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const AdaptiveCache>(params);
            }};
}

} // namespace strobe
