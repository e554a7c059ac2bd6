#include "session/frame.h"

#include "core/image/image.h"
#include "core/math/hash.h"
#include "session/files/part.h"

#include <regex>

namespace strobe {

namespace fs = std::filesystem;

InterleavedTiles tilesOfSlices(const BuiltScene& built, uint32_t count) {
    const PixelBounds& window = built.pixelBounds;
    const uint64_t pixels = uint64_t(window.width()) * uint64_t(window.height());
    if (count > pixels)
        throw Error(fmt::format("--slice: there are {} slices of {} pixels", count, pixels),
                    ErrorKind::Usage);
    // Slices of many small tiles have about equal costs. Integrators that share light among pixels shade
    // points at the edges of tiles again in each slice, so that they get fewer and larger tiles.
    const bool sharesAmongPixels = built.integrator->biasBound(*built.scene).reachPixels > 0;
    return interleavedTiles(window, count, sharesAmongPixels ? 16 : 64);
}

Shutter shutterOf(const SequenceOptions& sequence, int frame) {
    return {float((frame + sequence.shutterOpen) / sequence.fps),
            float((frame + sequence.shutterClose) / sequence.fps)};
}

fs::path numberedFile(const fs::path& file, int frame) {
    if (file.empty())
        return file;
    static const std::regex pattern("(#+)|%(0?)([0-9]?)d");
    const std::string name = file.filename().string();
    std::smatch match;
    if (!std::regex_search(name, match, pattern))
        return file.parent_path() /
               fmt::format("{}.{:04}{}", file.stem().string(), frame, file.extension().string());
    const int width = match[1].matched ? int(match[1].length()) : std::atoi(match[3].str().c_str());
    const bool hasZeros = match[1].matched || match[2].length() > 0;
    const std::string number =
        hasZeros ? fmt::format("{:0{}}", frame, width) : fmt::format("{:{}}", frame, width);
    return file.parent_path() / (match.prefix().str() + number + match.suffix().str());
}

FrameJob frameJob(const RenderOptions& options, int frame, const SceneContent& content) {
    FrameJob job{options, content, frame, {}};
    OutputOptions& output = job.options.output;
    for (fs::path& image : output.images)
        image = numberedFile(image, frame);
    for (fs::path* file :
         {&output.stats, &output.heatmap, &output.samples, &job.options.progressive.errorCurve})
        *file = numberedFile(*file, frame);
    uint64_t key = hashOf(content.hash, frame);
    for (const char c : options.sequence->settings + options.output.format.color->contentHash())
        key = hashCombine(key, uint8_t(c));
    job.key = fmt::format("{:016x}", key);
    return job;
}

bool isFinished(const FrameJob& job) {
    const OutputOptions& output = job.options.output;
    const auto isMissing = [](const fs::path& file) {
        std::error_code ignored;
        return !file.empty() && !fs::exists(file, ignored);
    };
    // The readers of images take .3 s to load: they are not used for files that do not exist, and for parts.
    for (const auto& file : {output.stats, output.heatmap, output.samples})
        if (isMissing(file))
            return false;
    if (output.images.empty() || std::any_of(output.images.begin(), output.images.end(),
                                             [&](auto& image) { return isPart(image) || isMissing(image); }))
        return false;
    return std::all_of(output.images.begin(), output.images.end(), [&](const fs::path& image) {
        return readMetadata(image, "strobe:frameKey") == job.key;
    });
}

} // namespace strobe
