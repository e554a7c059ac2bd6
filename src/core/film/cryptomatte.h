// Cryptomatte: mattes for objects and materials by name (Friedman and Jones, "Fully Automatic ID Mattes with
// Support for Motion Blur and Transparency", 2015; specification 1.2.0).
#pragma once

#include "core/image/image.h"
#include "core/math/api.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace STROBE_API strobe {

/// Returns MurmurHash3_x86_32 (Appleby) of the bytes, with seed 0.
uint32_t murmur3(std::string_view bytes);

/// Returns the id of a name (UTF-8): its hash, interpreted as the bits of a float in pixels. If these would
/// be zero, denormal, infinite or NaN, the lowest bit of the exponent is flipped.
uint32_t cryptomatteId(std::string_view name);

/// Returns the file metadata of the Cryptomatte layer `layer` (e.g. "CryptoObject"), with a manifest of
/// `names`.
Metadata cryptomatteMetadata(const std::string& layer, const std::vector<std::string>& names);

/// Returns pairs of different names with the same id, which therefore share a matte.
std::vector<std::pair<std::string, std::string>> cryptomatteCollisions(const std::vector<std::string>& names);

/// The number of a pixel's samples per name.
class CryptomatteCounts {
  public:
    struct Entry {
        uint32_t name;
        uint32_t samples;
    };
    /// Adds samples of the name with this index.
    void add(uint32_t name, uint32_t samples = 1) {
        for (Entry& entry : m_entries) {
            if (entry.name == name) {
                entry.samples += samples;
                return;
            }
        }
        m_entries.push_back({name, samples});
    }
    /// The names that were added, in any order.
    const std::vector<Entry>& entries() const { return m_entries; }
    /// Writes the `levels` pairs of ID and coverage with the largest coverage to `out` (2 * levels floats),
    /// in descending order; ties in ascending order of the name's index. Missing pairs are zeros. ids[name]
    /// is stored as the bits of a float. Coverage is the name's number of samples divided by `samples`, the
    /// pixel's total.
    void rank(const std::vector<uint32_t>& ids, uint64_t samples, int levels, float* out) const;

  private:
    std::vector<Entry> m_entries;
};

} // namespace strobe
