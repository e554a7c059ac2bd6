#include "integrators/cache_size.h"

#include "core/util/memory.h"
#include "core/util/resource_policy.h"
#include "lattice/radiance_cache.h"

#include <charconv>

#include <sys/resource.h>

namespace strobe {

namespace {

const ParamDef<float> kNumber{"cache-mb", 0, ""};

/// Shades that take less than about this take less than a memory access for a cached value.
constexpr double kMemorySeconds = 3e-7;
constexpr size_t kMegabyte = 1024 * 1024;

} // namespace

size_t availableMemory() {
    const size_t physical = physicalMemory();
    rlimit limit{};
    return getrlimit(RLIMIT_DATA, &limit) == 0 ? std::min<size_t>(physical, limit.rlim_cur) : physical;
}

const ParamDef<std::string> CacheSize::kParam{
    "cache-mb", "auto",
    "size of a cache in megabytes, \"unbounded\", or \"auto\": chosen by the cost of a shade"};

CacheSize::CacheSize(const ParamSet& params, const ParamDef<std::string>& param) {
    double megabytes = 0;
    if (const auto type = params.typeOf(param); type && type != ParamType::String) {
        megabytes = double(params.get(kNumber));
    } else {
        const std::string word = params.get(param);
        isAutomatic = word == "auto";
        if (isAutomatic || word == "unbounded")
            return;
        const char* end = word.data() + word.size();
        if (std::from_chars(word.data(), end, megabytes).ptr != end || word.empty())
            throw Error(params.whereIs(param),
                        "\"cache-mb\" must be a number, \"auto\" or \"unbounded\", not \"" + word + "\"");
    }
    if (!(megabytes >= 0))
        throw Error(params.whereIs(param), "\"cache-mb\" must not be negative");
    if (megabytes * double(kMegabyte) > double(availableMemory()))
        throw Error(params.whereIs(param),
                    "\"cache-mb\" is more than the memory available: " + formatBytes(availableMemory()));
    bytes = size_t(megabytes * double(kMegabyte));
}

size_t automaticCacheBytes(const RenderContext& context, float blockSize, int timeBins,
                           bool threadsKeepValues) {
    const ShadeCost& cost = context.shadeCost;
    if (cost.shades() > 0 && cost.mean() + cost.deviation() < kMemorySeconds)
        return kMegabyte * size_t(context.threads);
    const double entriesPerPoint = threadsKeepValues ? .5 : 2;
    const double pixels = double(context.pixelBounds.width()) * context.pixelBounds.height();
    const double points = pixels * std::max(1.0, 1 / (double(blockSize) * blockSize)) * timeBins;
    const double maxBytes = double(availableMemory()) / 4;
    const double bytes =
        points * RadianceCache::bytesPerEntry() * entriesPerPoint * (1 + context.lightComponents);
    return size_t(std::clamp(bytes, double(kMegabyte), maxBytes));
}

} // namespace strobe
