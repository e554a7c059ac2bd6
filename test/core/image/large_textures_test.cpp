#include "core/image/mip_layout.h"
#include "core/image/texture_cache.h"
#include "support/image_files.h"

#include <OpenImageIO/imageio.h>

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <thread>

namespace strobe {
namespace {

constexpr int kWidth = 2048, kHeight = 1024; // above the limit of small images

template <class T>
void writeStored(const fs::path& path, int width, int height, int channels, const std::vector<T>& values,
                 OIIO::TypeDesc type) {
    const auto out = OIIO::ImageOutput::create(path.string());
    ASSERT_TRUE(out && out->open(path.string(), OIIO::ImageSpec(width, height, channels, type)));
    ASSERT_TRUE(out->write_image(OIIO::BaseTypeFromC<T>::value, values.data()) && out->close());
}

/// Smooth values with noise, so that neighbors differ.
std::vector<uint8_t> pattern(int width, int height, int channels) {
    std::mt19937 random(7);
    std::vector<uint8_t> values;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < channels; ++c)
                values.push_back(
                    uint8_t((x * 255 / width + y * 127 / height + c * 40 + int(random() % 64)) % 256));
    return values;
}

struct Lookup {
    V2f uv, dx, dy;
};

/// Lookups of all sizes of footprints, within the image and outside.
std::vector<Lookup> lookups(int count) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> uniform(-2, 3), angle(0, 6.28f), level(-14, 0), aspect(0, 1);
    std::vector<Lookup> out;
    for (int i = 0; i < count; ++i) {
        const float a = angle(random), size = std::exp2(level(random)), thin = aspect(random);
        const V2f along(std::cos(a) * size, std::sin(a) * size), across(-along.y * thin, along.x * thin);
        out.push_back({V2f(uniform(random), uniform(random)), along, across});
        if (i % 4 == 0)
            out.back().dx = out.back().dy = V2f(0);
    }
    return out;
}

class LargeTextures : public ImageFiles {
  protected:
    void SetUp() override {
        ImageFiles::SetUp();
        writeStored(*this / "rgb.png", kWidth, kHeight, 3, pattern(kWidth, kHeight, 3),
                    OIIO::TypeDesc::UINT8);
    }
};

TEST_F(LargeTextures, KeepTheBytesOfTheirFile) {
    const auto cache = std::make_shared<TextureCache>();
    const auto file = cache->open(*this / "rgb.png", {}, {ColorEncoding::Srgb});
    cache->lookup(*file, V2f(.5f), V2f(0), V2f(0), Wrap::Repeat);
    const TextureStatistics statistics = cache->statistics();
    EXPECT_EQ(statistics.largeImages, 1u);
    EXPECT_EQ(statistics.largeImagesRead, 1u);
    EXPECT_EQ(statistics.smallImages, 0u);
    const uint64_t finest = uint64_t(kWidth) * kHeight * 3;
    EXPECT_GE(statistics.bytesInMemory, finest * 4 / 3 - 64);
    EXPECT_LE(statistics.bytesInMemory, finest * 4 / 3 + finest / 100);
    EXPECT_EQ(statistics.bytesInFiles, 0u);
}

TEST_F(LargeTextures, PointLookupsAreBilinearInDecodedTexels) {
    const auto cache = std::make_shared<TextureCache>();
    const auto file = cache->open(*this / "rgb.png", {}, {ColorEncoding::Srgb});
    const Image image = readImage(*this / "rgb.png", {}, {ColorEncoding::Srgb});
    std::mt19937 random(1);
    for (int i = 0; i < 1000; ++i) {
        const int x = int(random() % (kWidth - 1)), y = int(random() % (kHeight - 1));
        const V2f uv((float(x) + 1) / kWidth, (float(y) + .75f) / kHeight);
        const Rgb c = cache->lookup(*file, uv, V2f(0), V2f(0), Wrap::Clamp);
        const Rgb expected = (image.at(x, y) + image.at(x + 1, y)) * .375f +
                             (image.at(x, y + 1) + image.at(x + 1, y + 1)) * .125f;
        for (int k = 0; k < 3; ++k)
            ASSERT_NEAR(c[k], expected[k], 1e-3f);
    }
}

