// AOVs of AovGroup::Visible: properties of the surfaces that visibility samples hit.
#pragma once

#include "core/film/aov_sums.h"
#include "core/math/api.h"
#include "core/render/integrator.h"
#include "core/scene/object_names.h"

#include <optional>

namespace STROBE_API strobe {

struct AovFilmSettings {
    std::vector<Aov> aovs;                    ///< of AovGroup::Visible
    std::vector<std::string> materialNames{}; ///< of the scene's materials
    int cryptoLevels = 6;                     ///< the maximum number of Cryptomatte ids per pixel
};

/// Accumulates AOVs over pixel bounds, independent of the integrator.
///
/// Normal and albedo are means of the samples, weighted by the pixel filter like color. Values that cannot be
/// averaged (depth, position, ids, …) are those of one sample per pixel: the one nearest to the pixel center.
/// Cryptomatte counts all samples: their density is the absolute value of the pixel filter, so that the
/// fraction of samples is the filtered coverage.
class AovFilm {
  public:
    /// The scene and the sampler must outlive the film.
    AovFilm(const Scene& scene, const Sampler& sampler, const PixelBounds& pixelBounds,
            AovFilmSettings settings);

    /// Adds the samples of batch.filmSlice. Threads may concurrently add batches of different pixels. Counts
    /// `surfaces` and `footprints`.
    void add(const VisibilityBatch& batch, Counters& counters);

    /// The samples added so far.
    const AovSums& sums() const { return m_sums; }
    /// For samples that were stored (AovSums::load), or that are discarded.
    AovSums& sums() { return m_sums; }

  private:
    // `pixel` is an index into the pixel bounds.
    void addNearest(const VisibilityBatch& batch, size_t begin, size_t end, size_t pixel, Counters& counters);
    void addMeans(const VisibilityBatch& batch, const VisibilitySample& sample, size_t pixel,
                  Counters& counters);
    void writeNearest(Aov aov, const VisibilitySample& sample, const std::optional<SurfacePoint>& surface,
                      float* out, Counters& counters) const;
    float depth(const VisibilitySample& sample) const;
    Frame shadingFrame(const Material& material, const VisibilitySample& sample,
                       const SurfacePoint& surface) const;
    Rgb albedo(const VisibilityBatch& batch, const VisibilitySample& sample, const SurfacePoint& surface,
               Counters& counters) const;
    V2f motionVector(const Hit& hit, Counters& counters) const;
    uint32_t nameIndex(Aov aov, const Hit& hit) const;

    const Scene& m_scene;
    const Sampler& m_sampler;
    const bool m_moves;                   ///< see Scene::moves
    std::optional<ObjectNames> m_objects; ///< if an AOV needs them
    bool m_nearestNeedsSurface = false;   ///< some AOV of one sample needs a SurfacePoint
    AovSums m_sums;
};

} // namespace strobe
