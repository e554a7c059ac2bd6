#include "session/files/part_file.h"

#include "core/math/hash.h"
#include "core/util/atomic_file.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <fstream>
#include <limits>
#include <map>

namespace strobe {

namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr std::string_view kFirstLine = "strobe part 3\n";
constexpr size_t kChecksumLine = 17;    ///< length in bytes: 16 hexadecimal digits and a line end
constexpr int kMaxResolution = 1 << 16; ///< pixels along a side

[[noreturn]] void fail(const fs::path& file, const std::string& reason) {
    throw Error(file.string() + ": " + reason, ErrorKind::Usage);
}

std::string checksum(std::string_view bytes) {
    uint64_t h = hashOf(bytes.size());
    for (; !bytes.empty(); bytes.remove_prefix(std::min<size_t>(8, bytes.size()))) {
        uint64_t word = 0;
        std::memcpy(&word, bytes.data(), std::min<size_t>(8, bytes.size()));
        h = hashCombine(h, word);
    }
    return fmt::format("{:016x}", h);
}

Json toJson(const PixelBounds& bounds) { return {bounds.x0, bounds.x1, bounds.y0, bounds.y1}; }

/// Returns -1, which isConsistent rejects, for anything but a non-negative int: the library would convert
/// any number, even one that does not fit an int.
int integerFrom(const Json& j) {
    constexpr uint64_t kMax = std::numeric_limits<int>::max();
    return j.is_number_unsigned() && j.get<uint64_t>() <= kMax ? j.get<int>() : -1;
}
/// Returns no size that fits into a file for anything but a non-negative integer.
uint64_t sizeFrom(const Json& j) {
    return j.is_number_unsigned() ? j.get<uint64_t>() : std::numeric_limits<uint64_t>::max();
}
PixelBounds pixelBoundsFrom(const Json& j) {
    return {integerFrom(j.at(0)), integerFrom(j.at(2)), integerFrom(j.at(1)), integerFrom(j.at(3))};
}
SampleSlice sliceFrom(const Json& j) {
    return {uint32_t(integerFrom(j.at(0))), uint32_t(integerFrom(j.at(1)))};
}

size_t pixelCount(const PixelBounds& bounds) { return size_t(bounds.width()) * size_t(bounds.height()); }

size_t indexIn(const PixelBounds& bounds, int x, int y) {
    return size_t(y - bounds.y0) * size_t(bounds.width()) + size_t(x - bounds.x0);
}

bool isInside(const PixelBounds& inner, const PixelBounds& outer) {
    return inner.x0 >= outer.x0 && inner.y0 >= outer.y0 && inner.x1 <= outer.x1 && inner.y1 <= outer.y1 &&
           inner.x0 < inner.x1 && inner.y0 < inner.y1;
}

/// Whether the header does not contradict itself, and sizes are within limits.
bool isConsistent(const RenderPart& part) {
    if (part.fullWidth < 1 || part.fullHeight < 1 || part.fullWidth > kMaxResolution ||
        part.fullHeight > kMaxResolution || part.samplesPerPixel < 1 || part.boxes.empty() ||
        !isInside(part.pixelBounds, {0, 0, part.fullWidth, part.fullHeight}))
        return false;
    const auto isValid = [&](const PixelBounds& bounds, const SampleSlice& samples) {
        return isInside(bounds, part.pixelBounds) && samples.first < samples.end &&
               samples.end <= uint32_t(part.samplesPerPixel);
    };
    const auto isValidRecord = [&](const FilmRecord& record) {
        return isValid(record.pixels, record.samples);
    };
    return std::all_of(part.boxes.begin(), part.boxes.end(),
                       [&](const SampleBox& box) { return isValid(box.pixelBounds, box.samples); }) &&
           std::all_of(part.records.begin(), part.records.end(), isValidRecord) &&
           std::all_of(part.layers.begin(), part.layers.end(), isValidRecord);
}

/// A header, and the sizes of the records in bytes. The records have no bytes yet.
struct Header {
    RenderPart part;
    std::vector<uint64_t> recordSizes, layerSizes;
};

Json toJson(const std::vector<FilmRecord>& records) {
    Json out = Json::array();
    for (const FilmRecord& record : records)
        out.push_back({{"window", toJson(record.pixels)},
                       {"samples", {record.samples.first, record.samples.end}},
                       {"bytes", record.bytes->size()}});
    return out;
}

void readRecordHeaders(const Json& json, std::vector<FilmRecord>& records, std::vector<uint64_t>& sizes) {
    for (const Json& record : json) {
        records.push_back({pixelBoundsFrom(record.at("window")), sliceFrom(record.at("samples")), {}});
        sizes.push_back(sizeFrom(record.at("bytes")));
    }
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

/// Returns a layout with 0 Cryptomatte entries if it contradicts itself.
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

Header fromJson(const Json& header) {
    Header out;
    RenderPart& part = out.part;
    for (const auto& [name, value] : header.at("key").items())
        part.key.emplace_back(name, value.get<std::string>());
    if (header.contains("files"))
        for (const Json& entry : header.at("files"))
            part.files.emplace_back(entry.at(0).get<std::string>(), sizeFrom(entry.at(1)));
    part.fullWidth = integerFrom(header.at("frame").at(0));
    part.fullHeight = integerFrom(header.at("frame").at(1));
    part.samplesPerPixel = integerFrom(header.at("samplesPerPixel"));
    part.pixelBounds = pixelBoundsFrom(header.at("window"));
    for (const Json& box : header.at("boxes"))
        part.boxes.push_back({pixelBoundsFrom(box.at("window")), sliceFrom(box.at("samples"))});
    readRecordHeaders(header.at("records"), part.records, out.recordSizes);
    if (header.contains("aovs")) {
        part.layout = layoutFrom(header.at("aovs"));
        readRecordHeaders(header.at("layers"), part.layers, out.layerSizes);
    }
    return out;
}

/// Removes the bytes of the records from the front of `bytes`. Returns false if there are too few.
bool readRecords(std::string_view& bytes, const std::vector<uint64_t>& sizes,
                 std::vector<FilmRecord>& records) {
    for (size_t i = 0; i < sizes.size(); ++i) {
        if (sizes[i] > bytes.size())
            return false;
        records[i].bytes = std::make_shared<const std::string>(bytes.substr(0, sizes[i]));
        bytes.remove_prefix(sizes[i]);
    }
    return true;
}

bool overlap(const SampleBox& a, const SampleBox& b) {
    return a.pixelBounds.x0 < b.pixelBounds.x1 && b.pixelBounds.x0 < a.pixelBounds.x1 &&
           a.pixelBounds.y0 < b.pixelBounds.y1 && b.pixelBounds.y0 < a.pixelBounds.y1 &&
           a.samples.first < b.samples.end && b.samples.first < a.samples.end;
}

/// Calls add(x, y, sum) for each pixel.
template <class Add>
void forEachPixel(const RenderPart& part, const Add& add) {
    const PixelBounds& bounds = part.pixelBounds;
    for (int y = bounds.y0; y < bounds.y1; ++y)
        for (int x = bounds.x0; x < bounds.x1; ++x)
            add(x, y, part.sums[indexIn(bounds, x, y)]);
}

void addSums(RenderPart& to, const RenderPart& from) {
    forEachPixel(from, [&](int x, int y, const PixelAccumulator& sum) {
        to.sums[indexIn(to.pixelBounds, x, y)].add(sum);
    });
}

/// Returns which files of the scenes differ.
std::string changedFiles(const RenderPart& part, const RenderPart& more) {
    const std::map<std::string, uint64_t> now(part.files.begin(), part.files.end()),
        before(more.files.begin(), more.files.end());
    std::string text;
    const auto add = [&](const std::string& name, const char* change) {
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, change);
    };
    for (const auto& [name, hash] : now)
        if (const auto it = before.find(name); it == before.end())
            add(name, "is new");
        else if (it->second != hash)
            add(name, "has changed");
    for (const auto& [name, hash] : before)
        if (!now.contains(name))
            add(name, "is no longer used");
    return text.empty() ? "a file has changed" : text;
}

/// Throws if the parts are of different renders.
void checkSameRender(const RenderPart& part, const RenderPart& more, const fs::path& file) {
    for (size_t i = 0; i < std::max(part.key.size(), more.key.size()); ++i) {
        if (i >= part.key.size() || i >= more.key.size() || part.key[i].first != more.key[i].first)
            fail(file, "it is a part of another render: the settings differ");
        if (part.key[i].second != more.key[i].second && part.key[i].first == RenderPart::kScene)
            fail(file, "it is a part of another scene: " + changedFiles(part, more));
        if (part.key[i].second != more.key[i].second)
            fail(file, fmt::format("it is a part of another render: {} is {}, not {}", part.key[i].first,
                                   more.key[i].second, part.key[i].second));
    }
    if (part.fullWidth != more.fullWidth || part.fullHeight != more.fullHeight)
        fail(file, fmt::format("it is a part of another render: the frame has {}x{} pixels, not {}x{}",
                               more.fullWidth, more.fullHeight, part.fullWidth, part.fullHeight));
    if (part.samplesPerPixel != more.samplesPerPixel)
        fail(file, fmt::format("it is a part of another render: pixels have {} samples, not {}",
                               more.samplesPerPixel, part.samplesPerPixel));
}

} // namespace

