#include "lattice/radiance_cache.h"

#include "core/util/memory.h"

#include <algorithm>
#include <bit>
#include <new>

#include <sys/mman.h>

namespace strobe {

namespace {

uint64_t signature(uint64_t redGreen, uint32_t blue) { return redGreen ^ std::rotl(uint64_t(blue), 23); }

} // namespace

RadianceCache::~RadianceCache() {
    if (m_buckets)
        munmap(m_buckets, bytes());
}

RadianceCache::RadianceCache(size_t bytes) : m_bucketCount(std::max(bytes / sizeof(Bucket), size_t(1))) {
    allocate();
}

void RadianceCache::clear() {
    munmap(m_buckets, bytes());
    allocate();
}

void RadianceCache::allocate() {
    // Fresh pages are zero, and all-zero bytes are empty entries. A page takes memory once it is used. With
    // small pages, address translation would cost more than the lookup.
    static_assert(std::atomic<uint64_t>::is_always_lock_free && sizeof(Bucket) == 64);
    m_buckets = nullptr;
    void* p = mmap(nullptr, bytes(), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (p == MAP_FAILED)
        throw std::bad_alloc();
    m_buckets = static_cast<Bucket*>(p);
    adviseHugePages(p, bytes());
}

uint64_t RadianceCache::read(const Bucket& bucket, int way, uint64_t& redGreen, uint32_t& blue) {
    const uint64_t check = bucket.check[way].load(std::memory_order_relaxed);
    redGreen = bucket.redGreen[way].load(std::memory_order_relaxed);
    blue = bucket.blue[way].load(std::memory_order_relaxed);
    return check ^ signature(redGreen, blue);
}

bool RadianceCache::find(uint64_t key, Rgb& value) const {
    const Bucket& bucket = bucketOf(key);
    for (int way = 0; way < kWays; ++way) {
        uint64_t redGreen;
        uint32_t blue;
        if (read(bucket, way, redGreen, blue) != key)
            continue;
        value = Rgb(std::bit_cast<float>(uint32_t(redGreen)), std::bit_cast<float>(uint32_t(redGreen >> 32)),
                    std::bit_cast<float>(blue));
        return true;
    }
    return false;
}

RadianceCache::StoreResult RadianceCache::store(uint64_t key, const Rgb& value) {
    Bucket& bucket = bucketOf(key);
    int target = -1;
    for (int way = 0; way < kWays; ++way) {
        uint64_t redGreen;
        uint32_t blue;
        const uint64_t stored = read(bucket, way, redGreen, blue);
        if (stored == key)
            return StoreResult::Duplicate;
        if (stored == 0 && target < 0)
            target = way;
    }
    const StoreResult result = target >= 0 ? StoreResult::Inserted : StoreResult::Replaced;
    if (target < 0)
        target = int(key % kWays);
    const uint64_t red = std::bit_cast<uint32_t>(value.x), green = std::bit_cast<uint32_t>(value.y);
    const uint64_t redGreen = red | green << 32;
    const uint32_t blue = std::bit_cast<uint32_t>(value.z);
    bucket.check[target].store(key ^ signature(redGreen, blue), std::memory_order_relaxed);
    bucket.redGreen[target].store(redGreen, std::memory_order_relaxed);
    bucket.blue[target].store(blue, std::memory_order_relaxed);
    return result;
}

} // namespace strobe
