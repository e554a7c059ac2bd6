#include "core/params/params.h"
#include "core/util/resource_policy.h"

#include <fmt/format.h>

#include <cstdlib>
#include <optional>

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

/// The first of the places where there is a file, as it is to be opened; empty: there is none. Where the
/// guard has something against a place, it is not even looked at.
fs::path firstFile(const std::vector<fs::path>& places, const Location& where) {
    std::optional<Error> refused;
    for (const fs::path& place : places)
        try {
            fs::path file = resourcePolicyOf(where).authorizeRead(place, where);
            std::error_code ignored;
            if (isFile(file) && !fs::is_regular_file(file, ignored))
                throw Error(where, fmt::format("\"{}\" is not a regular file", place.string()));
            if (isFile(file))
                return file;
        } catch (const Error& e) {
            refused = refused ? refused : e;
        }
    if (refused)
        throw *refused;
    return {};
}

fs::path resolveInScenes(const std::string& name, const Location& where) {
    const std::string rest = name.substr(kScenesPrefix.size());
    const char* variable = std::getenv("STROBE_SCENES");
    std::vector<fs::path> places =
        variable && *variable ? std::vector<fs::path>{variable} : sharedScenes(where);
    for (fs::path& place : places)
        place /= rest;
    if (fs::path file = firstFile(places, where); !file.empty())
        return file;
    if (places.empty())
        throw Error(where, fmt::format("file \"{}\" not found: set the environment variable STROBE_SCENES to "
                                       "the folder that holds the scenes",
                                       name));
    throw Error(where,
                fmt::format("file \"{}\" not found; looked for \"{}\"", name, places.front().string()));
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
    if (fs::path file = firstFile(places, where); !file.empty())
        return file;
    std::string looked;
    for (const fs::path& place : places)
        looked += (looked.empty() ? "\"" : " and \"") + place.string() + '"';
    throw Error(where, fmt::format("file \"{}\" not found; looked for {}", name, looked));
}

} // namespace strobe
