#include "session/outputs.h"

#include "core/image/image_library.h"
#include "core/util/atomic_file.h"
#include "core/util/standard_files.h"

#include <charconv>

namespace strobe {

namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& file, const std::string& reason) {
    throw Error("cannot write \"" + file.string() + "\": " + reason, ErrorKind::Output);
}

std::vector<fs::path> outputFiles(const RenderOptions& options) {
    const OutputOptions& output = options.output;
    std::vector<fs::path> files = output.images;
    for (const auto& file : {output.stats, output.heatmap, output.samples, options.progressive.errorCurve})
        if (!file.empty())
            files.push_back(file);
    return files;
}

void checkWritable(const fs::path& file) {
    checkWriteAtomically(file);
    if (const auto format = imageFormatOf(file); format && format != ImageFormat::Exr)
        imageLibrary(); // throws if it cannot be loaded
}

/// Creates the folder of a file, and the folders above it.
void makeFolder(const fs::path& file) {
    std::error_code error;
    fs::create_directories(file.parent_path(), error);
    if (error)
        fail(file, error.message());
}

bool isSameFile(const fs::path& a, const fs::path& b) {
    if (isStandardStream(a) || isStandardStream(b))
        return isStandardStream(a) && isStandardStream(b);
    std::error_code errorOfA, errorOfB, ignored;
    // Of relative names, weakly_canonical needs a folder that exists.
    const fs::path canonicalA = fs::weakly_canonical(fs::absolute(a, ignored), errorOfA);
    const fs::path canonicalB = fs::weakly_canonical(fs::absolute(b, ignored), errorOfB);
    return (!errorOfA && !errorOfB && canonicalA == canonicalB) || fs::equivalent(a, b, ignored);
}

constexpr const char* kUnfinished = "strobe:unfinished";
constexpr const char* kSampleCount = "strobe:sampleCount";

/// Returns the number of samples in the film; 0 if it does not keep sums.
uint64_t sampleCount(const Film& film) {
    uint64_t count = 0;
    for (const PixelAccumulator& sum : film.sums())
        count += sum.validCount() + uint64_t(sum.invalidCount());
    return count;
}

fs::path separateFile(const fs::path& image) {
    return image.parent_path() / (image.stem().string() + ".unfinished" + image.extension().string());
}

} // namespace

OutputSettings outputSettings(const ImageOptions& options, int threads) {
    OutputSettings settings{options.exposure.value_or(0), {}, options.exr, threads};
    if (!options.view.isDefault())
        settings.view = options.color->view(options.view);
    settings.exr.colorSpace = options.color->workingSpace();
    return settings;
}

void addViewMetadata(const ImageOptions& options, Metadata& metadata) {
    for (const auto& [name, value] : {std::pair("display", options.view.display),
                                      {"view", options.view.view},
                                      {"look", options.view.look}})
        if (!value.empty())
            metadata.emplace_back(std::string("strobe:") + name, value);
    if (const float exposure = options.exposure.value_or(0); exposure != 0)
        metadata.emplace_back("strobe:exposure", fmt::format("{}", exposure)); // PNGs store text only
}

RenderOptions withDefaultImage(RenderOptions options, const std::string& sceneOutput, const Log& log) {
    if (!options.output.images.empty() || options.output.noImage)
        return options;
    fs::path image = sceneOutput;
    if (!options.resources.roots.empty() && !image.empty()) {
        log.warn("--sandbox: the output name in the scene, \"{}\", is ignored", image.string());
        image.clear();
    }
    const fs::path& scene = options.scenes.front();
    if (image.empty())
        image = (isStandardStream(scene) ? "image" : scene.stem().string()) + ".exr";
    if (!imageFormatOf(image)) {
        log.warn("\"{}\" is not a supported kind of image file; writing .exr instead", image.string());
        image.replace_extension(".exr");
    }
    options.output.images = {image};
    return options;
}

void checkOutputFiles(const std::vector<fs::path>& files, bool makeFolders) {
    for (size_t i = 0; i < files.size(); ++i)
        for (size_t k = 0; k < i; ++k)
            if (isSameFile(files[i], files[k]))
                throw Error("\"" + files[i].string() + "\" is to be written twice", ErrorKind::Usage);
    for (const fs::path& file : files) {
        if (makeFolders && file.has_parent_path())
            makeFolder(file);
        checkWritable(file);
    }
}

void checkOutputFiles(const RenderOptions& options) {
    checkOutputFiles(outputFiles(options), options.output.makeFolders);
}

void checkOutputsAreNotInputs(const RenderOptions& options, const ResourcePolicy& policy) {
    const fs::path& reference = options.progressive.reference;
    for (const fs::path& file : outputFiles(options)) {
        if (policy.hasAuthorized(file))
            fail(file, "the scene reads it");
        if (!reference.empty() && isSameFile(file, reference))
            fail(file, "--reference reads it");
    }
}

void checkOutputsAreNotInputs(const MergeOptions& options) {
    for (const fs::path& image : options.images)
        for (const fs::path& part : options.parts)
            if (isSameFile(image, part))
                throw Error("\"" + image.string() + "\" is a part to merge: choose another name",
                            ErrorKind::Usage);
}

void warnOfClampedValues(const fs::path& image, size_t clamped, const Log& log) {
    if (clamped > 0)
        log.warn("{}: {} values beyond 65504, the largest half float, were clamped to it; --exr float keeps "
                 "them",
                 image.string(), clamped);
}

std::optional<fs::path> UnfinishedImages::fileFor(const fs::path& image, const Film& film) {
    if (isStandardStream(image))
        return std::nullopt;
    const uint64_t samples = sampleCount(film);
    if (mayReplace(image, samples))
        return *m_own.insert(image).first;
    const fs::path separate = separateFile(image);
    const bool isWritten = (samples > 0 || film.sums().empty()) && mayReplace(separate, samples);
    if (m_kept.insert(image).second)
        m_log.warn("{} is kept; {}", image.string(),
                   isWritten ? "the unfinished image is " + separate.string() : "this render has less");
    if (!isWritten)
        return std::nullopt;
    m_separate.insert(separate);
    return *m_own.insert(separate).first;
}

/// Whether an unfinished image with this number of samples may replace the file.
bool UnfinishedImages::mayReplace(const fs::path& file, uint64_t samples) const {
    std::error_code ignored; // of a name that is not there
    if (m_own.contains(file) || !fs::exists(file, ignored))
        return true;
    if (readMetadata(file, kUnfinished).empty())
        return false;
    const std::string text = readMetadata(file, kSampleCount);
    uint64_t existing = 0;
    std::from_chars(text.data(), text.data() + text.size(), existing);
    return existing <= samples;
}

void UnfinishedImages::removeSeparate() {
    std::error_code ignored; // the user may have moved them
    for (const fs::path& file : m_separate)
        fs::remove(file, ignored);
}

void UnfinishedImages::addMetadata(const Film& film, Metadata& metadata) {
    metadata.emplace_back(kSampleCount, std::to_string(sampleCount(film)));
}

} // namespace strobe
