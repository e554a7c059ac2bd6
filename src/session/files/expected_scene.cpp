#include "session/files/expected_scene.h"

#include "core/util/error.h"
#include "core/util/version.h"
#include "session/files/part.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <fstream>

namespace strobe {

namespace {

struct ExpectedScene {
    std::string version;
    SceneHashes hashes;
};

/// Returns none if the text has another format.
std::optional<ExpectedScene> parse(std::istream& text) {
    const nlohmann::json j = nlohmann::json::parse(text, nullptr, false);
    try {
        ExpectedScene expected;
        j.at("version").get_to(expected.version);
        const auto& content = j.at("content");
        const auto number = [](const std::string& digits) { return std::stoull(digits, nullptr, 16); };
        expected.hashes.scene = number(content.at("hash"));
        for (const auto& [name, hash] :
             content.at("files").get<std::vector<std::pair<std::string, std::string>>>())
            expected.hashes.files.emplace_back(name, number(hash));
        return expected;
    } catch (const std::exception&) { // of nlohmann::json and std::stoull
        return {};
    }
}

} // namespace

void checkExpectedScene(const std::filesystem::path& stats, const SceneHashes& hashes) {
    const auto fail = [&](const std::string& problem) {
        throw Error("--expect " + stats.string() + ": " + problem, ErrorKind::Usage);
    };
    std::ifstream file(stats);
    if (!file)
        fail("cannot read");
    const auto expected = parse(file);
    if (!expected)
        fail("it is not a file of --stats");
    if (expected->version != version())
        fail(fmt::format("it was written by strobe {}, not {}", expected->version, version()));
    if (expected->hashes.scene != hashes.scene)
        fail("the scene is another one: " + changedFiles(expected->hashes.files, hashes.files));
}

} // namespace strobe
