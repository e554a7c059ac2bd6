#include "display/display_server.h"
#include "display/tev_message.h"

#include <gtest/gtest.h>

#include <thread>

namespace strobe {
namespace {

TEST(ViewerAddressTest, ParsesHostAndPort) {
    const auto text = [](const std::string& address) {
        const auto parsed = ViewerAddress::parse(address);
        return parsed ? parsed->host + " " + parsed->port : "none";
    };
    EXPECT_EQ(text("localhost"), "localhost 14158");
    EXPECT_EQ(text("localhost:99"), "localhost 99");
    EXPECT_EQ(text("[::1]"), "::1 14158");
    EXPECT_EQ(text("[::1]:65535"), "::1 65535");
    for (const char* address : {"", ":99", "host:0", "host:65536", "host:x", "[::1", "[::1]99"})
        EXPECT_EQ(text(address), "none") << address;
}

TEST(TevMessageTest, BeginsWithItsLength) {
    TevMessage message(TevMessage::CreateImage);
    message << std::string_view("a") << int32_t(258);
    const std::string expected("\x0b\0\0\0\x04"
                               "a\0\x02\x01\0\0",
                               11);
    EXPECT_EQ(std::move(message).bytes(), expected);
}

TEST(DisplayServerTest, ReportsAViewerThatIsMissingOnce) {
    const auto live = std::make_shared<LiveFilm>(Film(8, 8, {0, 0, 8, 8}));
    std::mutex mutex;
    std::vector<std::string> warnings;
    {
        // Port 9, "discard", refuses connections unless the machine has that service.
        const DisplayServer server({"127.0.0.1", "9"}, "image", live, std::chrono::milliseconds(200),
                                   [&](const std::string& text) {
                                       const std::lock_guard lock(mutex);
                                       warnings.push_back(text);
                                   });
        std::this_thread::sleep_for(std::chrono::milliseconds(300));
    }
    if (warnings.empty())
        GTEST_SKIP() << "a server listens on port 9";
    EXPECT_EQ(warnings,
              std::vector<std::string>{"no connection to the viewer at 127.0.0.1:9: Connection refused"});
}

} // namespace
} // namespace strobe
