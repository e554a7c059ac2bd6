// AOVs of AovGroup::Visible: properties of the surfaces that visibility samples hit.
#pragma once

#include "core/film/aov.h"
#include "core/film/cryptomatte.h"
#include "core/render/integrator.h"
#include "core/scene/object_names.h"

#include <optional>

namespace strobe {

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

    /// Returns the channels of the samples added so far, row by row over the pixel bounds.
    std::vector<AovChannel> channels() const;
    /// Returns the Cryptomatte metadata of files with these channels.
    Metadata metadata() const;
    /// Returns a message for each pair of names that Cryptomatte cannot distinguish.
    std::vector<std::string> warnings() const;

  private:
    /// An AOV of the sample nearest to the pixel center.
    struct NearestAov {
        Aov aov;
        size_t channels;
        std::vector<float> values; ///< `channels` per pixel
    };
    /// An AOV that is a mean of samples with three channels.
    struct MeanAov {
        Aov aov;
        std::vector<double> sums; ///< three per pixel
    };
    struct CryptomatteAov {
        Aov aov;
        std::vector<CryptomatteCounts> counts; ///< per pixel
    };

    // `pixel` is an index into the pixel bounds.
    void addNearest(const VisibilityBatch& batch, size_t begin, size_t end, size_t pixel, Counters& counters);
    void addMeans(const VisibilityBatch& batch, const VisibilitySample& sample, size_t pixel,
                  Counters& counters);
    void writeNearest(Aov aov, const VisibilitySample& sample, const std::optional<SurfacePoint>& surface,
                      float* out, Counters& counters) const;
    float depth(const VisibilitySample& sample) const;
    Rgb albedo(const VisibilityBatch& batch, const VisibilitySample& sample, const SurfacePoint& surface,
               Counters& counters) const;
    V2f motionVector(const Hit& hit, Counters& counters) const;
    uint32_t nameIndex(Aov aov, const Hit& hit) const;
    const std::vector<std::string>& names(Aov aov) const;
    void appendCryptomatte(const CryptomatteAov& cryptomatte, std::vector<AovChannel>& out) const;

    const Scene& m_scene;
    const Sampler& m_sampler;
    const PixelBounds m_pixelBounds;
    const AovFilmSettings m_settings;
    const bool m_moves;                   ///< see Scene::moves
    std::optional<ObjectNames> m_objects; ///< if an AOV needs them
    std::vector<NearestAov> m_nearest;
    std::vector<float> m_distance2;     ///< squared, of each pixel's nearest sample to the pixel center
    bool m_nearestNeedsSurface = false; ///< some AOV in m_nearest needs a SurfacePoint
    std::vector<MeanAov> m_means;
    std::vector<CryptomatteAov> m_cryptomattes;
    std::vector<uint32_t> m_sampleCounts; ///< per pixel
};

} // namespace strobe
