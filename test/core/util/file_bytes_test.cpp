#include "core/util/file_bytes.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <fstream>
#include <unistd.h>

namespace strobe {
namespace {

namespace fs = std::filesystem;

class FileBytesTest : public testing::Test {
  protected:
    FileBytesTest() { fs::create_directories(m_folder); }
    ~FileBytesTest() override { fs::remove_all(m_folder); }

    fs::path write(const std::string& bytes) {
        std::ofstream(m_folder / "f", std::ios::binary) << bytes;
        return m_folder / "f";
    }
    /// Returns `bytes` compressed in gzip format.
    std::string packed(const std::string& bytes) {
        const fs::path path = m_folder / "packed";
        const gzFile file = gzopen(path.c_str(), "wb");
        gzwrite(file, bytes.data(), unsigned(bytes.size()));
        gzclose(file);
        std::ifstream in(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    std::string read(const std::string& bytes) { return std::string(readFileBytes(write(bytes)).view()); }
    /// Returns the error message of reading a file with these contents.
    std::string failure(const std::string& bytes) {
        try {
            return "no error; read " + std::to_string(read(bytes).size()) + " bytes";
        } catch (const std::runtime_error& e) {
            return e.what();
        }
    }

    const fs::path m_folder = fs::path(testing::TempDir()) / ("file-bytes-" + std::to_string(getpid()));
};

/// Returns random bytes, which gzip does not compress.
std::string noise(size_t size) {
    std::string s;
    for (uint32_t x = 1; s.size() < size; x = x * 1664525 + 1013904223)
        s += char(x >> 24);
    return s;
}

TEST_F(FileBytesTest, GzipFilesAreDecompressed) {
    for (const std::string& text :
         {std::string(), std::string("a"), std::string("ply\n"), noise(100000), std::string(3000000, 'x')}) {
        EXPECT_EQ(read(text), text);
        EXPECT_EQ(read(packed(text)), text) << text.size();
    }
    EXPECT_EQ(read(packed("one ") + packed("two")), "one two");     // the result of `cat a.gz b.gz`
    EXPECT_EQ(read(packed("one") + std::string(512, '\0')), "one"); // trailing padding
}

TEST_F(FileBytesTest, DamagedGzipFilesAreErrors) {
    const std::string good = packed(noise(1000) + std::string(100000, 'y'));
    for (size_t size = 2; size < good.size(); ++size)
        EXPECT_EQ(failure(good.substr(0, size)), "the gzip data is truncated") << size;
    std::string wrong = good;
    wrong[good.size() - 8] ^= 1; // the checksum
    EXPECT_EQ(failure(wrong), "the gzip data is damaged");
    wrong = good;
    wrong[2] ^= 1; // the method
    EXPECT_EQ(failure(wrong), "the gzip data is damaged");
}

TEST_F(FileBytesTest, DirectoriesAndMissingFilesAreErrors) {
    EXPECT_THROW(readFileBytes(m_folder), std::runtime_error);
    EXPECT_THROW(readFileBytes(m_folder / "none"), std::runtime_error);
}

} // namespace
} // namespace strobe