TEST_F(LargeTextures, AgreeWithOpenImageIo) {
    // The same image as a tiled file, which OpenImageIO filters.
    const std::vector<uint8_t> values = pattern(kWidth, kHeight, 3);
    OIIO::ImageSpec spec(kWidth, kHeight, 3, OIIO::TypeDesc::UINT8);
    spec.tile_width = spec.tile_height = 64;
    const auto out = OIIO::ImageOutput::create("tiff");
    ASSERT_TRUE(out && out->open((*this / "tiled.tif").string(), spec));
    ASSERT_TRUE(out->write_image(OIIO::TypeDesc::UINT8, values.data()) && out->close());
    const auto cache = std::make_shared<TextureCache>();
    const auto large = cache->open(*this / "rgb.png", {});
    const auto tiled = cache->open(*this / "tiled.tif", {});
    double worst = 0;
    for (const Wrap wrap : {Wrap::Repeat, Wrap::Clamp, Wrap::Mirror})
        for (const Lookup& l : lookups(500)) {
            const Rgb a = cache->lookup(*large, l.uv, l.dx, l.dy, wrap);
            const Rgb b = cache->lookupFiltered(*tiled, l.uv, l.dx, l.dy, wrap);
            for (int k = 0; k < 3; ++k)
                worst = std::max(worst, double(std::abs(a[k] - b[k])));
        }
    EXPECT_LT(worst, .02); // levels are rounded to 8 bits; OpenImageIO's probes differ slightly
    EXPECT_EQ(cache->statistics().tiledImages, 1u);
}

TEST_F(LargeTextures, ValuesDependOnNeitherTheLimitNorTheThreads) {
    const auto all = lookups(2000);
    const auto valuesOf = [&](int megabytes, int threads) {
        const auto cache = std::make_shared<TextureCache>(megabytes);
        const auto file = cache->open(*this / "rgb.png", {}, {ColorEncoding::Srgb});
        std::vector<Rgb> values(all.size());
        std::vector<std::thread> workers;
        for (int t = 0; t < threads; ++t)
            workers.emplace_back([&, t] {
                for (int round = 0; round < 3; ++round)
                    for (size_t i = size_t(t); i < all.size(); i += size_t(threads))
                        values[i] = cache->lookup(*file, all[i].uv, all[i].dx, all[i].dy, Wrap::Repeat);
            });
        for (std::thread& worker : workers)
            worker.join();
        const TextureStatistics statistics = cache->statistics();
        EXPECT_EQ(statistics.bytesInFiles > 0, megabytes == 1);
        // How much several threads read again depends on their order.
        if (threads == 1) {
            EXPECT_EQ(statistics.thrashes(), megabytes == 1);
        }
        EXPECT_EQ(statistics.pageBytesReadAgain > 0, megabytes == 1);
        return values;
    };
    const std::vector<Rgb> expected = valuesOf(100, 1);
    for (const int threads : {1, 4}) {
        const std::vector<Rgb> values = valuesOf(1, threads);
        ASSERT_EQ(std::memcmp(values.data(), expected.data(), values.size() * sizeof(Rgb)), 0);
    }
}

TEST_F(LargeTextures, SoALookupsEqualScalarLookups) {
    const auto cache = std::make_shared<TextureCache>();
    const auto file = cache->open(*this / "rgb.png", {}, {ColorEncoding::Srgb});
    const auto all = lookups(10 * kSoAWidth);
    for (const TextureOptions options :
         {TextureOptions{Wrap::Repeat, Wrap::Mirror}, TextureOptions{Wrap::Clamp, Wrap::Black},
          TextureOptions{Wrap::Repeat, Wrap::Repeat, true}})
        for (size_t first = 0; first < all.size(); first += kSoAWidth) {
            TexturePointSoA points;
            for (int i = 0; i < kSoAWidth; ++i) {
                points.uv.set(i, all[first + size_t(i)].uv);
                points.duvdx.set(i, all[first + size_t(i)].dx);
                points.duvdy.set(i, all[first + size_t(i)].dy);
            }
            RgbSoA out;
            cache->lookupSoA(*file, points, 0, kSoAWidth, options, out);
            for (int i = 0; i < kSoAWidth; ++i) {
                const Lookup& l = all[first + size_t(i)];
                ASSERT_EQ(out.at(i), cache->lookup(*file, l.uv, l.dx, l.dy, options));
            }
        }
}

TEST_F(LargeTextures, LookupsOfAnySizeAndPlaceAreFinite) {
    const auto cache = std::make_shared<TextureCache>();
    const auto file = cache->open(*this / "rgb.png", {}, {ColorEncoding::Srgb});
    const Rgb mean = cache->lookup(*file, V2f(.5f), V2f(2, 0), V2f(0, 2), Wrap::Repeat);
    for (const float far : {1e9f, -3e20f, kInfinity, std::nanf("")})
        for (const float size : {0.f, 1e5f, kInfinity}) {
            const Rgb c = cache->lookup(*file, V2f(far, .3f), V2f(size, 0), V2f(0, size), Wrap::Repeat);
            for (int k = 0; k < 3; ++k) {
                ASSERT_TRUE(c[k] >= 0 && c[k] <= 1);
                if (size > 0) {
                    ASSERT_NEAR(c[k], mean[k], .02f);
                }
            }
        }
    EXPECT_EQ(cache->lookup(*file, V2f(1.5f, .5f), V2f(0), V2f(0), Wrap::Black), Rgb(0));
}

