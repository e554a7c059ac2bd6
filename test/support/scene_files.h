// The scene files that tests render.
#pragma once

#include "core/util/diagnostics.h"
#include "support/render_text.h"
#include "support/scene_data.h"

#include <algorithm>
#include <fstream>
#include <sstream>

namespace strobe::test {

inline const std::filesystem::path kSource = STROBE_SOURCE_DIR;

/// Returns the files of a folder with an extension, sorted; none if the folder does not exist.
inline std::vector<std::filesystem::path> filesIn(const std::filesystem::path& folder,
                                                  const std::string& extension) {
    std::vector<std::filesystem::path> files;
    std::error_code ignored; // the folder may not exist
    for (const auto& entry : std::filesystem::directory_iterator(folder, ignored))
        if (entry.path().extension() == extension)
            files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

inline const char* const kPaperScenes[] = {"bunny", "killeroo-simple", "anim-killeroos-moving",
                                           "anim-moving-reflection"};

/// Returns the scenes of the repository, and those of the paper whether they exist or not.
inline std::vector<std::filesystem::path> allScenes() {
    std::vector<std::filesystem::path> all;
    for (const char* folder : {"scenes", "scenes/lessons", "scenes/stress", "scenes/paper"})
        for (const std::filesystem::path& file : filesIn(kSource / folder, ".scene"))
            all.push_back(file);
    for (const char* name : kPaperScenes)
        all.push_back(pbrtFolder() / (std::string(name) + ".pbrt"));
    return all;
}

/// Returns a message about the data that a scene lacks, or an empty string.
inline std::string missing(const std::filesystem::path& scene) {
    std::stringstream text;
    text << std::ifstream(scene).rdbuf();
    const bool usesPaperScenes =
        scene.extension() == ".pbrt" || text.str().find("$STROBE_SCENES") != std::string::npos;
    if (usesPaperScenes && !std::filesystem::exists(pbrtFolder()))
        return "the paper's scenes are missing: set STROBE_SCENES";
    if (text.str().find("\"geometry/") != std::string::npos &&
        !std::filesystem::exists(kSource / "scenes/geometry/version"))
        return "scenes/geometry is missing: run tools/make-geometry";
    return "";
}

inline BuiltScene buildFile(const std::filesystem::path& file, const BuildOptions& options) {
    Diagnostics quiet;
    return buildScene(parseFiles({file}, {"supersample"}, quiet), options, quiet);
}

/// Returns options for a quarter of the width and height, and four samples per pixel.
inline BuildOptions fourthOfSize() {
    BuildOptions options;
    options.quick = true;
    options.samplesPerPixel = 4;
    return options;
}

/// Returns the file name as an identifier, for names of parameterized tests.
inline std::string testName(const std::filesystem::path& file) {
    std::string name = file.filename().string();
    std::replace_if(
        name.begin(), name.end(), [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
    return name;
}

} // namespace strobe::test
