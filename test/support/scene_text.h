// Helpers of the scene language's tests.
#pragma once

#include "loader/parser/parser.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <string>
#include <vector>

namespace strobe::test {

/// What parsing a text gave.
struct Parsed {
    SceneDescription scene;
    std::vector<std::string> warnings;
    std::string error; ///< formatted; empty when there was none
};

inline Parsed parseString(const std::string& text, const std::string& name = "t.scene") {
    Parsed result;
    Diagnostics messages([&](const std::string& m) { result.warnings.push_back(m); });
    try {
        result.scene = parseText(text, name, {"supersample", "msaa", "msaa-cache"}, messages);
    } catch (const Error& e) {
        result.error = formatDiagnostic(e.location, "error", e.what());
    }
    return result;
}

/// Parses what must be right.
inline SceneDescription parseGood(const std::string& text, const std::string& name = "t.scene") {
    Parsed result = parseString(text, name);
    EXPECT_EQ(result.error, "") << text;
    return std::move(result.scene);
}

/// A folder of its own for a test, empty at first and removed at the end.
class TemporaryFolder {
  public:
    TemporaryFolder() {
        const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
        m_path =
            std::filesystem::temp_directory_path() / (std::string("strobe-") + info->test_suite_name() + "-" +
                                                      info->name() + "-" + std::to_string(::getpid()));
        std::filesystem::remove_all(m_path);
        std::filesystem::create_directories(m_path);
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(m_path, ignored);
    }
    const std::filesystem::path& path() const { return m_path; }
    std::filesystem::path write(const std::string& name, const std::string& text) const {
        std::filesystem::create_directories((m_path / name).parent_path());
        std::ofstream(m_path / name, std::ios::binary) << text;
        return m_path / name;
    }

  private:
    std::filesystem::path m_path;
};

} // namespace strobe::test