TEST_F(LargeTextures, StoredTypesAreKept) {
    const size_t count = size_t(kWidth) * kHeight;
    writeStored(*this / "half.exr", kWidth, kHeight, 3, std::vector<float>(3 * count, 1.5f),
                OIIO::TypeDesc::HALF);
    writeStored(*this / "float.exr", kWidth, kHeight, 3, std::vector<float>(3 * count, 1.7f),
                OIIO::TypeDesc::FLOAT);
    writeStored(*this / "gray.png", kWidth, kHeight, 1, std::vector<uint8_t>(count, 51),
                OIIO::TypeDesc::UINT8);
    writeStored(*this / "word.png", kWidth, kHeight, 1, std::vector<uint16_t>(count, 13107),
                OIIO::TypeDesc::UINT16);
    struct Case {
        const char* name;
        ColorEncoding encoding;
        float value;
        uint64_t bytes; ///< per texel of the finest level
    };
    for (const Case& c :
         {Case{"half.exr", {}, 1.5f, 6}, Case{"float.exr", {}, 1.7f, 12}, Case{"gray.png", {}, .2f, 1},
          Case{"word.png", {}, .2f, 2}, Case{"word.png", {ColorEncoding::Srgb}, decodeSrgb(.2f), 2}}) {
        const auto cache = std::make_shared<TextureCache>();
        const auto file = cache->open(*this / c.name, {}, c.encoding);
        for (const float size : {0.f, .01f, .5f}) {
            const Rgb color = cache->lookup(*file, V2f(.4f, .6f), V2f(size, 0), V2f(0, size), Wrap::Repeat);
            EXPECT_NEAR(color.x, c.value, 1e-5f) << c.name;
            EXPECT_EQ(color.x, color.z);
        }
        EXPECT_NEAR(double(cache->statistics().bytesInMemory), double(count * c.bytes) * 4 / 3,
                    double(count * c.bytes) / 50)
            << c.name;
    }
}

TEST_F(LargeTextures, ImagesOfOneKeyAreReadOnce) {
    const auto cache = std::make_shared<TextureCache>();
    const auto a = cache->open(*this / "rgb.png", {}), b = cache->open(*this / "rgb.png", {});
    const auto c = cache->open(*this / "rgb.png", {}, {ColorEncoding::Srgb});
    for (const auto& file : {a, b, c})
        cache->lookup(*file, V2f(.5f), V2f(0), V2f(0), Wrap::Repeat);
    EXPECT_EQ(cache->statistics().largeImagesRead, 2u);
}

TEST_F(LargeTextures, DamagedImagesAreErrorsAtEachUse) {
    const std::string path = (*this / "cut.png").string();
    fs::copy_file(*this / "rgb.png", path);
    fs::resize_file(path, fs::file_size(path) / 2);
    const auto cache = std::make_shared<TextureCache>();
    const auto file = cache->open(path, {});
    for (int i = 0; i < 2; ++i)
        try {
            cache->lookup(*file, V2f(.5f), V2f(0), V2f(0), Wrap::Repeat);
            FAIL();
        } catch (const Error& e) {
            EXPECT_EQ(std::string(e.what()).find("cannot read the image " + path + ": "), 0u) << e.what();
        }
}

TEST_F(LargeTextures, MissingSpaceForTemporaryFilesIsAnError) {
    TexelPager pager(0);
    setenv("TMPDIR", "/nonexistent", 1);
    try {
        TexelMemory(1000, pager, "the image a.png");
        FAIL();
    } catch (const Error& e) {
        EXPECT_STREQ(e.what(),
                     "the image a.png: cannot keep 0.0 MB in a temporary file in /nonexistent: No such "
                     "file or directory; raise --texture-mb, or set TMPDIR to another folder");
    }
    unsetenv("TMPDIR");
}

TEST(MipLayout, LevelsHalveAndTexelsAreDistinct) {
    const MipLayout layout = MipLayout::halving(300, 130);
    ASSERT_EQ(layout.levels.size(), 9u);
    EXPECT_EQ(layout.levels[1].width, 150);
    EXPECT_EQ(layout.levels[2].height, 32);
    std::vector<char> used(layout.texels);
    for (const MipLayout::Level& level : layout.levels)
        for (int y = 0; y < level.height; ++y)
            for (int x = 0; x < level.width; ++x) {
                const auto i = size_t(level.index(x, y));
                ASSERT_LT(i, used.size());
                ASSERT_FALSE(used[i]);
                used[i] = 1;
            }
}

} // namespace
} // namespace strobe
