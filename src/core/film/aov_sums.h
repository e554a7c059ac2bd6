// What a render gathers for the AOVs of AovGroup::Visible, without the scene: it can be stored and merged.
#pragma once

#include "core/film/aov.h"
#include "core/film/cryptomatte.h"
#include "core/film/pixel_accumulator.h"
#include "core/math/api.h"
#include "core/math/pixel_bounds.h"

#include <string_view>

namespace STROBE_API strobe {

/// The AOVs of a render, and the names that they refer to.
struct AovLayout {
    std::vector<Aov> aovs{};                  ///< of AovGroup::Visible and AovGroup::Light
    int cryptoLevels = 6;                     ///< the maximum number of Cryptomatte ids per pixel
    std::vector<std::string> objectNames{};   ///< empty unless Aov::CryptoObject needs them
    std::vector<std::string> materialNames{}; ///< empty unless Aov::CryptoMaterial needs them
    std::vector<std::string> lightGroups{};   ///< empty unless Aov::LightGroups needs them
};

/// The samples of AOVs per pixel. Disjoint samples add up to the same bits in any order and grouping: means
/// are exact sums, a value of one sample is that of the sample nearest to the pixel center (of equally near
/// ones, the first), and Cryptomatte counts samples.
class AovSums {
  public:
    /// AOVs of other groups than AovGroup::Visible are ignored.
    explicit AovSums(const PixelBounds& pixelBounds, AovLayout layout = {});

    /// The index of a pixel in the vectors below.
    size_t index(int x, int y) const {
        return size_t(y - m_pixelBounds.y0) * size_t(m_pixelBounds.width()) + size_t(x - m_pixelBounds.x0);
    }
    const AovLayout& layout() const { return m_layout; }

    /// Returns the channels, row by row over the pixel bounds.
    std::vector<AovChannel> channels() const;
    /// Returns the Cryptomatte metadata of files with these channels.
    Metadata metadata() const;
    /// Returns a message for each pair of names that Cryptomatte cannot distinguish.
    std::vector<std::string> warnings() const;

    /// Appends the samples of the pixels in `tile`, which lies within the pixel bounds, to `bytes`.
    void store(const PixelBounds& tile, std::string& bytes) const;
    /// Removes what `store` appended from the front of `bytes`, and adds these samples. Returns false if the
    /// bytes are damaged.
    bool load(const PixelBounds& tile, std::string_view& bytes);

    /// An AOV of the sample nearest to the pixel center.
    struct Nearest {
        Aov aov;
        size_t channels;
        std::vector<float> values; ///< `channels` per pixel
    };
    /// An AOV that is a mean of samples with up to three channels.
    struct Mean {
        Aov aov;
        std::vector<PixelAccumulator> sums; ///< per pixel
    };
    struct Cryptomatte {
        Aov aov;
        std::vector<CryptomatteCounts> counts; ///< per pixel
    };
    std::vector<Nearest> nearest;
    std::vector<float> distance2;        ///< squared, of each pixel's nearest sample to the pixel center
    std::vector<uint32_t> nearestSample; ///< the number of this sample in its pixel
    std::vector<Mean> means;
    std::vector<Cryptomatte> cryptomattes;
    std::vector<uint32_t> sampleCounts; ///< per pixel

  private:
    const std::vector<std::string>& names(Aov aov) const;
    void appendCryptomatte(const Cryptomatte& cryptomatte, std::vector<AovChannel>& out) const;
    void storePixel(size_t pixel, std::string& bytes) const;
    bool loadPixel(size_t pixel, std::string_view& bytes);
    bool loadNearest(size_t pixel, std::string_view& bytes);

    PixelBounds m_pixelBounds;
    AovLayout m_layout;
};

/// Appends the bytes of a number or another trivially copyable value.
template <class T>
void storeValue(const T& value, std::string& bytes) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}
/// Removes a value from the front of `bytes`. Returns false if they are too few.
template <class T>
bool loadValue(T& value, std::string_view& bytes) {
    if (bytes.size() < sizeof value)
        return false;
    std::memcpy(&value, bytes.data(), sizeof value);
    bytes.remove_prefix(sizeof value);
    return true;
}
/// As above, for sums.
void storeSum(const PixelAccumulator& sum, std::string& bytes);
/// Removes a sum from the front of `bytes` and adds it to `sum`. Returns false if they are too few.
bool loadSum(PixelAccumulator& sum, std::string_view& bytes);

} // namespace strobe