std::string RenderPart::keyValue(const std::string& name) const {
    const auto it =
        std::find_if(key.begin(), key.end(), [&](const auto& entry) { return entry.first == name; });
    return it == key.end() ? "" : it->second;
}

void writePart(const fs::path& file, const RenderPart& part) {
    Json header;
    for (const auto& [name, value] : part.key)
        header["key"][name] = value;
    for (const auto& [name, hash] : part.files)
        header["files"].push_back({name, hash});
    header["frame"] = {part.fullWidth, part.fullHeight};
    header["samplesPerPixel"] = part.samplesPerPixel;
    header["window"] = toJson(part.pixelBounds);
    for (const SampleBox& box : part.boxes)
        header["boxes"].push_back(
            {{"window", toJson(box.pixelBounds)}, {"samples", {box.samples.first, box.samples.end}}});
    header["records"] = toJson(part.records);
    if (!part.layout.aovs.empty()) {
        header["aovs"] = toJson(part.layout);
        header["layers"] = toJson(part.layers);
    }
    const std::string text = header.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
    const size_t start = kFirstLine.size() + kChecksumLine, sums = start + text.size();
    std::string bytes(kFirstLine);
    bytes.resize(start);
    bytes += text;
    bytes.resize(sums + part.sums.size() * PixelAccumulator::kBytes);
    for (size_t i = 0; i < part.sums.size(); ++i)
        part.sums[i].store(&bytes[sums + i * PixelAccumulator::kBytes]);
    for (const auto* records : {&part.records, &part.layers})
        for (const FilmRecord& record : *records)
            bytes += *record.bytes;
    bytes.replace(kFirstLine.size(), kChecksumLine, checksum(std::string_view(bytes).substr(start)) + '\n');
    writeFileAtomically(file, bytes);
}

