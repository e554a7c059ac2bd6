// Cryptomatte ids, compared with the examples of the specification 1.2.0 and with the manifests of its sample
// images, which other renderers wrote.
#include "core/film/cryptomatte.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstring>

namespace strobe {
namespace {

// "plane" in Russian, as UTF-8
const char* const kPlane = "\xd1\x80\xd0\xb0\xd0\xb2\xd0\xbd\xd0\xb8\xd0\xbd\xd0\xb0";

TEST(Cryptomatte, HashesEqualTheSpecification) {
    EXPECT_EQ(murmur3("torus"), 4053562365u);
    EXPECT_EQ(murmur3(kPlane), 2518896926u);
    EXPECT_FLOAT_EQ(std::bit_cast<float>(cryptomatteId("torus")), -1.54943624832e+30f);
    EXPECT_FLOAT_EQ(std::bit_cast<float>(cryptomatteId(kPlane)), -1.31926312124e-25f);
    EXPECT_EQ(cryptomatteId("bunny"), 0x13851a76u);
    EXPECT_EQ(cryptomatteId("default"), 0x42c9679fu);
    EXPECT_EQ(murmur3(""), 0u);
}

TEST(Cryptomatte, IdsEqualThoseOfOtherRenderers) {
    const std::pair<const char*, uint32_t> known[] = {
        {"name containing a \"quote\"  ", 0xaf8bfa09},
        {"name_containing/slash", 0xb0a04231},
        {"name, with, comma", 0x62fa4db8},
        {"sphere_?_2", 0x86de553a},
        {"default_111", 0xad58c73a},
        {"rect_[_top", 0xc1fa3f1f},
    };
    for (const auto& [name, id] : known)
        EXPECT_EQ(cryptomatteId(name), id) << name;
}

TEST(Cryptomatte, IdsAreNormalFloats) {
    // The bits of the first hash are a denormal number, those of the second a NaN.
    EXPECT_EQ(murmur3("flowerA.flowerA_petal11.:778"), 0x000586a5u);
    EXPECT_EQ(cryptomatteId("flowerA.flowerA_petal11.:778"), 0x008586a5u);
    EXPECT_EQ(murmur3("flowerA.flowerA_petal1.:1065"), 0x7f8e5296u);
    EXPECT_EQ(cryptomatteId("flowerA.flowerA_petal1.:1065"), 0x7f0e5296u);
    for (int i = 0; i < 10000; ++i)
        EXPECT_TRUE(std::isnormal(std::bit_cast<float>(cryptomatteId("name" + std::to_string(i)))));
}

TEST(Cryptomatte, MetadataHasTheManifest) {
    const Metadata metadata = cryptomatteMetadata("uCryptoWildcard", {"torus", kPlane, "a \"b\"/c"});
    const std::string key = "cryptomatte/2ae4678/"; // as V-Ray wrote it
    const Metadata expected = {
        {key + "name", "uCryptoWildcard"},
        {key + "hash", "MurmurHash3_32"},
        {key + "conversion", "uint32_to_float32"},
        {key + "manifest",
         std::string(R"({"a \"b\"/c":"b85726e8","torus":"f19c73fd",")") + kPlane + R"(":"9623511e"})"}};
    EXPECT_EQ(metadata, expected);
    for (const auto& [name, value] : cryptomatteMetadata("CryptoMaterial", {}))
        EXPECT_LT(name.size(), 32u) << "old versions of OpenEXR limit the length";
    // A name that is not UTF-8 is accepted.
    EXPECT_NO_THROW(cryptomatteMetadata("CryptoObject", {"\xff\xfe"}));
}

TEST(Cryptomatte, CollisionsAreReported) {
    EXPECT_TRUE(cryptomatteCollisions({"a", "b", "a"}).empty());
    // Among 300,000 names, two almost surely have the same 32 bits.
    std::vector<std::string> names;
    for (int i = 0; i < 300000; ++i)
        names.push_back("n" + std::to_string(i));
    const auto collisions = cryptomatteCollisions(names);
    ASSERT_FALSE(collisions.empty());
    for (const auto& [a, b] : collisions) {
        EXPECT_NE(a, b);
        EXPECT_EQ(cryptomatteId(a), cryptomatteId(b));
    }
}

TEST(Cryptomatte, IdsAreRankedByCoverage) {
    CryptomatteCounts counts;
    const std::vector<uint32_t> ids = {0x3f800000, 0x40000000, 0x40400000, 0x40800000}; // 1, 2, 3, 4
    for (const uint32_t name : {3, 0, 2, 3, 2, 3, 1})
        counts.add(name);
    float out[8];
    counts.rank(ids, 8, 4, out);
    const float expected[] = {4, 3.f / 8, 3, 2.f / 8, 1, 1.f / 8, 2, 1.f / 8};
    EXPECT_EQ(0, std::memcmp(out, expected, sizeof(out)));
    counts.rank(ids, 8, 2, out); // only the two largest
    EXPECT_EQ(out[2], 3);
    CryptomatteCounts().rank(ids, 8, 4, out);
    for (const float v : out)
        EXPECT_EQ(v, 0);
}

} // namespace
} // namespace strobe
