// Counters and clocks, one set per thread, added up at the end.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace strobe {

/// The steps of rendering a batch; their seconds add up to the time threads spent in tiles. Plan and Resolve
/// are the integrator's; Film is what every integrator's samples cost once they have their values: layers and
/// features too.
enum class Stage { Generate, Trace, Plan, Shade, Resolve, Film };
inline constexpr int kStageCount = 6;
const char* toString(Stage stage);

/// A sample that came out as NaN or infinite, and how to find it again.
struct InvalidSample {
    int x, y;
    uint32_t sample;
    uint64_t seed; ///< of its pass, like
    int samplesPerPixel;
};

/// Seconds per shade, from packets of shades that were timed.
class ShadeCost {
  public:
    void add(uint64_t shades, double seconds) {
        const double mean = seconds / double(shades);
        ++m_packets, m_shades += shades, m_seconds += seconds, m_squares += double(shades) * mean * mean;
    }
    void add(const ShadeCost& other) {
        m_packets += other.m_packets, m_shades += other.m_shades;
        m_seconds += other.m_seconds, m_squares += other.m_squares;
    }
    uint64_t shades() const { return m_shades; }
    double mean() const { return m_shades ? m_seconds / double(m_shades) : 0; }
    /// The standard deviation of one shade's cost: that of the packets' means, times the root of a packet's
    /// size. (Shades of a packet cost alike, since they lie close: it errs to the large side.)
    double deviation() const;

  private:
    uint64_t m_packets = 0, m_shades = 0;
    double m_seconds = 0;
    double m_squares = 0; ///< sum of squared means, each times its shades
};

struct Counters {
    uint64_t pixels = 0;
    uint64_t visibilitySamples = 0; ///< camera rays
    uint64_t shades = 0;       ///< surface points shaded for the picture: shading requests that met something
    uint64_t directShades = 0; ///< surface points of which the direct light alone was asked for
    uint64_t missed = 0;       ///< requests that met nothing: no surface is shaded
    uint64_t shadowRays = 0;
    uint64_t lightRays = 0;  ///< BSDF samples traced to find a light (direct lighting)
    uint64_t bounceRays = 0; ///< path continuation, specular included
    uint64_t surfaces = 0;   ///< surface points evaluated
    uint64_t footprints = 0; ///< of those, with a texture footprint
    uint64_t invalidSamples = 0;
    uint64_t clampedSamples = 0; ///< see RenderSettings::clamp
    // Of integrators that cache:
    uint64_t cacheLookups = 0; ///< blocks looked up in a cache; the latest, threads may remember themselves
    uint64_t cacheHits = 0;    ///< of those, found in the cache
    uint64_t cacheDuplicates = 0;            ///< shaded, then found stored by another thread
    uint64_t cacheEvictions = 0;             ///< stored over another block
    uint64_t cacheBytes = 0;                 ///< the table's size
    std::vector<InvalidSample> firstInvalid; ///< the first few of invalidSamples
    std::array<double, kStageCount> seconds{};
    std::vector<ShadeCost>
        shadeCosts; ///< by material, the last: of what met nothing; from a part of the batches

    void add(const Counters& other);
    uint64_t rays() const { return visibilitySamples + shadowRays + lightRays + bounceRays; }
};

/// Adds the time since construction, or since the last call, to one stage after another.
class StageClock {
  public:
    explicit StageClock(Counters& counters)
        : m_counters(counters), m_last(std::chrono::steady_clock::now()) {}
    void charge(Stage stage) {
        const auto now = std::chrono::steady_clock::now();
        m_counters.seconds[size_t(stage)] += std::chrono::duration<double>(now - m_last).count();
        m_last = now;
    }

  private:
    Counters& m_counters;
    std::chrono::steady_clock::time_point m_last;
};

} // namespace strobe
