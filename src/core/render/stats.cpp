#include "core/render/stats.h"

#include <algorithm>
#include <cmath>

namespace strobe {

const char* toString(Stage stage) {
    static constexpr const char* names[] = {"generate", "trace", "plan", "shade", "resolve", "film"};
    return names[int(stage)];
}

double ShadeCost::deviation() const {
    if (m_packets < 2)
        return 0;
    const double squares = m_squares - m_seconds * m_seconds / double(m_shades);
    return std::sqrt(std::max(0.0, squares / double(m_packets - 1)));
}

void Counters::add(const Counters& other) {
    pixels += other.pixels;
    visibilitySamples += other.visibilitySamples;
    shades += other.shades;
    directShades += other.directShades;
    missed += other.missed;
    lightSamples += other.lightSamples;
    shadowRays += other.shadowRays;
    lightRays += other.lightRays;
    bounceRays += other.bounceRays;
    surfaces += other.surfaces;
    footprints += other.footprints;
    invalidSamples += other.invalidSamples;
    clampedSamples += other.clampedSamples;
    cacheLookups += other.cacheLookups;
    cacheHits += other.cacheHits;
    cacheDuplicates += other.cacheDuplicates;
    cacheEvictions += other.cacheEvictions;
    cacheBytes = std::max(cacheBytes, other.cacheBytes); // all threads share one table
    shadeCosts.resize(std::max(shadeCosts.size(), other.shadeCosts.size()));
    for (size_t i = 0; i < other.shadeCosts.size(); ++i)
        shadeCosts[i].add(other.shadeCosts[i]);
    for (const InvalidSample& sample : other.firstInvalid)
        if (firstInvalid.size() < kMaxRecordedInvalid)
            firstInvalid.push_back(sample);
    for (int i = 0; i < kStageCount; ++i)
        seconds[i] += other.seconds[i];
}

} // namespace strobe
