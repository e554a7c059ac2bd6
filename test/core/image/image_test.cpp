#include "core/image/texture_cache.h"

#include "core/util/atomic_file.h"
#include "support/image_files.h"

#include <OpenImageIO/imageio.h>

#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <sstream>
#include <sys/resource.h>
#include <thread>

namespace strobe {
namespace {

Image gradient(int width, int height) {
    Image image{width, height, {}};
    for (int i = 0; i < width * height; ++i)
        image.pixels.emplace_back(float(i % width) / width, float(i / width) / height, 3.5f * i);
    return image;
}

std::string fileContents(const fs::path& path) {
    std::ostringstream s;
    s << std::ifstream(path, std::ios::binary).rdbuf();
    return s.str();
}

void writeGray8(const fs::path& path, int width, int height, const std::vector<uint8_t>& values,
                int channels = 1) {
    const auto out = OIIO::ImageOutput::create(path.string());
    ASSERT_TRUE(out &&
                out->open(path.string(), OIIO::ImageSpec(width, height, channels, OIIO::TypeDesc::UINT8)));
    ASSERT_TRUE(out->write_image(OIIO::TypeDesc::UINT8, values.data()) && out->close());
}

TEST_F(ImageFiles, ExrFilesCanBeReadBack) {
    const Image image = gradient(7, 5);
    writeRgb(*this / "a.exr", image);
    const Image back = readImage(*this / "a.exr", {});
    ASSERT_EQ(back.width, 7);
    ASSERT_EQ(back.height, 5);
    for (size_t i = 0; i < image.pixels.size(); ++i)
        EXPECT_EQ(back.pixels[i], image.pixels[i]);
    EXPECT_EQ(fileCount(), 1u);
}

TEST_F(ImageFiles, PngFilesAreSrgb) {
    Image image{2, 1, {Rgb(0, .5f, 1), Rgb(-1, 2, .001f)}};
    writeImage(*this / "e.png", image, {{"Description", std::string("a test")}});
    const Image stored = readImage(*this / "e.png", {});
    EXPECT_EQ(std::lround(stored.at(0, 0).y * 255), 188);
    EXPECT_EQ(stored.at(0, 0).z, 1);
    EXPECT_EQ(stored.at(1, 0).x, 0);
    EXPECT_EQ(stored.at(1, 0).y, 1);
    EXPECT_NEAR(readImage(*this / "e.png", {}, {ColorEncoding::Srgb}).at(0, 0).y, .5f, .004f);
    const auto in = OIIO::ImageInput::open((*this / "e.png").string());
    EXPECT_EQ(in->spec().get_string_attribute("ImageDescription"), "a test");
}

TEST_F(ImageFiles, PngFilesHaveTheViewTransformApplied) {
    const ColorTransform twice = [](std::span<Rgb> colors) {
        for (Rgb& c : colors)
            c *= 2;
    };
    writeImage(*this / "r.png", Image{1, 1, {Rgb(.25f, .125f, 3)}}, {}, twice);
    const Rgb stored = readImage(*this / "r.png", {}).at(0, 0);
    EXPECT_EQ(
        Imath::V3i(std::lround(stored.x * 255), std::lround(stored.y * 255), std::lround(stored.z * 255)),
        Imath::V3i(128, 64, 255));
}

TEST_F(ImageFiles, ColorSpacesApplyToFloatFiles) {
    const ColorConfig config;
    writeRgb(*this / "s.exr", Image{1, 1, {Rgb(1, 0, 0)}});
    writeGray8(*this / "t.png", 1, 1, {255});
    const ColorEncoding acescg = ColorEncoding::fromSpace(config, "ACEScg", {});
    TextureCache cache;
    for (const char* name : {"s.exr", "t.png"}) {
        const Rgb read = readImage(*this / name, {}, acescg).at(0, 0);
        const Rgb found =
            cache.lookup(*cache.open(*this / name, {}, acescg), V2f(.5f), V2f(0), V2f(0), Wrap::Clamp);
        EXPECT_LT((read - found).length(), 1e-6f);
        EXPECT_LT((read - (name[0] == 's' ? Rgb(1.705051f, -.130256f, -.024003f) : Rgb(1))).length(), 1e-5f)
            << read;
    }
}

TEST_F(ImageFiles, GrayImagesHaveEqualChannels) {
    writeGray8(*this / "f.png", 2, 1, {0, 255});
    EXPECT_EQ(readImage(*this / "f.png", {}).at(1, 0), Rgb(1));
}

TEST_F(ImageFiles, UnreadableImagesAreErrors) {
    std::ofstream(*this / "g.exr") << "not an image";
    EXPECT_THROW(readImage(*this / "g.exr", {}), Error);
    EXPECT_THROW(readImage(*this / "none.exr", {}), Error);
    writeRgb(*this / "h.exr", gradient(64, 64));
    fs::resize_file(*this / "h.exr", fs::file_size(*this / "h.exr") / 2);
    EXPECT_THROW(readImage(*this / "h.exr", {}), Error);
}

/// Simulates a full disk: limits the size of files during its lifetime.
class FullDisk {
  public:
    explicit FullDisk(rlim_t bytes) {
        std::signal(SIGXFSZ, SIG_IGN);
        ::getrlimit(RLIMIT_FSIZE, &m_old);
        const rlimit limit{bytes, m_old.rlim_max};
        ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FullDisk() { ::setrlimit(RLIMIT_FSIZE, &m_old); }

  private:
    rlimit m_old{};
};

TEST_F(ImageFiles, FailedWritesKeepTheOldFile) {
    const fs::path exr = *this / "i.exr", png = *this / "i.png";
    std::ofstream(exr) << "precious";
    std::ofstream(png) << "precious";
    const Image image = gradient(50, 50);
    {
        const FullDisk full(100);
        try {
            writeRgb(exr, image);
            ADD_FAILURE() << "no error";
        } catch (const Error& e) {
            EXPECT_EQ(e.kind, ErrorKind::Output);
            EXPECT_NE(std::string(e.what()).find("i.exr"), std::string::npos);
        }
        EXPECT_THROW(writeImage(png, image, {}), Error);
    }
    EXPECT_EQ(fileContents(exr), "precious");
    EXPECT_EQ(fileContents(png), "precious");
    EXPECT_EQ(fileCount(), 2u);
    writeRgb(exr, image); // without the limit
    EXPECT_EQ(readImage(exr, {}).width, 50);
    EXPECT_EQ(fileCount(), 2u);
}

TEST_F(ImageFiles, AtomicWritesRequireARegularFile) {
    EXPECT_THROW(writeFileAtomically(m_folder, "x"), Error);
    EXPECT_THROW(writeFileAtomically(*this / "none/x", "x"), Error);
    EXPECT_THROW(writeFileAtomically("/dev/null", "x"), Error);
    EXPECT_TRUE(fs::is_character_file("/dev/null"));
    EXPECT_THROW(writeFileAtomically("", "x"), Error);
    EXPECT_EQ(fileCount(), 0u);
}

TEST_F(ImageFiles, AtomicWritesFollowSymbolicLinks) {
    std::ofstream(*this / "target") << "old";
    fs::create_symlink("target", *this / "link");
    writeFileAtomically(*this / "link", "new");
    EXPECT_TRUE(fs::is_symlink(*this / "link"));
    EXPECT_EQ(fileContents(*this / "target"), "new");
    const fs::path before = fs::current_path(); // tests a name without a directory
    fs::current_path(m_folder);
    writeFileAtomically("plain", "here");
    fs::current_path(before);
    EXPECT_EQ(fileContents(*this / "plain"), "here");
    EXPECT_EQ(fileCount(), 3u);
}

TEST_F(ImageFiles, LookupsWithoutFootprintAreBilinear) {
    const Image image = gradient(8, 4);
    writeRgb(*this / "j.exr", image);
    TextureCache cache;
    const auto file = cache.open(*this / "j.exr", {});
    const auto at = [&](float u, float v, Wrap wrap = Wrap::Repeat) {
        return cache.lookup(*file, V2f(u, v), V2f(0), V2f(0), wrap);
    };
    // v = 0 is the first row; texel centers lie at half integers.
    EXPECT_NEAR(at(1.5f / 8, .5f / 4).z, image.at(1, 0).z, 1e-4f);
    EXPECT_NEAR(at(6.5f / 8, 3.5f / 4).z, image.at(6, 3).z, 1e-4f);
    EXPECT_NEAR(at(2.25f / 8, 2.5f / 4).z, .25f * image.at(1, 2).z + .75f * image.at(2, 2).z, 1e-3f);
    EXPECT_NEAR(at(3, 1).x, (image.at(7, 0).x + image.at(0, 0).x) / 2, 1e-5f); // wraps around
    EXPECT_NEAR(at(1.5f / 8 - 4, .5f / 4 + 7).z, image.at(1, 0).z, 1e-3f);
    EXPECT_NEAR(at(-5, .5f / 4, Wrap::Clamp).z, image.at(0, 0).z, 1e-4f);
    EXPECT_EQ(at(-5, .5f, Wrap::Black), Rgb(0));
}

TEST_F(ImageFiles, LookupsWithLargeFootprintsReturnTheMean) {
    Image image{64, 64, {}};
    for (int i = 0; i < 64 * 64; ++i)
        image.pixels.push_back((i + i / 64) % 2 ? Rgb(2) : Rgb(0));
    writeRgb(*this / "k.exr", image);
    TextureCache cache;
    const auto file = cache.open(*this / "k.exr", {});
    for (const float u : {.1f, .37f, .8f})
        EXPECT_NEAR(cache.lookup(*file, V2f(u, .3f), V2f(.25f, 0), V2f(0, .25f), Wrap::Repeat).x, 1, .02f);
}

TEST_F(ImageFiles, TexturesAreDecodedBeforeTheyAreFiltered) {
    writeGray8(*this / "l.png", 2, 1, {0, 255, 0, 0, 255, 0},
               3); // two green texels
    writeGray8(*this / "m.png", 4, 4, {0, 255, 0, 255, 255, 0, 255, 0, 0, 255, 0, 255, 255, 0, 255, 0});
    TextureCache cache;
    const auto green = cache.open(*this / "l.png", {}, {ColorEncoding::Srgb});
    EXPECT_NEAR(cache.lookup(*green, V2f(.25f, .5f), V2f(0), V2f(0), Wrap::Clamp).y, 1, 1e-6f);
    const auto stored = cache.open(*this / "m.png", {}),
               linear = cache.open(*this / "m.png", {}, {ColorEncoding::Srgb});
    // Between black and white, both encodings give 1/2; filtering of encoded values would give .214.
    EXPECT_NEAR(cache.lookup(*linear, V2f(.5f, .125f), V2f(0), V2f(0), Wrap::Clamp).x, .5f, 1e-3f);
    EXPECT_NEAR(cache.lookup(*linear, V2f(.5f), V2f(1, 0), V2f(0, 1), Wrap::Repeat).x, .5f, 1e-2f);
    EXPECT_NEAR(cache.lookup(*stored, V2f(.5f, .125f), V2f(0), V2f(0), Wrap::Clamp).x, .5f, 1e-3f);

    writeGray8(*this / "n.png", 1, 1, {188});
    const auto value = [&](const ColorEncoding& encoding) {
        const auto file = cache.open(*this / "n.png", {}, encoding);
        return cache.lookup(*file, V2f(.5f), V2f(0), V2f(0), Wrap::Clamp).y;
    };
    EXPECT_NEAR(value({}), 188 / 255.f, 1e-5f);
    EXPECT_NEAR(value({ColorEncoding::Srgb}), decodeSrgb(188 / 255.f), 1e-5f);
    EXPECT_NEAR(value({ColorEncoding::Gamma, 2}), sqr(188 / 255.f), 1e-5f);
}

TEST_F(ImageFiles, FloatFilesAreDecodedOnlyIfTheEncodingAppliesToFloats) {
    writeRgb(*this / "o.exr", Image{1, 1, {Rgb(.5f)}});
    TextureCache cache;
    const auto value = [&](const ColorEncoding& encoding) {
        return cache.lookup(*cache.open(*this / "o.exr", {}, encoding), V2f(.5f), V2f(0), V2f(0), Wrap::Clamp)
            .x;
    };
    EXPECT_EQ(value({ColorEncoding::Srgb}), .5f);
    EXPECT_EQ(value({ColorEncoding::Gamma, 2}), .5f);
    EXPECT_NEAR(value({ColorEncoding::Gamma, 2, true}), .25f, 1e-6f);
}

TEST_F(ImageFiles, UnreadableTexturesAreErrors) {
    TextureCache cache;
    std::ofstream(*this / "p.png") << "no";
    for (const ColorEncoding& encoding : {ColorEncoding{}, ColorEncoding{ColorEncoding::Srgb}}) {
        EXPECT_THROW(cache.open(*this / "p.png", {}, encoding), Error);
        EXPECT_THROW(cache.open(*this / "none.png", {}, encoding), Error);
    }
}

TEST_F(ImageFiles, LookupsOnSeveralThreadsAgree) {
    const Image image = gradient(200, 150);
    writeRgb(*this / "q.exr", image);
    TextureCache cache(1);
    const auto file = cache.open(*this / "q.exr", {});
    std::vector<std::vector<Rgb>> results(4);
    std::vector<std::thread> threads;
    for (std::vector<Rgb>& out : results)
        threads.emplace_back([&] {
            for (int i = 0; i < 5000; ++i)
                out.push_back(cache.lookup(*file, V2f(i * .618f, i * .41f), V2f(0), V2f(0), Wrap::Repeat));
        });
    for (std::thread& t : threads)
        t.join();
    for (const auto& r : results)
        EXPECT_TRUE(r == results[0]);
}

TEST(Srgb, DecodeInvertsEncode) {
    EXPECT_NEAR(encodeSrgb(.5f), .7353569f, 1e-6f);
    EXPECT_NEAR(encodeSrgb(.002f), .02584f, 1e-6f);
    for (int i = 0; i <= 100; ++i)
        EXPECT_NEAR(decodeSrgb(encodeSrgb(i / 100.f)), i / 100.f, 1e-6f);
}

} // namespace
} // namespace strobe
