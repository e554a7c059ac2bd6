#include "core/stats.h"

#include <algorithm>

namespace strobe {

const char* toString(Stage stage) {
    static constexpr const char* names[] = {"generate", "trace", "plan", "shade", "resolve"};
    return names[int(stage)];
}

void Counters::add(const Counters& other) {
    pixels += other.pixels;
    visibilitySamples += other.visibilitySamples;
    shades += other.shades;
    escaped += other.escaped;
    shadowRays += other.shadowRays;
    lightRays += other.lightRays;
    bounceRays += other.bounceRays;
    surfaces += other.surfaces;
    footprints += other.footprints;
    badSamples += other.badSamples;
    blockLookups += other.blockLookups;
    blockHits += other.blockHits;
    blockDuplicates += other.blockDuplicates;
    blockEvictions += other.blockEvictions;
    cacheBytes = std::max(cacheBytes, other.cacheBytes); // of one table, which all threads share
    constexpr size_t kKept = 16;
    for (const BadSample& bad : other.firstBad)
        if (firstBad.size() < kKept)
            firstBad.push_back(bad);
    for (int i = 0; i < kStageCount; ++i)
        seconds[i] += other.seconds[i];
}

} // namespace strobe
