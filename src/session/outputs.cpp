#include "session/outputs.h"

#include "core/image/image_library.h"

#include <cerrno>
#include <cstring>

#include <unistd.h>

namespace strobe {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& file, const std::string& why) {
    throw Error("cannot write \"" + file.string() + "\": " + why, ErrorKind::Output);
}

std::vector<fs::path> outputsOf(const Options& options) {
    std::vector<fs::path> files = options.outputs;
    for (const auto& file : {options.statsFile, options.heatmapFile, options.samplesFile, options.curveFile})
        if (!file.empty())
            files.push_back(file);
    return files;
}

void checkWritable(const fs::path& file) {
    const fs::path folder = file.has_parent_path() ? file.parent_path() : ".";
    if (access(folder.c_str(), W_OK | X_OK) != 0)
        fail(file, std::strerror(errno));
    if (fs::is_directory(file))
        fail(file, "it is a folder");
    if (file.extension() == ".png")
        imageLibrary();
}

bool isSame(const fs::path& a, const fs::path& b) {
    std::error_code first, second, ignored;
    const fs::path placeOfA = fs::weakly_canonical(a, first), placeOfB = fs::weakly_canonical(b, second);
    return (!first && !second && placeOfA == placeOfB) || fs::equivalent(a, b, ignored);
}

} // namespace

Options withOutput(Options options, const std::string& scenesOwn, spdlog::logger& log) {
    if (!options.outputs.empty())
        return options;
    fs::path path = scenesOwn;
    if (!options.guard.roots.empty() && !path.empty()) {
        log.warn("with --sandbox, scenes do not say where pictures go: \"{}\" is ignored", path.string());
        path.clear();
    }
    if (path.empty())
        path = options.scenes.front().stem().string() + ".exr";
    if (path.extension() != ".exr" && path.extension() != ".png") {
        log.warn("\"{}\" is not a kind of file written here; writing .exr instead", path.string());
        path.replace_extension(".exr");
    }
    options.outputs = {path};
    return options;
}

void checkOutputs(const std::vector<fs::path>& files) {
    for (size_t i = 0; i < files.size(); ++i)
        for (size_t k = 0; k < i; ++k)
            if (isSame(files[i], files[k]))
                throw Error("\"" + files[i].string() + "\" is to be written twice", ErrorKind::Usage);
    for (const fs::path& file : files)
        checkWritable(file);
}

void checkOutputs(const Options& options) { checkOutputs(outputsOf(options)); }

void checkNotRead(const Options& options, const ResourcePolicy& guard) {
    for (const fs::path& file : outputsOf(options)) {
        if (guard.hasAuthorized(file))
            fail(file, "the scene reads it");
        if (!options.reference.empty() && isSame(file, options.reference))
            fail(file, "--reference reads it");
    }
}

void warnOfClamped(const fs::path& output, size_t clamped, spdlog::logger& log) {
    if (clamped > 0)
        log.warn("{}: {} values beyond 65504 became that, the largest half float; --exr float keeps them",
                 output.string(), clamped);
}

} // namespace strobe
