#include "core/film/cryptomatte.h"

#include <nlohmann/json.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <unordered_map>

namespace strobe {

namespace {

uint32_t scramble(uint32_t k) { return std::rotl(k * 0xcc9e2d51u, 15) * 0x1b873593u; }

} // namespace

uint32_t murmur3(std::string_view bytes) {
    uint32_t h = 0;
    size_t i = 0;
    for (; i + 4 <= bytes.size(); i += 4) {
        uint32_t k;
        std::memcpy(&k, bytes.data() + i, 4);
        h = std::rotl(h ^ scramble(k), 13) * 5 + 0xe6546b64u;
    }
    uint32_t tail = 0;
    std::memcpy(&tail, bytes.data() + i, bytes.size() - i);
    h ^= scramble(tail) ^ uint32_t(bytes.size());
    h = (h ^ h >> 16) * 0x85ebca6bu;
    h = (h ^ h >> 13) * 0xc2b2ae35u;
    return h ^ h >> 16;
}

uint32_t cryptomatteId(std::string_view name) {
    const uint32_t hash = murmur3(name);
    const uint32_t exponent = hash >> 23 & 255;
    return exponent == 0 || exponent == 255 ? hash ^ 1u << 23 : hash;
}

Metadata cryptomatteMetadata(const std::string& layer, const std::vector<std::string>& names) {
    nlohmann::json manifest = nlohmann::json::object();
    for (const std::string& name : names)
        manifest[name] = fmt::format("{:08x}", cryptomatteId(name));
    const std::string key = "cryptomatte/" + fmt::format("{:08x}", cryptomatteId(layer)).substr(0, 7) + '/';
    // Invalid UTF-8 is replaced in the manifest; the id is the hash of the original bytes.
    const auto replace = nlohmann::json::error_handler_t::replace;
    return {{key + "name", layer},
            {key + "hash", "MurmurHash3_32"},
            {key + "conversion", "uint32_to_float32"},
            {key + "manifest", manifest.dump(-1, ' ', false, replace)}};
}

std::vector<std::pair<std::string, std::string>>
cryptomatteCollisions(const std::vector<std::string>& names) {
    std::vector<std::pair<std::string, std::string>> collisions;
    std::unordered_map<uint32_t, std::string> nameOfId;
    for (const std::string& name : names)
        if (const auto [it, isNew] = nameOfId.emplace(cryptomatteId(name), name);
            !isNew && it->second != name)
            collisions.emplace_back(it->second, name);
    return collisions;
}

void CryptomatteCounts::rank(const std::vector<uint32_t>& ids, uint64_t samples, int levels,
                             float* out) const {
    std::vector<Entry> ranked = m_entries;
    std::sort(ranked.begin(), ranked.end(), [](const Entry& a, const Entry& b) {
        return a.samples != b.samples ? a.samples > b.samples : a.name < b.name;
    });
    std::fill_n(out, 2 * levels, 0.f);
    for (size_t i = 0; i < std::min(ranked.size(), size_t(levels)); ++i) {
        out[2 * i] = std::bit_cast<float>(ids[ranked[i].name]);
        out[2 * i + 1] = float(double(ranked[i].samples) / double(samples));
    }
}

} // namespace strobe
