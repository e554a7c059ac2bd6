#include "core/util/resource_policy.h"

#include "support/image_files.h"

#include <fstream>

namespace strobe {
namespace {

class GuardTest : public ImageFiles {
  protected:
    void SetUp() override {
        fs::create_directories(m_root / "job/deep");
        fs::create_directories(m_root / "job2");
        std::ofstream(m_root / "job/a.ply") << "a";
        std::ofstream(m_root / "job2/b.ply") << "b";
        fs::create_symlink(m_root / "job2/b.ply", m_root / "job/link.ply");
    }
    bool admits(const ResourcePolicy& guard, const fs::path& file) const {
        try {
            return guard.authorizeRead(file, {}) == fs::weakly_canonical(file);
        } catch (const Error& e) {
            EXPECT_EQ(std::string(e.what()), "file \"" + file.string() +
                                                 "\" must not be read: it is outside of what --sandbox "
                                                 "allows");
            return false;
        }
    }
    const fs::path& m_root = m_folder;
};

TEST_F(GuardTest, AllowsAllWithoutRoots) {
    EXPECT_EQ(ResourcePolicy().authorizeRead("../x", {}), "../x");
    EXPECT_FALSE(ResourcePolicy().restrictsFiles());
    EXPECT_NO_THROW(ResourcePolicy().requireMemory(1000, "it", "do less", {}));
    EXPECT_THROW(ResourcePolicy().requireMemory(UINT64_MAX, "it", "do less", {}),
                 Error); // more than any machine has
}

TEST_F(GuardTest, AllowsRootsAndWhatIsBelow) {
    const ResourcePolicy guard({{m_root / "job/deep/.."}, 0});
    for (const char* file : {"job", "job/a.ply", "job/none.ply", "job/deep/../a.ply", "job2/../job/a.ply"})
        EXPECT_TRUE(admits(guard, m_root / file)) << file;
    for (const char* file :
         {"", "job2", "job2/b.ply", "job/link.ply", "job/../job2/b.ply", "job/../none", "jo"})
        EXPECT_FALSE(admits(guard, m_root / file)) << file;
    EXPECT_FALSE(admits(guard, "a.ply"));
    EXPECT_FALSE(admits(guard, "/"));
}

TEST_F(GuardTest, RootsMayBeFilesAndSeveral) {
    const ResourcePolicy guard({{m_root / "job/deep", m_root / "job/link.ply"}, 0});
    EXPECT_TRUE(admits(guard, m_root / "job/link.ply"));
    EXPECT_TRUE(admits(guard, m_root / "job2/b.ply"));
    EXPECT_FALSE(admits(guard, m_root / "job/a.ply"));
    EXPECT_THROW(ResourcePolicy({{m_root / "none"}, 0}), Error);
}

TEST_F(GuardTest, KnowsWhatItAdmitted) {
    for (const ResourcePolicy::Settings& settings :
         {ResourcePolicy::Settings(), ResourcePolicy::Settings{{m_root}, 0}}) {
        const ResourcePolicy guard(settings);
        guard.authorizeRead(m_root / "job/link.ply", {});
        guard.authorizeRead(m_root / "job/none.ply", {});
        EXPECT_TRUE(guard.hasAuthorized(m_root / "job/link.ply"));
        EXPECT_TRUE(guard.hasAuthorized(m_root / "job/../job2/b.ply")) << "the link leads there";
        EXPECT_FALSE(guard.hasAuthorized(m_root / "job/a.ply"));
        EXPECT_FALSE(guard.hasAuthorized(m_root / "job/none.ply")) << "it is not there";
    }
    const ResourcePolicy none;
    none.authorizeRead(m_root / "job/a.ply", {});
    EXPECT_FALSE(none.hasAuthorized(m_root / "job/a.ply"));
}

TEST(Memory, IsRefusedBeyondTheLimit) {
    const uint64_t held = residentBytes();
    ASSERT_GT(held, 1000000u);
    const ResourcePolicy guard({{}, held + 100'000'000});
    EXPECT_NO_THROW(guard.requireMemory(10'000'000, "it", "do less", {}));
    for (const uint64_t bytes : {uint64_t(200'000'000), UINT64_MAX})
        EXPECT_THROW(guard.requireMemory(bytes, "it", "do less", {}), Error);
    try {
        guard.requireMemory(3'200'000'000, "the mesh", "simplify it", {});
        FAIL();
    } catch (const Error& e) {
        const std::string text = e.what();
        EXPECT_TRUE(text.starts_with("the mesh would take 3.2 GB more, with ")) << text;
        EXPECT_TRUE(text.ends_with("; simplify it")) << text;
    }
    EXPECT_THROW(ResourcePolicy({{}, 1}).requireMemory(0, "it", "do less", {}), Error)
        << "there is more already";
}

} // namespace
} // namespace strobe
