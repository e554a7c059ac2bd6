#include "integrators/cache_settings.h"

#include "lattice/radiance_cache.h"

#include <charconv>

#include <sys/resource.h>
#include <unistd.h>

namespace strobe {

namespace {

const ParamDef<float> kNumber{"cache-mb", 0, ""};

/// Shades cheaper than about this cost less than to fetch them from memory.
constexpr double kMemorySeconds = 3e-7;
constexpr size_t kMegabyte = 1024 * 1024;

/// The machine's, or less where the process is limited (--max-memory).
size_t memoryForUs() {
    const size_t physical = size_t(sysconf(_SC_PHYS_PAGES)) * size_t(sysconf(_SC_PAGE_SIZE));
    rlimit limit{};
    return getrlimit(RLIMIT_DATA, &limit) == 0 ? std::min<size_t>(physical, limit.rlim_cur) : physical;
}

} // namespace

const ParamDef<std::string> CacheSize::kParam{"cache-mb", "auto",
                                              "size of the cache (scope thread and tile: of each thread's), "
                                              "unbounded, or auto: by the cost of a shade"};

CacheSize::CacheSize(const ParamSet& params) {
    double megabytes = 0;
    if (const auto type = params.typeOf(kParam); type && type != ParamType::String) {
        megabytes = double(params.get(kNumber));
    } else {
        const std::string word = params.get(kParam);
        automatic = word == "auto";
        if (automatic || word == "unbounded")
            return;
        const char* end = word.data() + word.size();
        if (std::from_chars(word.data(), end, megabytes).ptr != end || word.empty())
            throw Error(params.whereIs(kParam),
                        "\"cache-mb\" must be a number, \"auto\" or \"unbounded\", not \"" + word + "\"");
    }
    if (!(megabytes >= 0))
        throw Error(params.whereIs(kParam), "\"cache-mb\" must not be negative");
    bytes = size_t(std::min(megabytes * double(kMegabyte), 1e18));
}

size_t automaticBytes(const RenderContext& context, float blockSize, int timeBins, bool remembered) {
    const ShadeCost& cost = context.shadeCost;
    if (cost.shades() > 0 && cost.mean() + cost.deviation() < kMemorySeconds)
        return kMegabyte * size_t(context.threads);
    const double room = remembered ? .5 : 2; // for each block
    const double pixels = double(context.pixelBounds.width()) * context.pixelBounds.height();
    const double blocks = pixels * std::max(1.0, 1 / (double(blockSize) * blockSize)) * timeBins;
    const double most = double(memoryForUs()) / 4;
    return size_t(std::clamp(blocks * RadianceCache::bytesPerEntry() * room * (1 + context.lightComponents),
                             double(kMegabyte), most));
}

} // namespace strobe
