// Layers that tell what visibility samples saw, whatever shades them.
#pragma once

#include "core/film/cryptomatte.h"
#include "core/render/integrator.h"
#include "core/scene/object_names.h"

#include <optional>

namespace strobe {

/// A layer of what is seen.
enum class Feature {
    Normal,
    Albedo,
    Depth,
    Position,
    Uv,
    Motion,
    ObjectId,
    MaterialId,
    PrimitiveId,
    CryptoObject,
    CryptoMaterial
};

struct FeatureInfo {
    Feature feature;
    const char* name; ///< for --aov; of the layer in files, too, but for Cryptomatte
    const char* doc;
    std::vector<const char*> channels; ///< of Cryptomatte: the layer's name in files
};
/// All features, in the order of the enumeration.
const std::vector<FeatureInfo>& featureTable();

/// One channel of a file, ready to be written.
struct AovChannel {
    std::string layer, name; ///< in files: "layer.name"
    std::vector<float> values;
    bool exact = false; ///< see Channel
};

struct FeatureSettings {
    std::vector<Feature> features;
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
            FeatureSettings settings);

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
        Feature feature;
        size_t width; ///< numbers per pixel
        std::vector<float> values;
    };
    struct Mean {
        Feature feature;
        std::vector<double> sums; ///< three per pixel
    };
    struct Crypto {
        Feature feature;
        std::vector<CryptomatteCounts> counts;
    };

    // Of the pixel number `at`:
    /// Of samples `first` to `end` of the batch.
    void addNearest(const VisibilityBatch& batch, size_t first, size_t end, size_t at, Counters& counters);
    void addMeans(const VisibilityBatch& batch, const VisibilitySample& sample, size_t at,
                  Counters& counters);
    void show(Feature feature, const VisibilitySample& sample, const std::optional<SurfacePoint>& surface,
              float* out, Counters& counters) const;
    Rgb albedo(const VisibilityBatch& batch, const VisibilitySample& sample, const SurfacePoint& surface,
               Counters& counters) const;
    V2f motion(const Hit& hit, Counters& counters) const;
    /// The number of an object or a material.
    uint32_t thingOf(Feature feature, const Hit& hit) const;
    const std::vector<std::string>& namesOf(Feature feature) const;
    void appendCrypto(const Crypto& crypto, std::vector<AovChannel>& out) const;

    const Scene& m_scene;
    const Sampler& m_sampler;
    const PixelBounds m_pixelBounds;
    const FeatureSettings m_settings;
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
