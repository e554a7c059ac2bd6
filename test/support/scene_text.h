// Parses scene texts in tests; temporary folders.
#pragma once

#include "core/util/diagnostics.h"
#include "loader/parser/parser.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <string>
#include <vector>

namespace strobe::test {

/// The result of parsing a text.
struct Parsed {
    SceneDescription scene;
    std::vector<std::string> warnings;
    std::string error; ///< formatted; empty: none
};

/// Parses a text. `name`: the file name in diagnostics, whose extension selects the mode.
inline Parsed parseString(const std::string& text, const std::string& name = "t.scene") {
    Parsed result;
    Diagnostics diagnostics([&](const std::string& m) { result.warnings.push_back(m); });
    try {
        result.scene = parseText(text, name, {"supersample", "msaa", "msaa-cache"}, diagnostics);
    } catch (const Error& e) {
        result.error = formatDiagnostic(e.location, "error", e.what());
    }
    return result;
}

/// Parses a text that must have no error.
inline SceneDescription parseGood(const std::string& text, const std::string& name = "t.scene") {
    Parsed result = parseString(text, name);
    EXPECT_EQ(result.error, "") << text;
    return std::move(result.scene);
}

/// A wrong scene, and the location and the text of its message.
struct MessageCase {
    std::string text;
    int line, column;
    std::string message;
};

/// Returns "FILE:LINE:COLUMN: SEVERITY: MESSAGE", the line of the text, and a caret under the column.
inline std::string formatted(const MessageCase& expected, const std::string& severity = "error",
                             const std::string& file = "t.scene") {
    size_t begin = 0;
    for (int i = 1; i < expected.line; ++i)
        begin = expected.text.find('\n', begin) + 1;
    std::string line = expected.text.substr(begin, expected.text.find('\n', begin) - begin);
    for (char& c : line)
        c = c < ' ' || c > '~' ? '?' : c;
    return file + ':' + std::to_string(expected.line) + ':' + std::to_string(expected.column) + ": " +
           severity + ": " + expected.message + "\n  " + line + "\n  " +
           std::string(size_t(expected.column - 1), ' ') + '^';
}

/// An empty folder for the current test, which is removed at its end.
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
    /// Writes a file and returns its path.
    std::filesystem::path write(const std::string& name, const std::string& text) const {
        std::filesystem::create_directories((m_path / name).parent_path());
        std::ofstream(m_path / name, std::ios::binary) << text;
        return m_path / name;
    }

  private:
    std::filesystem::path m_path;
};

} // namespace strobe::test
