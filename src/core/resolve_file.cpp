#include "core/params.h"

#include <fmt/format.h>

#include <cstdlib>

namespace strobe {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kScenesPrefix = "$STROBE_SCENES/";

bool isFile(const fs::path& path) {
    std::error_code ignored; // unreadable is as good as absent: the message lists the place
    return fs::exists(path, ignored) && !fs::is_directory(path, ignored);
}

/// `shared/scenes` of each directory from the scene file's upwards: where a checkout keeps borrowed scenes.
std::vector<fs::path> sharedScenes(const Location& where) {
    std::error_code ignored;
    fs::path directory = where ? where.source->path.parent_path() : fs::path();
    directory = fs::absolute(directory.empty() ? "." : directory, ignored).lexically_normal();
    std::vector<fs::path> places;
    for (;; directory = directory.parent_path()) {
        if (const fs::path place = directory / "shared" / "scenes"; fs::is_directory(place, ignored))
            places.push_back(place);
        if (directory.empty() || directory == directory.parent_path())
            return places;
    }
}

fs::path resolveInScenes(const std::string& name, const Location& where) {
    const std::string rest = name.substr(kScenesPrefix.size());
    const char* variable = std::getenv("STROBE_SCENES");
    const std::vector<fs::path> places =
        variable && *variable ? std::vector<fs::path>{variable} : sharedScenes(where);
    for (const fs::path& place : places)
        if (isFile(place / rest))
            return place / rest;
    if (places.empty())
        throw Error(where, fmt::format("file \"{}\" not found: set the environment variable STROBE_SCENES to "
                                       "the folder that holds the scenes",
                                       name));
    throw Error(where, fmt::format("file \"{}\" not found; looked for \"{}\"", name,
                                   (places.front() / rest).string()));
}

} // namespace

fs::path resolveFile(const std::string& name, const Location& where) {
    if (name.empty())
        throw Error(where, "the file name is empty");
    if (name.find('\0') != std::string::npos)
        throw Error(where, "the file name holds a zero byte");
    if (name.compare(0, kScenesPrefix.size(), kScenesPrefix) == 0)
        return resolveInScenes(name, where);
    std::vector<fs::path> places;
    if (fs::path(name).is_absolute() || !where) {
        places = {name};
    } else {
        places = {(where.source->path.parent_path() / name).lexically_normal()};
        if (const fs::path second = (where.source->mainDirectory / name).lexically_normal();
            second != places[0])
            places.push_back(second);
    }
    for (const fs::path& place : places)
        if (isFile(place))
            return place;
    std::string looked;
    for (const fs::path& place : places)
        looked += (looked.empty() ? "\"" : " and \"") + place.string() + '"';
    throw Error(where, fmt::format("file \"{}\" not found; looked for {}", name, looked));
}

} // namespace strobe
