// The records of tiles: what is written is read, sums do not depend on their division, damage is an error.
#include "core/util/error.h"
#include "sharing/frame_light.h"

#include <gtest/gtest.h>

#include <random>

namespace strobe {
namespace {

constexpr PixelBounds kFrame{2, 1, 10, 7};

/// A sample of a pixel.
struct Sample {
    int x, y, half, quarter;
    CellId cell;
    Rgb light;
    bool isNegative; ///< the filter weight is
};

std::vector<Sample> randomSamples(int count) {
    std::mt19937 random(1);
    std::vector<Sample> samples;
    for (int i = 0; i < count; ++i) {
        const auto below = [&](int n) { return int(random() % unsigned(n)); };
        samples.push_back({kFrame.x0 + below(kFrame.width()), kFrame.y0 + below(kFrame.height()), below(2),
                           below(2), CellId{7, below(4) - 2, 0, below(2), -3, 2},
                           Rgb(std::ldexp(float(below(1000)), below(60) - 30), 1, 2), below(4) == 0});
    }
    return samples;
}

bool contains(const PixelBounds& bounds, const Sample& sample) {
    return sample.x >= bounds.x0 && sample.x < bounds.x1 && sample.y >= bounds.y0 && sample.y < bounds.y1;
}

/// Calls add(x, y, pixel) for the pixels of a tile with samples. Their cells are added to `cells`.
template <class Add>
void recordPixels(const std::vector<Sample>& samples, const PixelBounds& tile, TileLight& cells,
                  const Add& add) {
    PixelLight pixel;
    for (int y = tile.y1 - 1; y >= tile.y0; --y)
        for (int x = tile.x0; x < tile.x1; ++x) {
            pixel.clear();
            for (const Sample& sample : samples) {
                if (!contains({x, y, x + 1, y + 1}, sample))
                    continue;
                HalfLight& half = pixel.halves[sample.half];
                ++half.quarters[sample.quarter].count;
                half.quarters[sample.quarter].negativeCount += sample.isNegative;
                half.quarters[sample.quarter].light[1].add(sample.light);
                half.v.add(double(sample.light.x));
                if (sample.light.x < 1e-3f) {
                    half.emitted.add(sample.light);
                    half.ee.add(double(sample.light.x));
                    half.ve.add(2);
                }
                half.uses.emplace_back().cell = cells.findCell(sample.cell);
                half.uses.back().add(Rgb(0.5f, 0.25f, 0.125f));
                if (sample.light.x > 1e6f)
                    half.rare.push_back({half.uses.back().cell, 1, sample.quarter == 0, sample.light});
                CellSums& cell = cells.cell(half.uses.back().cell);
                ++cell.count[sample.half];
                cell.p[0] += 5;
                cell.n[1] -= 3;
                cell.light[1][sample.half].add(sample.light);
            }
            if (pixel.halves[0].count() + pixel.halves[1].count() > 0)
                add(x, y, pixel);
        }
}

PixelAccumulator emissionOf(const PixelBounds& tile) {
    PixelAccumulator emission;
    emission.add(Rgb(float(tile.x0)), 1);
    return emission;
}

/// Returns the record of the samples in a tile.
FilmRecord recordOf(const std::vector<Sample>& samples, const PixelBounds& tile) {
    TileLight light(LightParts::all());
    recordPixels(samples, tile, light,
                 [&](int x, int y, const PixelLight& pixel) { light.addPixel(x, y, pixel); });
    light.addEmission(tile.x0, tile.y0, emissionOf(tile));
    return light.record(tile, {0, 4});
}

Film filmWith(std::vector<FilmRecord> records) {
    Film film(12, 8, kFrame);
    film.records().set(std::move(records));
    return film;
}

void expectEqual(const RecordedLight& a, const RecordedLight& b) {
    for (size_t pixel = 0; pixel < a.pixelCount(); ++pixel)
        for (int half = 0; half < kHalves; ++half) {
            EXPECT_EQ(a.weights(pixel, half).all, b.weights(pixel, half).all);
            EXPECT_EQ(a.weights(pixel, half).quarter, b.weights(pixel, half).quarter);
            EXPECT_EQ(a.radiance(pixel, half), b.radiance(pixel, half));
            const HalfPart &ofA = a.light(LightPart::Indirect, pixel, half),
                           &ofB = b.light(LightPart::Indirect, pixel, half);
            EXPECT_EQ(ofA.light, ofB.light);
            EXPECT_EQ(ofA.quarterLight, ofB.quarterLight);
        }
    ASSERT_EQ(a.emission.size(), b.emission.size());
    for (size_t i = 0; i < a.emission.size(); ++i) {
        EXPECT_EQ(a.emission[i].pixel, b.emission[i].pixel);
        for (int half = 0; half < kHalves; ++half) {
            const PixelEmission::Half &ofA = a.emission[i].halves[half], &ofB = b.emission[i].halves[half];
            EXPECT_EQ(ofA.emitted, ofB.emitted);
            EXPECT_EQ(ofA.ee, ofB.ee);
            EXPECT_EQ(ofA.ve, ofB.ve);
        }
    }
    ASSERT_EQ(a.cells.size(), b.cells.size());
    for (size_t i = 0; i < a.cells.size(); ++i) {
        EXPECT_EQ(a.cells[i].id, b.cells[i].id);
        const JoinedCell &ofA = a.cells[i], &ofB = b.cells[i];
        EXPECT_EQ(ofA.p, ofB.p);
        EXPECT_EQ(ofA.n, ofB.n);
        for (int half = 0; half < kHalves; ++half)
            EXPECT_EQ(ofA.light[1][half], ofB.light[1][half]);
    }
    for (size_t pixel = 0; pixel < a.pixelCount(); ++pixel) {
        ASSERT_EQ(a.uses(pixel).size(), b.uses(pixel).size());
        for (size_t i = 0; i < a.uses(pixel).size(); ++i) {
            EXPECT_EQ(a.uses(pixel)[i].cell, b.uses(pixel)[i].cell);
            EXPECT_EQ(a.uses(pixel)[i].half, b.uses(pixel)[i].half);
            EXPECT_EQ(a.uses(pixel)[i].albedo, b.uses(pixel)[i].albedo);
        }
    }
    ASSERT_EQ(a.rare.size(), b.rare.size());
    for (size_t i = 0; i < a.rare.size(); ++i) {
        EXPECT_EQ(a.rare[i].pixel, b.rare[i].pixel);
        EXPECT_EQ(a.rare[i].half, b.rare[i].half);
        EXPECT_EQ(a.rare[i].cell, b.rare[i].cell);
        EXPECT_EQ(a.rare[i].light, b.rare[i].light);
    }
}

/// Returns the light of tiles that are recorded without records.
RecordedLight lightOfTiles(const std::vector<Sample>& samples, const std::vector<PixelBounds>& tiles) {
    const Film film(12, 8, kFrame);
    FrameLight frame(LightParts::all());
    for (const PixelBounds& tile : tiles) {
        EXPECT_TRUE(frame.beginTile(film));
        TileLight cells(LightParts::all());
        PixelLists lists;
        recordPixels(samples, tile, cells,
                     [&](int x, int y, PixelLight& pixel) { frame.setPixel(x, y, pixel, lists); });
        lists.refined.push_back({frame.indexOf(tile.x0, tile.y0), emissionOf(tile)});
        frame.add(cells.cells(), lists);
    }
    return frame.take(film);
}

TEST(ByteStream, ReadsWhatWasWritten) {
    ByteWriter writer;
    writer.reserve(sizeof(__int128) + sizeof(uint8_t) + sizeof(float));
    const __int128 value = -(__int128(1) << 100);
    writer.add(value);
    writer.add(uint8_t(200));
    writer.add(0.5f);
    ByteReader reader(writer.bytes());
    EXPECT_TRUE(reader.next<__int128>() == value);
    EXPECT_EQ(reader.next<uint8_t>(), 200);
    EXPECT_EQ(reader.next<float>(), 0.5f);
    EXPECT_EQ(reader.left(), 0u);
    EXPECT_FALSE(reader.hasFailed());
    EXPECT_EQ(reader.next<uint8_t>(), 0);
    EXPECT_TRUE(reader.hasFailed());
}

TEST(FixedPointSum, LargeNumbersAreLimited) {
    FixedPointSum sum;
    sum.add(1e30);
    sum.add(std::nan(""));
    EXPECT_EQ(sum.value(), 0x1p60);
    sum.add(-1e30);
    sum.add(0.25);
    EXPECT_EQ(sum.value(), 0.25);
}

TEST(RecordedLight, HasTheSumsOfTheSamples) {
    const std::vector<Sample> samples = randomSamples(100);
    const RecordedLight light(filmWith({recordOf(samples, kFrame)}));
    EXPECT_EQ(light.parts, LightParts::all());
    double sum = 0, expected = 0;
    int32_t weight = 0, expectedWeight = 0;
    uint32_t countOfCells = 0;
    for (const Sample& sample : samples) {
        expected += double(sample.light.x);
        expectedWeight += sample.isNegative ? -1 : 1;
    }
    for (size_t pixel = 0; pixel < light.pixelCount(); ++pixel) {
        for (int half = 0; half < kHalves; ++half)
            sum += double(light.light(LightPart::Indirect, pixel, half).light.x);
        weight += light.weight(pixel);
    }
    for (const JoinedCell& cell : light.cells)
        countOfCells += uint32_t(cell.count[0] + cell.count[1]);
    EXPECT_NEAR(sum, expected, 1e-5 * expected);
    EXPECT_EQ(weight, expectedWeight);
    EXPECT_EQ(countOfCells, 100u);
    float albedo = 0;
    for (size_t pixel = 0; pixel < light.pixelCount(); ++pixel)
        for (const PixelUse& use : light.uses(pixel))
            albedo += use.albedo.x;
    EXPECT_FLOAT_EQ(albedo, 50);
}

TEST(RecordedLight, DoesNotDependOnTheDivision) {
    const std::vector<Sample> samples = randomSamples(300);
    const RecordedLight whole(filmWith({recordOf(samples, kFrame)}));
    const std::vector<Sample> some(samples.begin(), samples.begin() + 100),
        others(samples.begin() + 100, samples.end());
    const PixelBounds left{2, 1, 5, 7}, right{5, 1, 10, 7}, top{2, 1, 10, 3}, bottom{2, 3, 10, 7};
    // Records of other samples have other pixels:
    Film film = filmWith(
        {recordOf(some, left), recordOf(others, bottom), recordOf(some, right), recordOf(others, top)});
    const RecordedLight divided(film);
    expectEqual(divided, whole);
    EXPECT_EQ(divided.refined.size(), 3u);
    EXPECT_EQ(divided.refined.front().sum.validCount(), 2u); // of `left` and `top`
}

TEST(RecordedLight, TilesWithoutRecordsHaveTheSumsOfRecords) {
    const std::vector<Sample> samples = randomSamples(300);
    const PixelBounds left{2, 1, 5, 7}, right{5, 1, 10, 7}, top{2, 1, 10, 3}, bottom{2, 3, 10, 7};
    const RecordedLight light(filmWith({recordOf(samples, left), recordOf(samples, right)}));
    EXPECT_GT(light.rare.size(), 10u);
    EXPECT_GT(light.emission.size(), 10u);
    expectEqual(lightOfTiles(samples, {left, right}), light);
    expectEqual(lightOfTiles(samples, {bottom, top}), light);
    const RecordedLight tiles = lightOfTiles(samples, {right, left});
    ASSERT_EQ(tiles.refined.size(), 2u);
    for (size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(tiles.refined[i].pixel, light.refined[i].pixel);
        EXPECT_EQ(tiles.refined[i].sum, light.refined[i].sum);
    }
}

TEST(FrameLight, PixelsOfUnfinishedTilesHaveNoSamples) {
    const Film film(12, 8, kFrame);
    FrameLight frame(LightParts::all());
    ASSERT_TRUE(frame.beginTile(film));
    PixelLight pixel;
    pixel.halves[0].quarters[0].count = 3;
    PixelLists lists;
    frame.setPixel(2, 1, pixel, lists);
    frame.add({}, lists);
    frame.setPixel(3, 1, pixel, lists);
    const RecordedLight light = frame.take(film);
    EXPECT_EQ(light.weight(0), 3);
    EXPECT_EQ(light.weight(1), 0);
}

TEST(FrameLight, FilmsThatAccumulateHaveRecords) {
    Film film(12, 8, kFrame);
    film.enableAccumulation();
    FrameLight frame(LightParts::all());
    EXPECT_FALSE(frame.beginTile(film));
    const std::vector<Sample> samples = randomSamples(30);
    film.records().add(recordOf(samples, kFrame));
    expectEqual(frame.take(film), RecordedLight(film));
}

TEST(RecordedLight, MergingRecordsOfTheSamePixelsKeepsTheSums) {
    const std::vector<Sample> samples = randomSamples(300);
    const PixelBounds left{2, 1, 5, 7}, right{5, 1, 10, 7};
    const std::vector<Sample> some(samples.begin(), samples.begin() + 100),
        others(samples.begin() + 100, samples.end());
    Film film =
        filmWith({recordOf(some, left), recordOf(some, right), recordOf(others, left), recordOf({}, left)});
    const RecordedLight before(film);
    mergeRecordsOfSamePixels(film.records());
    EXPECT_EQ(film.records().all().size(), 2u);
    expectEqual(RecordedLight(film), before);
}

/// Each byte is damaged in two ways; the record is cut at each byte.
TEST(RecordedLight, DamagedRecordsAreErrorsOrSums) {
    const FilmRecord good = recordOf(randomSamples(30), kFrame);
    const auto isError = [&](const std::string& bytes) {
        try {
            RecordedLight light(filmWith({{kFrame, {0, 4}, bytes}, good}));
            return false;
        } catch (const Error& e) {
            EXPECT_EQ(e.kind, ErrorKind::Usage);
            return true;
        }
    };
    EXPECT_FALSE(isError(std::string(good.bytes.view())));
    EXPECT_TRUE(isError(""));
    int errors = 0;
    for (size_t i = 0; i < good.bytes.size(); ++i) {
        EXPECT_TRUE(isError(std::string(good.bytes.view().substr(0, i)))) << i;
        std::string bytes = std::string(good.bytes.view());
        bytes[i] = char(bytes[i] ^ 1);
        errors += isError(bytes);
        bytes[i] = '\xff';
        errors += isError(bytes);
    }
    EXPECT_GT(errors, 500);
}

TEST(RecordedLight, RecordsMustFit) {
    const FilmRecord record = recordOf({}, kFrame);
    Film small(12, 8, {2, 1, 10, 6});
    small.records().add(record);
    EXPECT_THROW(RecordedLight{small}, Error);
    TileLight other{LightParts()};
    EXPECT_THROW(RecordedLight{filmWith({record, other.record(kFrame, {0, 4})})}, Error);
}

} // namespace
} // namespace strobe
