#include "session/files/part_header.h"

#include <nlohmann/json.hpp>

#include <limits>

namespace strobe {

namespace {

using Json = nlohmann::ordered_json;

Json toJson(const PixelBounds& bounds) { return {bounds.x0, bounds.x1, bounds.y0, bounds.y1}; }

/// Returns -1, which isConsistent rejects, for anything but a non-negative int: the library would convert
/// any number, even one that does not fit an int.
int integerFrom(const Json& j) {
    constexpr uint64_t kMax = std::numeric_limits<int>::max();
    return j.is_number_unsigned() && j.get<uint64_t>() <= kMax ? j.get<int>() : -1;
}
/// Returns 0 for anything but a non-negative integer.
uint64_t hashFrom(const Json& j) { return j.is_number_unsigned() ? j.get<uint64_t>() : 0; }
PixelBounds pixelBoundsFrom(const Json& j) {
    return {integerFrom(j.at(0)), integerFrom(j.at(2)), integerFrom(j.at(1)), integerFrom(j.at(3))};
}

/// Returns each name as an array of bytes: names may be invalid UTF-8, which JSON cannot hold.
Json namesToJson(const std::vector<std::string>& names) {
    Json out = Json::array();
    for (const std::string& name : names)
        out.push_back(std::vector<uint8_t>(name.begin(), name.end()));
    return out;
}

std::vector<std::string> namesFrom(const Json& json) {
    std::vector<std::string> names;
    for (const Json& bytes : json) {
        std::string& name = names.emplace_back();
        for (const Json& byte : bytes)
            name += char(integerFrom(byte));
    }
    return names;
}

Json toJson(const AovLayout& layout) {
    Json aovs = Json::array();
    for (const Aov aov : layout.aovs)
        aovs.push_back(aovInfo(aov).name);
    return {{"names", aovs},
            {"cryptomatteEntries", layout.cryptoLevels},
            {"objects", namesToJson(layout.objectNames)},
            {"materials", namesToJson(layout.materialNames)},
            {"lightGroups", namesToJson(layout.lightGroups)}};
}

/// Returns a layout with 0 Cryptomatte entries, which isConsistent rejects, if it contradicts itself.
AovLayout layoutFrom(const Json& json) {
    AovLayout layout;
    layout.cryptoLevels = integerFrom(json.at("cryptomatteEntries"));
    layout.objectNames = namesFrom(json.at("objects"));
    layout.materialNames = namesFrom(json.at("materials"));
    layout.lightGroups = namesFrom(json.at("lightGroups"));
    for (const Json& name : json.at("names")) {
        const AovInfo* info = findAov(name.get<std::string>());
        if (!info || layout.cryptoLevels < 1 || layout.cryptoLevels > 200)
            return {{}, 0};
        layout.aovs.push_back(info->aov);
    }
    return layout;
}

Json toJson(const PartSlices& slices) {
    return {{"edge", slices.tiles.edge}, {"count", slices.tiles.count}, {"numbers", slices.numbers}};
}

/// `window`: of the part.
PartSlices slicesFrom(const Json& json, const PixelBounds& window) {
    PartSlices slices{{window, integerFrom(json.at("edge")), uint32_t(integerFrom(json.at("count")))}, {}};
    for (const Json& number : json.at("numbers"))
        slices.numbers.push_back(uint32_t(integerFrom(number)));
    return slices;
}

PartHeader headerFrom(const Json& json) {
    PartHeader part;
    for (const auto& [name, value] : json.at("key").items())
        part.key.emplace_back(name, value.get<std::string>());
    if (json.contains("files"))
        for (const Json& entry : json.at("files"))
            part.files.emplace_back(entry.at(0).get<std::string>(), hashFrom(entry.at(1)));
    part.fullWidth = integerFrom(json.at("frame").at(0));
    part.fullHeight = integerFrom(json.at("frame").at(1));
    part.samplesPerPixel = integerFrom(json.at("samplesPerPixel"));
    part.pixelBounds = pixelBoundsFrom(json.at("window"));
    if (json.contains("slices"))
        part.slices = slicesFrom(json.at("slices"), part.pixelBounds);
    if (json.contains("aovs"))
        part.layout = layoutFrom(json.at("aovs"));
    return part;
}

} // namespace

std::string partHeaderToJson(const PartHeader& part) {
    Json header;
    for (const auto& [name, value] : part.key)
        header["key"][name] = value;
    for (const auto& [name, hash] : part.files)
        header["files"].push_back({name, hash});
    header["frame"] = {part.fullWidth, part.fullHeight};
    header["samplesPerPixel"] = part.samplesPerPixel;
    header["window"] = toJson(part.pixelBounds);
    if (part.slices)
        header["slices"] = toJson(*part.slices);
    if (!part.layout.aovs.empty())
        header["aovs"] = toJson(part.layout);
    return header.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::optional<PartHeader> partHeaderFromJson(std::string_view text) {
    try {
        return headerFrom(Json::parse(text));
    } catch (const Json::exception&) {
        return std::nullopt;
    }
}

std::string boxesToBytes(const std::vector<SampleBox>& boxes) {
    std::string bytes;
    for (const SampleBox& box : boxes) {
        storeValue(box.pixelBounds, bytes);
        storeValue(box.samples, bytes);
    }
    static_assert(sizeof(PixelBounds) + sizeof(SampleSlice) == kBoxBytes);
    return bytes;
}

std::optional<std::vector<SampleBox>> boxesFromBytes(std::string_view bytes) {
    std::vector<SampleBox> boxes;
    while (!bytes.empty()) {
        SampleBox& box = boxes.emplace_back();
        if (!loadValue(box.pixelBounds, bytes) || !loadValue(box.samples, bytes))
            return std::nullopt;
    }
    return boxes;
}

} // namespace strobe
