// The scene files that tests render.
#pragma once

#include "support/render_text.h"
#include "support/scene_data.h"

#include <algorithm>
#include <fstream>
#include <sstream>

namespace strobe::test {

inline const std::filesystem::path kSource = STROBE_SOURCE_DIR;

inline std::vector<std::filesystem::path> filesIn(const std::filesystem::path& folder,
                                                  const std::string& extension) {
    std::vector<std::filesystem::path> files;
    std::error_code ignored; // a folder that is not there has no files
    for (const auto& entry : std::filesystem::directory_iterator(folder, ignored))
        if (entry.path().extension() == extension)
            files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

inline const char* const kPaperScenes[] = {"bunny", "killeroo-simple", "anim-killeroos-moving",
                                           "anim-moving-reflection"};

/// Those of the repository and the paper's originals, present or not.
inline std::vector<std::filesystem::path> allScenes() {
    std::vector<std::filesystem::path> all;
    for (const char* folder : {"scenes", "scenes/lessons", "scenes/stress", "scenes/paper"})
        for (const std::filesystem::path& file : filesIn(kSource / folder, ".scene"))
            all.push_back(file);
    for (const char* name : kPaperScenes)
        all.push_back(pbrtFolder() / (std::string(name) + ".pbrt"));
    return all;
}

/// What the scene lacks, or an empty string.
inline std::string missing(const std::filesystem::path& scene) {
    std::stringstream text;
    text << std::ifstream(scene).rdbuf();
    const bool borrows =
        scene.extension() == ".pbrt" || text.str().find("$STROBE_SCENES") != std::string::npos;
    if (borrows && !std::filesystem::exists(pbrtFolder()))
        return "the paper's scenes are not here: set STROBE_SCENES";
    if (text.str().find("\"geometry/") != std::string::npos &&
        !std::filesystem::exists(kSource / "scenes/geometry/version"))
        return "scenes/geometry is not made: run tools/make-geometry";
    return "";
}

inline BuiltScene buildFile(const std::filesystem::path& file, const BuildOptions& options) {
    Diagnostics quiet;
    return buildScene(parseFiles({file}, {"supersample"}, quiet), options, quiet);
}

/// A quarter of the resolution, four samples.
inline BuildOptions fourthOfSize() {
    BuildOptions options;
    options.quick = true;
    options.samplesPerPixel = 4;
    return options;
}

/// A parameter's name in a test's name.
inline std::string testName(const std::filesystem::path& file) {
    std::string name = file.filename().string();
    std::replace_if(
        name.begin(), name.end(), [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
    return name;
}

} // namespace strobe::test
