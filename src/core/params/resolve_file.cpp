#include "core/params/params.h"
#include "core/util/file_bytes.h"
#include "core/util/resource_policy.h"

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>
#include <optional>

namespace strobe {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kScenesPrefix = "$STROBE_SCENES/";

bool isFile(const fs::path& path) {
    std::error_code ignored; // an unreadable file counts as absent
    return fs::exists(path, ignored) && !fs::is_directory(path, ignored);
}

/// Returns the existing directories `shared/scenes` in the directory of the source and its parents, the
/// nearest first. A checkout keeps fetched scenes there.
std::vector<fs::path> sharedScenes(const Location& where) {
    std::error_code ignored;
    fs::path directory = where ? where.source->path.parent_path() : fs::path();
    directory = fs::absolute(directory.empty() ? "." : directory, ignored).lexically_normal();
    std::vector<fs::path> directories;
    for (;; directory = directory.parent_path()) {
        if (const fs::path shared = directory / "shared" / "scenes"; fs::is_directory(shared, ignored))
            directories.push_back(shared);
        if (directory.empty() || directory == directory.parent_path())
            return directories;
    }
}

/// Throws if the file is a pointer of Git LFS.
void refuseLfsPointer(const fs::path& file, const Location& where) {
    char beginning[32] = {};
    std::ifstream(file, std::ios::binary).read(beginning, sizeof(beginning) - 1);
    if (isLfsPointer(beginning))
        throw Error(where, fmt::format("\"{}\" {}", file.string(), kLfsPointerMessage));
}

/// Returns the first of `candidates` that is an existing file and may be read, in the form of authorizeRead;
/// an empty path if none exists. Candidates that may not be read are not accessed; if no other candidate
/// exists, throws the error of the first of them. A candidate that is not a regular file is treated the same.
fs::path firstFile(const std::vector<fs::path>& candidates, const Location& where) {
    std::optional<Error> firstError;
    for (const fs::path& candidate : candidates)
        try {
            fs::path file = resourcePolicyOf(where).authorizeRead(candidate, where);
            std::error_code ignored;
            if (isFile(file) && !fs::is_regular_file(file, ignored))
                throw Error(where, fmt::format("\"{}\" is not a regular file", candidate.string()));
            if (!isFile(file))
                continue;
            refuseLfsPointer(file, where);
            return file;
        } catch (const Error& e) {
            firstError = firstError ? firstError : e;
        }
    if (firstError)
        throw *firstError;
    return {};
}

fs::path resolveInScenes(const std::string& name, const Location& where) {
    const std::string rest = name.substr(kScenesPrefix.size());
    const char* variable = std::getenv("STROBE_SCENES");
    std::vector<fs::path> candidates =
        variable && *variable ? std::vector<fs::path>{variable} : sharedScenes(where);
    for (fs::path& candidate : candidates)
        candidate /= rest;
    if (fs::path file = firstFile(candidates, where); !file.empty())
        return file;
    if (candidates.empty())
        throw Error(where, fmt::format("file \"{}\" not found: set the environment variable STROBE_SCENES to "
                                       "the directory that contains the scenes",
                                       name));
    throw Error(where,
                fmt::format("file \"{}\" not found; looked for \"{}\"", name, candidates.front().string()));
}

} // namespace

fs::path resolveFile(const std::string& name, const Location& where) {
    if (name.empty())
        throw Error(where, "the file name is empty");
    if (name.find('\0') != std::string::npos)
        throw Error(where, "the file name contains a zero byte");
    if (name.compare(0, kScenesPrefix.size(), kScenesPrefix) == 0)
        return resolveInScenes(name, where);
    std::vector<fs::path> candidates;
    if (fs::path(name).is_absolute() || !where) {
        candidates = {name};
    } else {
        candidates = {(where.source->path.parent_path() / name).lexically_normal()};
        if (const fs::path second = (where.source->mainDirectory / name).lexically_normal();
            second != candidates[0])
            candidates.push_back(second);
    }
    if (fs::path file = firstFile(candidates, where); !file.empty())
        return file;
    std::string tried;
    for (const fs::path& candidate : candidates)
        tried += (tried.empty() ? "\"" : " and \"") + candidate.string() + '"';
    throw Error(where, fmt::format("file \"{}\" not found; looked for {}", name, tried));
}

} // namespace strobe
