#include "session/fallback_writer.h"
#include "session_fixture.h"

#include "core/util/atomic_file.h"

#include <cstdlib>

namespace strobe::test {
namespace {

class FallbackWriterTest : public SessionTest {
  protected:
    FallbackWriterTest() {
        std::filesystem::create_directory(path("spare"));
        setenv("TMPDIR", path("spare").c_str(), 1);
    }
    ~FallbackWriterTest() override { unsetenv("TMPDIR"); }
};

TEST_F(FallbackWriterTest, WritesUnderTheOwnNameIfPossible) {
    FallbackWriter writer(log);
    EXPECT_TRUE(writer.write(path("a.txt"), [](const auto& file) { writeFileAtomically(file, "text"); }));
    EXPECT_TRUE(writer.wroteAll());
    EXPECT_TRUE(exists("a.txt"));
    EXPECT_TRUE(messages.empty());
}

TEST_F(FallbackWriterTest, WritesToOneNewFolderOtherwise) {
    FallbackWriter writer(log);
    for (const char* name : {"none/a.txt", "none/b.txt"})
        EXPECT_FALSE(writer.write(path(name), [](const auto& file) { writeFileAtomically(file, "text"); }));
    EXPECT_FALSE(writer.wroteAll());
    const std::filesystem::path folder = std::filesystem::directory_iterator(path("spare"))->path();
    for (const char* name : {"a.txt", "b.txt"}) {
        EXPECT_TRUE(std::filesystem::exists(folder / name));
        EXPECT_TRUE(hasMessage(LogLevel::Error,
                               std::string("SAVED INSTEAD: ") + name + " is in " + (folder / name).string()));
    }
}

TEST_F(FallbackWriterTest, OtherErrorsPass) {
    FallbackWriter writer(log);
    EXPECT_EQ(usageError([&] {
                  writer.write(path("a.txt"), [](const auto&) { throw Error("no", ErrorKind::Usage); });
              }),
              "no");
}

} // namespace
} // namespace strobe::test
