// Layers that tell what visibility samples saw, whatever shades them.
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
    int cryptoLevels = 6;                     ///< of Cryptomatte: how many things a pixel can name
};

/// Gathers features over a window of the frame. Normals and albedos are means of the samples, weighted by the
/// pixel filter, like color. What makes no sense when mixed is that of one sample: of all, the nearest to
/// the middle of the pixel. Cryptomatte counts all samples: they are drawn with the density of the filter's
/// absolute value, so their numbers are the coverage that it gives.
class AovFilm {
  public:
    /// Scene and sampler outlive the film.
    AovFilm(const Scene& scene, const Sampler& sampler, const PixelBounds& pixelBounds,
            AovFilmSettings settings);

    /// Adds the wanted samples of a batch; those of different pixels may come from different threads. Counts
    /// `surfaces` and `footprints`.
    void add(const VisibilityBatch& batch, Counters& counters);

    /// Row by row over the window, of what was added so far.
    std::vector<AovChannel> channels() const;
    /// What the header of a file must say of them.
    Metadata metadata() const;
    /// Names that Cryptomatte cannot tell apart, in words.
    std::vector<std::string> warnings() const;

  private:
    struct Plane {
        Aov aov;
        size_t width; ///< numbers per pixel
        std::vector<float> values;
    };
    struct Mean {
        Aov aov;
        std::vector<double> sums; ///< three per pixel
    };
    struct Crypto {
        Aov aov;
        std::vector<CryptomatteCounts> counts;
    };

    // Of the pixel number `at`:
    /// Of samples `first` to `end` of the batch.
    void addNearest(const VisibilityBatch& batch, size_t first, size_t end, size_t at, Counters& counters);
    void addMeans(const VisibilityBatch& batch, const VisibilitySample& sample, size_t at,
                  Counters& counters);
    void show(Aov aov, const VisibilitySample& sample, const std::optional<SurfacePoint>& surface, float* out,
              Counters& counters) const;
    Rgb albedo(const VisibilityBatch& batch, const VisibilitySample& sample, const SurfacePoint& surface,
               Counters& counters) const;
    V2f motion(const Hit& hit, Counters& counters) const;
    /// The number of an object or a material.
    uint32_t thingOf(Aov aov, const Hit& hit) const;
    const std::vector<std::string>& namesOf(Aov aov) const;
    void appendCrypto(const Crypto& crypto, std::vector<AovChannel>& out) const;

    const Scene& m_scene;
    const Sampler& m_sampler;
    const PixelBounds m_pixelBounds;
    const AovFilmSettings m_settings;
    std::optional<ObjectNames> m_objects; ///< where they are asked for
    std::vector<Plane> m_planes;          ///< of one sample each
    std::vector<float> m_distance2; ///< of that sample to the pixel's middle; none if there are no planes
    bool m_needsSurface = false;    ///< for m_planes
    bool m_moves;                   ///< anything, or the camera
    std::vector<Mean> m_means;
    std::vector<Crypto> m_cryptos;
    std::vector<uint32_t> m_samples; ///< by pixel
};

} // namespace strobe
