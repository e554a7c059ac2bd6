#include "core/util/resource_policy.h"

#include "support/image_files.h"

#include <fstream>

namespace strobe {
namespace {

class ResourcePolicyTest : public ImageFiles {
  protected:
    void SetUp() override {
        fs::create_directories(m_root / "job/deep");
        fs::create_directories(m_root / "job2");
        std::ofstream(m_root / "job/a.ply") << "a";
        std::ofstream(m_root / "job2/b.ply") << "b";
        fs::create_symlink(m_root / "job2/b.ply", m_root / "job/link.ply");
    }
    /// Returns whether the policy allows to read `file`, and checks the path or the error.
    bool allows(const ResourcePolicy& policy, const fs::path& file) const {
        try {
            return policy.authorizeRead(file, {}) == fs::weakly_canonical(file);
        } catch (const Error& e) {
            EXPECT_EQ(std::string(e.what()), "cannot read file \"" + file.string() +
                                                 "\": it is outside the files and directories given to "
                                                 "--sandbox");
            return false;
        }
    }
    const fs::path& m_root = m_folder;
};

TEST_F(ResourcePolicyTest, AllowsAllFilesWithoutRoots) {
    EXPECT_EQ(ResourcePolicy().authorizeRead("../x", {}), "../x");
    EXPECT_FALSE(ResourcePolicy().restrictsFiles());
    EXPECT_NO_THROW(ResourcePolicy().requireMemory(1000, "it", "do less", {}));
    EXPECT_THROW(ResourcePolicy().requireMemory(UINT64_MAX, "it", "do less", {}),
                 Error); // more than any machine has
}

TEST_F(ResourcePolicyTest, AllowsFilesWithinTheRoots) {
    const ResourcePolicy policy({{m_root / "job/deep/.."}, 0});
    for (const char* file : {"job", "job/a.ply", "job/none.ply", "job/deep/../a.ply", "job2/../job/a.ply"})
        EXPECT_TRUE(allows(policy, m_root / file)) << file;
    for (const char* file :
         {"", "job2", "job2/b.ply", "job/link.ply", "job/../job2/b.ply", "job/../none", "jo"})
        EXPECT_FALSE(allows(policy, m_root / file)) << file;
    EXPECT_FALSE(allows(policy, "a.ply"));
    EXPECT_FALSE(allows(policy, "/"));
}

TEST_F(ResourcePolicyTest, RootsMayBeFilesAndDirectories) {
    const ResourcePolicy policy({{m_root / "job/deep", m_root / "job/link.ply"}, 0});
    EXPECT_TRUE(allows(policy, m_root / "job/link.ply"));
    EXPECT_TRUE(allows(policy, m_root / "job2/b.ply"));
    EXPECT_FALSE(allows(policy, m_root / "job/a.ply"));
    EXPECT_THROW(ResourcePolicy({{m_root / "none"}, 0}), Error);
}

TEST_F(ResourcePolicyTest, RecordsAuthorizedFiles) {
    for (const ResourcePolicy::Settings& settings :
         {ResourcePolicy::Settings(), ResourcePolicy::Settings{{m_root}, 0}}) {
        const ResourcePolicy policy(settings);
        policy.authorizeRead(m_root / "job/link.ply", {});
        policy.authorizeRead(m_root / "job/none.ply", {});
        EXPECT_TRUE(policy.hasAuthorized(m_root / "job/link.ply"));
        EXPECT_TRUE(policy.hasAuthorized(m_root / "job/../job2/b.ply")) << "the link refers to it";
        EXPECT_FALSE(policy.hasAuthorized(m_root / "job/a.ply"));
        EXPECT_FALSE(policy.hasAuthorized(m_root / "job/none.ply")) << "it does not exist";
    }
    const ResourcePolicy unrestricted;
    unrestricted.authorizeRead(m_root / "job/a.ply", {});
    EXPECT_FALSE(unrestricted.hasAuthorized(m_root / "job/a.ply"));
}

TEST(ResourcePolicyMemory, RequestsBeyondTheLimitAreErrors) {
    const uint64_t used = residentBytes();
    ASSERT_GT(used, 1000000u);
    const ResourcePolicy policy({{}, used + 100'000'000});
    EXPECT_NO_THROW(policy.requireMemory(10'000'000, "it", "do less", {}));
    for (const uint64_t bytes : {uint64_t(200'000'000), UINT64_MAX})
        EXPECT_THROW(policy.requireMemory(bytes, "it", "do less", {}), Error);
    try {
        policy.requireMemory(3'200'000'000, "the mesh", "simplify it", {});
        FAIL();
    } catch (const Error& e) {
        const std::string text = e.what();
        EXPECT_TRUE(text.starts_with("the mesh would take 3.2 GB more, with ")) << text;
        EXPECT_TRUE(text.ends_with("; simplify it")) << text;
    }
    EXPECT_THROW(ResourcePolicy({{}, 1}).requireMemory(0, "it", "do less", {}), Error)
        << "more memory is already in use";
}

} // namespace
} // namespace strobe
