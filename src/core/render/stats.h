// Counters and clocks: one set per thread, added up after the render.
#pragma once

#include "core/math/api.h"

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace STROBE_API strobe {

/// The steps of rendering a batch. Their times add up to the time that threads spend in tiles. Plan and
/// Resolve belong to the integrator; Film includes all AOVs.
enum class Stage { Generate, Trace, Plan, Shade, Resolve, Film };
inline constexpr int kStageCount = 6;
const char* toString(Stage stage);

/// An invalid sample (see PixelAccumulator::add), and the settings that reproduce it.
struct InvalidSample {
    int x, y;
    uint32_t sample;
    uint64_t seed;       ///< of its pass
    int samplesPerPixel; ///< of its pass
};

/// The cost of a shade in seconds, estimated from timed packets of shades.
class ShadeCost {
  public:
    /// Adds one packet.
    void add(uint64_t shades, double seconds) {
        const double mean = seconds / double(shades);
        ++m_packets;
        m_shades += shades;
        m_seconds += seconds;
        m_squares += double(shades) * mean * mean;
    }
    void add(const ShadeCost& other) {
        m_packets += other.m_packets;
        m_shades += other.m_shades;
        m_seconds += other.m_seconds;
        m_squares += other.m_squares;
    }
    uint64_t shades() const { return m_shades; }
    double mean() const { return m_shades ? m_seconds / double(m_shades) : 0; }
    /// Returns the standard deviation of the cost of one shade, estimated from the means of packets. Shades
    /// of a packet are close to each other and cost about the same, so the estimate errs to the large side.
    double deviation() const;

  private:
    uint64_t m_packets = 0, m_shades = 0;
    double m_seconds = 0;
    double m_squares = 0; ///< sum of the squared means of packets, weighted by their shades
};

/// Counters of a render or of one of its threads.
struct Counters {
    static constexpr size_t kMaxRecordedInvalid = 16;

    uint64_t pixels = 0;
    uint64_t visibilitySamples = 0; ///< camera rays
    uint64_t shades = 0;            ///< requests with a hit, for LightComponent::All or Indirect
    uint64_t directShades = 0;      ///< requests with a hit, for LightComponent::Direct
    uint64_t missed = 0;            ///< requests for radiance without a hit
    uint64_t lightSamples = 0;      ///< samples of lights, also those that add nothing
    uint64_t shadowRays = 0;
    uint64_t lightRays = 0;  ///< BSDF samples traced towards lights, for multiple importance sampling
    uint64_t bounceRays = 0; ///< path continuation, including specular bounces
    uint64_t surfaces = 0;   ///< surface points evaluated
    uint64_t footprints = 0; ///< texture footprints computed
    uint64_t invalidSamples = 0;
    uint64_t clampedSamples = 0; ///< see RenderSettings::clamp
    // Of integrators with a cache:
    uint64_t cacheLookups = 0;    ///< in the shared table; threads may keep recent entries themselves
    uint64_t cacheHits = 0;       ///< lookups that found their entry
    uint64_t cacheDuplicates = 0; ///< entries shaded by this thread, but stored first by another
    uint64_t cacheEvictions = 0;  ///< entries that replaced another
    uint64_t cacheBytes = 0;      ///< memory of the table, or of light that is shared otherwise
    std::vector<InvalidSample> firstInvalid;   ///< at most kMaxRecordedInvalid of the invalid samples
    std::array<double, kStageCount> seconds{}; ///< per stage
    std::vector<ShadeCost> shadeCosts;         ///< per material, then of misses; from some of the batches

    void add(const Counters& other);
    /// Returns the number of all rays traced.
    uint64_t rays() const { return visibilitySamples + shadowRays + lightRays + bounceRays; }
};

/// A stopwatch for the stages of a batch.
class StageClock {
  public:
    explicit StageClock(Counters& counters)
        : m_counters(counters), m_last(std::chrono::steady_clock::now()) {}
    /// Adds the time since the last call, or since construction, to `stage`.
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
