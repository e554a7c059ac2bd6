#include "core/film/aov_sums.h"

#include <fmt/format.h>

namespace strobe {

namespace {

enum class Kind { Nearest, Mean, Cryptomatte };

Kind kindOf(Aov aov) {
    switch (aov) {
    case Aov::Normal:
    case Aov::Albedo:
    case Aov::Alpha:
        return Kind::Mean;
    case Aov::CryptoObject:
    case Aov::CryptoMaterial:
        return Kind::Cryptomatte;
    default:
        return Kind::Nearest;
    }
}

} // namespace

AovSums::AovSums(const PixelBounds& pixelBounds, AovLayout layout)
    : m_pixelBounds(pixelBounds), m_layout(std::move(layout)) {
    const size_t pixels = size_t(pixelBounds.width()) * size_t(pixelBounds.height());
    sampleCounts.assign(pixels, 0);
    for (const Aov aov : aovsInGroup(m_layout.aovs, AovGroup::Visible)) {
        const size_t channels = aovInfo(aov).channels.size();
        switch (kindOf(aov)) {
        case Kind::Nearest:
            nearest.push_back({aov, channels, std::vector<float>(pixels * channels)});
            distance2.assign(pixels, kInfinity);
            nearestSample.assign(pixels, 0);
            break;
        case Kind::Mean:
            means.push_back({aov, std::vector<PixelAccumulator>(pixels)});
            break;
        case Kind::Cryptomatte:
            cryptomattes.push_back({aov, std::vector<CryptomatteCounts>(pixels)});
            break;
        }
    }
}

const std::vector<std::string>& AovSums::names(Aov aov) const {
    return aov == Aov::CryptoObject ? m_layout.objectNames : m_layout.materialNames;
}

std::vector<AovChannel> AovSums::channels() const {
    std::vector<AovChannel> out;
    const auto append = [&](Aov aov, size_t channelIndex, bool exact, const auto& valueOf) {
        const AovInfo& info = aovInfo(aov);
        AovChannel& channel = out.emplace_back();
        channel = {info.name, info.channels[channelIndex], std::vector<float>(sampleCounts.size()), exact};
        for (size_t pixel = 0; pixel < sampleCounts.size(); ++pixel)
            channel.values[pixel] = valueOf(pixel);
    };
    for (const Nearest& layer : nearest)
        for (size_t c = 0; c < layer.channels; ++c)
            append(layer.aov, c, true,
                   [&](size_t pixel) { return layer.values[pixel * layer.channels + c]; });
    for (const Mean& mean : means)
        for (size_t c = 0; c < aovInfo(mean.aov).channels.size(); ++c)
            append(mean.aov, c, false, [&](size_t pixel) { return mean.sums[pixel].mean()[int(c)]; });
    for (const Cryptomatte& cryptomatte : cryptomattes)
        appendCryptomatte(cryptomatte, out);
    return out;
}

/// Appends the ranked ids and coverages, two levels per layer of four channels.
void AovSums::appendCryptomatte(const Cryptomatte& cryptomatte, std::vector<AovChannel>& out) const {
    const size_t levels = size_t(m_layout.cryptoLevels + 1) / 2 * 2, first = out.size();
    for (size_t i = 0; i < 2 * levels; ++i)
        out.push_back({fmt::format("{}{:02}", aovInfo(cryptomatte.aov).channels[0], i / 4),
                       std::string(1, "RGBA"[i % 4]), std::vector<float>(sampleCounts.size()), true});
    std::vector<uint32_t> ids;
    for (const std::string& name : names(cryptomatte.aov))
        ids.push_back(cryptomatteId(name));
    std::vector<float> ranked(2 * levels);
    for (size_t pixel = 0; pixel < sampleCounts.size(); ++pixel) {
        cryptomatte.counts[pixel].rank(ids, sampleCounts[pixel], int(levels), ranked.data());
        for (size_t i = 0; i < ranked.size(); ++i)
            out[first + i].values[pixel] = ranked[i];
    }
}

Metadata AovSums::metadata() const {
    Metadata metadata;
    for (const Cryptomatte& cryptomatte : cryptomattes)
        for (auto& entry : cryptomatteMetadata(aovInfo(cryptomatte.aov).channels[0], names(cryptomatte.aov)))
            metadata.push_back(std::move(entry));
    return metadata;
}

std::vector<std::string> AovSums::warnings() const {
    std::vector<std::string> messages;
    for (const Cryptomatte& cryptomatte : cryptomattes)
        for (const auto& [a, b] : cryptomatteCollisions(names(cryptomatte.aov)))
            messages.push_back(fmt::format("{}: \"{}\" and \"{}\" have the same id and share a matte",
                                           aovInfo(cryptomatte.aov).channels[0], a, b));
    return messages;
}

void AovSums::store(const PixelBounds& tile, std::string& bytes) const {
    for (int y = tile.y0; y < tile.y1; ++y)
        for (int x = tile.x0; x < tile.x1; ++x)
            storePixel(index(x, y), bytes);
}

bool AovSums::load(const PixelBounds& tile, std::string_view& bytes) {
    for (int y = tile.y0; y < tile.y1; ++y)
        for (int x = tile.x0; x < tile.x1; ++x)
            if (!loadPixel(index(x, y), bytes))
                return false;
    return true;
}

void AovSums::storePixel(size_t pixel, std::string& bytes) const {
    storeValue(sampleCounts[pixel], bytes);
    if (!nearest.empty()) {
        storeValue(distance2[pixel], bytes);
        storeValue(nearestSample[pixel], bytes);
        for (const Nearest& layer : nearest)
            for (size_t c = 0; c < layer.channels; ++c)
                storeValue(layer.values[pixel * layer.channels + c], bytes);
    }
    for (const Mean& mean : means)
        storeSum(mean.sums[pixel], bytes);
    for (const Cryptomatte& cryptomatte : cryptomattes) {
        const auto& entries = cryptomatte.counts[pixel].entries();
        storeValue(uint32_t(entries.size()), bytes);
        for (const CryptomatteCounts::Entry& entry : entries)
            storeValue(entry, bytes);
    }
}

bool AovSums::loadPixel(size_t pixel, std::string_view& bytes) {
    uint32_t samples = 0;
    if (!loadValue(samples, bytes) || (!nearest.empty() && !loadNearest(pixel, bytes)))
        return false;
    sampleCounts[pixel] += samples;
    for (Mean& mean : means)
        if (!loadSum(mean.sums[pixel], bytes))
            return false;
    for (Cryptomatte& cryptomatte : cryptomattes) {
        uint32_t count = 0;
        if (!loadValue(count, bytes))
            return false;
        for (CryptomatteCounts::Entry entry{}; count > 0; --count) {
            if (!loadValue(entry, bytes) || entry.name >= names(cryptomatte.aov).size())
                return false;
            cryptomatte.counts[pixel].add(entry.name, entry.samples);
        }
    }
    return true;
}

bool AovSums::loadNearest(size_t pixel, std::string_view& bytes) {
    float distance = 0;
    uint32_t sample = 0;
    if (!loadValue(distance, bytes) || !loadValue(sample, bytes))
        return false;
    const bool isNearer = std::pair(distance, sample) < std::pair(distance2[pixel], nearestSample[pixel]);
    if (isNearer) {
        distance2[pixel] = distance;
        nearestSample[pixel] = sample;
    }
    for (Nearest& layer : nearest) {
        for (size_t c = 0; c < layer.channels; ++c) {
            float value = 0;
            if (!loadValue(value, bytes))
                return false;
            if (isNearer)
                layer.values[pixel * layer.channels + c] = value;
        }
    }
    return true;
}

void storeSum(const PixelAccumulator& sum, std::string& bytes) {
    bytes.resize(bytes.size() + PixelAccumulator::kBytes);
    sum.store(bytes.data() + bytes.size() - PixelAccumulator::kBytes);
}

bool loadSum(PixelAccumulator& sum, std::string_view& bytes) {
    if (bytes.size() < PixelAccumulator::kBytes)
        return false;
    PixelAccumulator more;
    more.load(bytes.data());
    sum.add(more);
    bytes.remove_prefix(PixelAccumulator::kBytes);
    return true;
}

} // namespace strobe
