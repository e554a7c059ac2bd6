// Cryptomatte: mattes for everything that has a name (Friedman and Jones, "Fully Automatic ID Mattes with
// Support for Motion Blur and Transparency", 2015; specification 1.2.0).
#pragma once

#include "core/image/image.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace strobe {

/// MurmurHash3_x86_32 (Appleby) of bytes, seed 0.
uint32_t murmur3(std::string_view bytes);

/// The number that stands for a name (UTF-8): its hash, with the exponent's last bit flipped where the bits
/// would not be an ordinary float. Pixels hold these bits as a float.
uint32_t cryptomatteId(std::string_view name);

/// What the header of a file says of the Cryptomatte layer `layer` (e.g. "CryptoObject"), with the manifest
/// of all `names`.
Metadata cryptomatteMetadata(const std::string& layer, const std::vector<std::string>& names);

/// Pairs of different names that have the same id: their mattes cannot be told apart.
std::vector<std::pair<std::string, std::string>> cryptomatteCollisions(const std::vector<std::string>& names);

/// How many of a pixel's samples met each of the things it sees.
class CryptomatteCounts {
  public:
    /// One sample more of thing number `thing`.
    void add(uint32_t thing) {
        for (Entry& entry : m_entries)
            if (entry.thing == thing)
                return void(++entry.samples);
        m_entries.push_back({thing, 1});
    }
    /// Writes `levels` pairs of id (ids[thing], as a float) and coverage, the largest coverage first (of
    /// equals, the thing of the smaller number), and zeros after the last. `samples`: of the pixel in all.
    void rank(const std::vector<uint32_t>& ids, uint64_t samples, int levels, float* out) const;

  private:
    struct Entry {
        uint32_t thing, samples;
    };
    std::vector<Entry> m_entries;
};

} // namespace strobe
