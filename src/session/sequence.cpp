#include "session/sequence.h"

#include "core/image/image.h"
#include "core/math/hash.h"

#include <fmt/format.h>

#include <charconv>
#include <regex>

namespace strobe {

std::optional<Sequence> parseFrames(const std::string& text) {
    std::vector<int> numbers;
    const char *at = text.data(), *const end = at + text.size();
    while (numbers.size() < 3) {
        int number = 0;
        const auto [rest, error] = std::from_chars(at, end, number);
        if (error != std::errc())
            return std::nullopt;
        numbers.push_back(number);
        at = rest + (rest != end);
        if (rest == end || *rest != ':')
            break;
    }
    const bool isWhole = at == end && (text.empty() || text.back() != ':');
    Sequence s{numbers[0], numbers.size() > 1 ? numbers[1] : numbers[0], numbers.size() > 2 ? numbers[2] : 1};
    return isWhole && s.first <= s.last && s.step > 0 ? std::optional(s) : std::nullopt;
}

Shutter shutterOf(const Sequence& sequence, int frame) {
    return {float((frame + sequence.open) / sequence.fps), float((frame + sequence.close) / sequence.fps)};
}

std::filesystem::path numbered(const std::filesystem::path& file, int frame) {
    if (file.empty())
        return file;
    static const std::regex pattern("(#+)|%(0?)([0-9]?)d");
    const std::string name = file.filename().string();
    std::smatch found;
    if (!std::regex_search(name, found, pattern))
        return file.parent_path() /
               fmt::format("{}.{:04}{}", file.stem().string(), frame, file.extension().string());
    const int width = found[1].matched ? int(found[1].length()) : std::atoi(found[3].str().c_str());
    const bool zeros = found[1].matched || found[2].length() > 0;
    const std::string number =
        zeros ? fmt::format("{:0{}}", frame, width) : fmt::format("{:{}}", frame, width);
    return file.parent_path() / (found.prefix().str() + number + found.suffix().str());
}

Options optionsOfFrame(const Options& options, int frame, uint64_t content) {
    Options o = options;
    for (auto& output : o.outputs)
        output = numbered(output, frame);
    for (std::filesystem::path* file : {&o.statsFile, &o.heatmapFile, &o.samplesFile, &o.curveFile})
        *file = numbered(*file, frame);
    o.frame = frame;
    uint64_t key = hashOf(content, frame);
    for (const char c : options.command)
        key = hashCombine(key, uint8_t(c));
    o.frameKey = fmt::format("{:016x}", key);
    return o;
}

bool isFinished(const Options& frame) {
    for (const auto& file : {frame.statsFile, frame.heatmapFile, frame.samplesFile})
        if (std::error_code ignored; !file.empty() && !std::filesystem::exists(file, ignored))
            return false;
    return std::all_of(frame.outputs.begin(), frame.outputs.end(), [&](const std::filesystem::path& output) {
        return readMetadata(output, "strobe:frameKey") == frame.frameKey;
    });
}

} // namespace strobe