RenderPart readPart(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    if (std::error_code ignored; fs::is_directory(file, ignored))
        fail(file, "it is a folder");
    if (!stream)
        fail(file, std::string("cannot read it: ") + std::strerror(errno));
    const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    return parsePart(bytes, file);
}

RenderPart parsePart(std::string_view bytes, const fs::path& file) {
    if (!bytes.starts_with(kFirstLine))
        fail(file, "it is not a part of a render");
    bytes.remove_prefix(kFirstLine.size());
    const std::string_view checksumLine = bytes.substr(0, std::min(kChecksumLine, bytes.size()));
    bytes.remove_prefix(checksumLine.size());
    const size_t headerEnd = bytes.find('\n');
    Header header;
    try {
        header = fromJson(Json::parse(bytes.substr(0, headerEnd)));
    } catch (const Json::exception&) {
        fail(file, "it is damaged");
    }
    RenderPart& part = header.part;
    if (headerEnd == std::string::npos || !isConsistent(part) || part.layout.cryptoLevels == 0)
        fail(file, "it is damaged");
    const std::string_view sums = bytes.substr(headerEnd + 1);
    const size_t sumBytes = pixelCount(part.pixelBounds) * PixelAccumulator::kBytes;
    std::string_view rest = sums.substr(std::min(sumBytes, sums.size()));
    if (sums.size() < sumBytes || !readRecords(rest, header.recordSizes, part.records) ||
        !readRecords(rest, header.layerSizes, part.layers) || !rest.empty())
        fail(file, "it is truncated or too long");
    if (checksumLine != checksum(bytes) + '\n')
        fail(file, "it is damaged");
    part.sums.resize(pixelCount(part.pixelBounds));
    for (size_t i = 0; i < part.sums.size(); ++i)
        part.sums[i].load(&sums[i * PixelAccumulator::kBytes]);
    return std::move(part);
}

void addPart(RenderPart& part, const RenderPart& more, const fs::path& file) {
    checkSameRender(part, more, file);
    for (const SampleBox& a : part.boxes)
        for (const SampleBox& b : more.boxes)
            if (overlap(a, b))
                fail(file, fmt::format("samples {}:{} of pixels {} {} {} {} overlap those of another file",
                                       b.samples.first, b.samples.end, b.pixelBounds.x0, b.pixelBounds.x1,
                                       b.pixelBounds.y0, b.pixelBounds.y1));
    if (!isInside(more.pixelBounds, part.pixelBounds)) {
        RenderPart grown = part;
        PixelBounds& bounds = grown.pixelBounds;
        bounds = {std::min(bounds.x0, more.pixelBounds.x0), std::min(bounds.y0, more.pixelBounds.y0),
                  std::max(bounds.x1, more.pixelBounds.x1), std::max(bounds.y1, more.pixelBounds.y1)};
        grown.sums.assign(pixelCount(bounds), {});
        addSums(grown, part);
        part = std::move(grown);
    }
    addSums(part, more);
    part.boxes.insert(part.boxes.end(), more.boxes.begin(), more.boxes.end());
    part.records.insert(part.records.end(), more.records.begin(), more.records.end());
    part.layers.insert(part.layers.end(), more.layers.begin(), more.layers.end());
}

void addToFilm(const RenderPart& part, Film& film) {
    forEachPixel(part, [&](int x, int y, const PixelAccumulator& sum) { film.add(x, y, sum); });
    for (const FilmRecord& record : part.records)
        film.records().add(record);
    for (const FilmRecord& record : part.layers)
        film.layerRecords().add(record);
    film.records().setNote(part.keyValue(RenderPart::kNote));
}

uint64_t missingSamples(const RenderPart& part) {
    uint64_t missing = 0;
    for (const PixelAccumulator& sum : part.sums)
        missing += uint64_t(part.samplesPerPixel) -
                   std::min(uint64_t(part.samplesPerPixel), uint64_t(sum.validCount()) + sum.invalidCount());
    return missing;
}

uint64_t invalidSamples(const std::vector<PixelAccumulator>& sums) {
    uint64_t count = 0;
    for (const PixelAccumulator& sum : sums)
        count += sum.invalidCount();
    return count;
}

} // namespace strobe
