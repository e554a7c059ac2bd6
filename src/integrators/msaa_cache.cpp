#include "integrators/msaa_cache.h"

#include "integrators/cache_settings.h"

#include <charconv>

#include <unistd.h>

namespace strobe {

namespace {

const ParamDef<float> kBlockSize{"blocksize", 1,
                                 "distance of shading points in pixels; 0: every sample shades for itself"};
const ParamDef<int> kShades{"shades", 1, "shades per point or block"};
const ParamDef<int> kTimeBins{
    "timebins", 0,
    "parts of the shutter that are shaded apart; 0: 4 if anything moves (scope shared), else 1"};
const ParamDef<std::string> kInterpolate{"interpolate", "lattice",
                                         "lattice: between the points around; nearest: the nearest"};
const ParamDef<std::string> kScope{"scope", "shared",
                                   "shared: one cache, whose blocks depend on their key alone; the paper's, "
                                   "decided by the first ray: thread, "
                                   "mutex, tile"};
const ParamDef<std::string> kCacheMegabytes{"cache-mb", "auto",
                                            "size of the cache (scope thread and tile: of each thread's), "
                                            "unbounded, or auto: by the cost of a shade"};
const ParamDef<float> kCacheMegabytesNumber{"cache-mb", 0, ""};

/// Measured on moving scenes (docs/results): with fewer, what a moving thing covers now and then is shaded
/// while it is covered; more take time and change little.
constexpr int kTimeBinsOfMotion = 4;
/// Shades cheaper than about this cost less than to fetch them from memory.
constexpr double kMemorySeconds = 3e-7;
constexpr size_t kMegabyte = 1024 * 1024;

template <class T>
T oneOf(const ParamSet& params, const ParamDef<std::string>& def,
        std::initializer_list<std::pair<const char*, T>> values) {
    const std::string word = params.get(def);
    std::string known;
    for (const auto& [name, value] : values) {
        if (word == name)
            return value;
        known += (known.empty() ? "" : ", ") + std::string(name);
    }
    throw Error(params.whereIs(def),
                std::string("\"") + def.name + "\" cannot be \"" + word + "\" (known: " + known + ")");
}

size_t physicalMemory() { return size_t(sysconf(_SC_PHYS_PAGES)) * size_t(sysconf(_SC_PAGE_SIZE)); }

/// As large as all the blocks that the picture can be expected to need (twice the points of its pixels, in
/// buckets half full), a quarter of the machine's memory at most; but if a shade costs no more than
/// fetching it from memory, no larger than a processor's own cache. (The paper, Section 2.3: "cycle counting
/// the average and standard deviation for a set of typical shades would give a good indication of how much
/// space to dedicate to the cache, and which level of the memory hierarchy".)
size_t automaticBytes(const RenderContext& context, float blockSize, int timeBins) {
    const ShadeCost cost = context.measureShadeCost();
    if (cost.shades() > 0 && cost.mean() + cost.deviation() < kMemorySeconds)
        return kMegabyte * size_t(context.threads);
    constexpr double kBytesPerBlock = 24, kSlack = 4;
    const double pixels = double(context.window.width()) * context.window.height();
    const double blocks = pixels * std::max(1.0, 1 / (double(blockSize) * blockSize)) * timeBins;
    const double most = double(physicalMemory()) / 4;
    return size_t(std::clamp(blocks * kBytesPerBlock * kSlack, double(kMegabyte), most));
}

class MsaaCache : public Integrator {
  public:
    explicit MsaaCache(const ParamSet& params) {
        using Scope = CacheSettings::Scope;
        if (params.get(kShades) < 1)
            throw Error(params.whereIs(kShades), "\"shades\" must be at least 1");
        if (params.get(kTimeBins) < 0)
            throw Error(params.whereIs(kTimeBins), "\"timebins\" must not be negative");
        if (!(params.get(kBlockSize) >= 0))
            throw Error(params.whereIs(kBlockSize), "\"blocksize\" must not be negative");
        const Scope scope = oneOf<Scope>(params, kScope,
                                         {{"shared", Scope::Shared},
                                          {"thread", Scope::Thread},
                                          {"mutex", Scope::Mutex},
                                          {"tile", Scope::Tile}});
        const bool nearest = oneOf<bool>(params, kInterpolate, {{"lattice", false}, {"nearest", true}});
        m_settings = {scope,   params.get(kBlockSize), params.get(kShades), params.get(kTimeBins), nearest,
                      SIZE_MAX};
        m_automatic = readBytes(params);
    }

    BiasBound biasBound(const Scene& scene) const override {
        if (m_settings.blockSize == 0)
            return {};
        const float blocks = isShared() ? SurfaceLattice::kReach : kFirstRayReach;
        return {blocks * m_settings.blockSize, scene.moves() ? 1 / float(binsFor(scene)) : 0};
    }

    std::unique_ptr<IntegratorRender> begin(const Scene& scene, const RenderContext& context) const override {
        CacheSettings settings = m_settings;
        settings.timeBins = binsFor(scene);
        if (m_automatic || (isShared() && settings.bytes == SIZE_MAX))
            settings.bytes =
                settings.blockSize > 0 ? automaticBytes(context, settings.blockSize, settings.timeBins) : 0;
        return isShared() ? beginLatticeSharing(scene, settings, context.seed)
                          : beginFirstRaySharing(scene, settings);
    }

  private:
    bool isShared() const { return m_settings.scope == CacheSettings::Scope::Shared; }
    int binsFor(const Scene& scene) const {
        if (m_settings.timeBins > 0)
            return m_settings.timeBins;
        return isShared() && scene.moves() ? kTimeBinsOfMotion : 1;
    }
    /// Sets the bytes; true when they are to be found out.
    bool readBytes(const ParamSet& params) {
        double megabytes = 0;
        if (const auto type = params.typeOf(kCacheMegabytes); type && type != ParamType::String) {
            megabytes = double(params.get(kCacheMegabytesNumber));
        } else {
            const std::string word = params.get(kCacheMegabytes);
            if (word == "auto")
                return true;
            if (word == "unbounded")
                return false;
            const char* end = word.data() + word.size();
            if (std::from_chars(word.data(), end, megabytes).ptr != end || word.empty())
                throw Error(params.whereIs(kCacheMegabytes),
                            "\"cache-mb\" must be a number, \"auto\" or \"unbounded\", not \"" + word + "\"");
        }
        if (!(megabytes >= 0))
            throw Error(params.whereIs(kCacheMegabytes), "\"cache-mb\" must not be negative");
        m_settings.bytes = size_t(std::min(megabytes * double(kMegabyte), 1e18));
        return false;
    }

    CacheSettings m_settings; ///< timeBins 0: by the scene
    bool m_automatic = false;
};

} // namespace

IntegratorPlugin msaaCachePlugin() {
    return {"msaa-cache",
            "samples of any pixel and time share the shading points around them; biased by the block's size",
            {kBlockSize, kShades, kTimeBins, kInterpolate, kScope, kCacheMegabytes},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const MsaaCache>(params);
            }};
}

} // namespace strobe
