#include "samplers/aliases.h"
#include "samplers/independent.h"
#include "samplers/sobol.h"
#include "samplers/stratified.h"
#include "support/chi_square.h"
#include "support/params.h"

#include <gtest/gtest.h>

#include <set>

using namespace strobe;
using namespace strobe::test;

namespace {

using SamplerPlugin = Plugin<SamplerSetup, int>;

SamplerSetup make(const SamplerPlugin& plugin, const ParamSet& params = {}, int spp = 0,
                  Conventions conventions = Conventions::PbrtV4) {
    static Diagnostics quiet;
    return plugin.create(params, BuildContext{.diagnostics = quiet, .conventions = conventions}, spp);
}

std::vector<SamplerPlugin> all() { return {independentPlugin(), stratifiedPlugin(), sobolPlugin()}; }

std::vector<V2f> points(const Sampler& sampler, uint64_t domain, uint32_t n, uint32_t dim) {
    std::vector<V2f> out(n);
    sampler.fill2D({domain, 0, n, n}, dim, out.data());
    return out;
}

std::vector<float> numbers(const Sampler& sampler, uint64_t domain, uint32_t n, uint32_t dim) {
    std::vector<float> out(n);
    sampler.fill1D({domain, 0, n, n}, dim, out.data());
    return out;
}

/// Returns the Pearson correlation coefficient.
double correlation(const std::vector<double>& a, const std::vector<double>& b) {
    double ma = 0, mb = 0, ab = 0, aa = 0, bb = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        ma += a[i] / double(a.size());
        mb += b[i] / double(a.size());
    }
    for (size_t i = 0; i < a.size(); ++i) {
        ab += (a[i] - ma) * (b[i] - mb);
        aa += (a[i] - ma) * (a[i] - ma);
        bb += (b[i] - mb) * (b[i] - mb);
    }
    return ab / std::sqrt(aa * bb);
}

} // namespace

TEST(Samplers, SeveralRangesEqualSingleQueries) {
    const SampleRange ranges[] = {{99, 3, 5, 16}, {7, 0, 1, 16}, {8, 31, 20, 40}, {99, 8, 38, 16}};
    for (const SamplerPlugin& plugin : all()) {
        const auto sampler = make(plugin).sampler;
        float line[kSoAWidth];
        V2SoA square;
        sampler->fill1D(ranges, 5, line);
        sampler->fill2D(ranges, 5, square);
        int k = 0;
        for (const SampleRange& range : ranges)
            for (uint32_t i = 0; i < range.n; ++i, ++k) {
                EXPECT_EQ(line[k], sampler->get1D(range.domain, range.first + i, range.total, 5));
                EXPECT_EQ(square.at(k), sampler->get2D(range.domain, range.first + i, range.total, 5));
            }
        EXPECT_EQ(k, kSoAWidth);
    }
}

TEST(Samplers, RangesEqualSingleQueries) {
    for (const SamplerPlugin& plugin : all()) {
        const auto sampler = make(plugin).sampler;
        for (const uint32_t total : {1u, 7u, 16u, 24u}) {
            std::vector<float> line(40);
            std::vector<V2f> square(40);
            sampler->fill1D({99, 3, 40, total}, 5, line.data()); // includes members beyond total
            sampler->fill2D({99, 3, 40, total}, 5, square.data());
            for (uint32_t i = 0; i < 40; ++i) {
                EXPECT_EQ(sampler->get1D(99, 3 + i, total, 5), line[i]) << plugin.name;
                EXPECT_EQ(sampler->get2D(99, 3 + i, total, 5), square[i]) << plugin.name;
                EXPECT_TRUE(line[i] >= 0 && line[i] < 1) << plugin.name;
                EXPECT_TRUE(square[i].x >= 0 && square[i].x < 1 && square[i].y >= 0 && square[i].y < 1);
            }
        }
    }
}

TEST(Samplers, EachMemberIsUniformOverDomains) {
    // A chi-square test of one member over many domains.
    constexpr int n = 20000, bins = 12;
    for (const SamplerPlugin& plugin : all()) {
        const auto sampler = make(plugin).sampler;
        for (const uint32_t total : {1u, 5u, 16u, 48u})
            for (const uint32_t index : {0u, 3u, 17u}) {
                std::vector<double> line(bins), square(bins * bins);
                for (int i = 0; i < n; ++i) {
                    const uint64_t domain = hashOf(42, i);
                    line[size_t(sampler->get1D(domain, index, total, 1) * bins)] += 1;
                    const V2f p = sampler->get2D(domain, index, total, 2);
                    square[size_t(p.y * bins) * bins + size_t(p.x * bins)] += 1;
                }
                EXPECT_GT(chiSquareP(line, std::vector<double>(bins, double(n) / bins)), 1e-4)
                    << plugin.name << " " << total << " " << index;
                EXPECT_GT(chiSquareP(square, std::vector<double>(bins * bins, double(n) / (bins * bins))),
                          1e-4)
                    << plugin.name << " " << total << " " << index;
            }
    }
}

TEST(Samplers, DimensionsAndDomainsAreIndependent) {
    // Over many sets, equal members of two dimensions or domains are as uncorrelated as random numbers.
    constexpr uint32_t total = 16, sets = 2000;
    for (const SamplerPlugin& plugin : all()) {
        const auto sampler = make(plugin).sampler;
        std::vector<double> x0, y0, x1, line0, line1, next;
        for (uint32_t d = 0; d < sets; ++d) {
            const auto a = points(*sampler, hashOf(d), total, 0), b = points(*sampler, hashOf(d), total, 1);
            const auto c = points(*sampler, hashOf(d + 1), total, 0);
            for (uint32_t i = 0; i < total; ++i) {
                x0.push_back(a[i].x);
                y0.push_back(a[i].y);
                x1.push_back(b[i].x);
                next.push_back(c[i].x);
                line0.push_back(sampler->get1D(hashOf(d), i, total, 0));
                line1.push_back(sampler->get1D(hashOf(d), i, total, 1));
            }
        }
        const double limit = 4 / std::sqrt(double(total) * sets); // four standard deviations
        EXPECT_LT(std::abs(correlation(x0, y0)), limit) << plugin.name;
        EXPECT_LT(std::abs(correlation(x0, x1)), limit) << plugin.name;
        EXPECT_LT(std::abs(correlation(x0, next)), limit) << plugin.name;
        EXPECT_LT(std::abs(correlation(line0, line1)), limit) << plugin.name;
        EXPECT_LT(std::abs(correlation(x0, line0)), limit) << plugin.name;
        // A chi-square test of pairs finds non-linear dependence, too.
        std::vector<double> cells(64);
        for (size_t i = 0; i < x0.size(); ++i)
            cells[size_t(x0[i] * 8) * 8 + size_t(x1[i] * 8)] += 1;
        EXPECT_GT(chiSquareP(cells, std::vector<double>(64, double(x0.size()) / 64)), 1e-4) << plugin.name;
    }
}

TEST(Samplers, DomainsOfPixelsDiffer) {
    std::set<uint64_t> domains, blocks;
    for (uint64_t seed = 0; seed < 3; ++seed)
        for (int y = -32; y < 32; ++y)
            for (int x = -32; x < 32; ++x) {
                domains.insert(pixelDomain(seed, x, y));
                blocks.insert(pixelDomain(seed, x, y) >> kPartBits);
            }
    EXPECT_EQ(domains.size(), 3u * 64 * 64);
    EXPECT_EQ(blocks.size(), 3u * 4 * 4);
}

TEST(Sobol, SecondDimensionMatchesDirectionNumbers) {
    // Direction numbers of x + 1: v_1 = 1/2, v_k = v_(k-1) xor v_(k-1)/2.
    uint32_t v[32];
    v[0] = 1u << 31;
    for (int k = 1; k < 32; ++k)
        v[k] = v[k - 1] ^ (v[k - 1] >> 1);
    for (uint32_t i = 0; i < 5000; ++i) {
        const uint32_t index = i < 1000 ? i : uint32_t(hashOf(i));
        uint32_t x = 0, y = 0;
        for (int k = 0; k < 32; ++k)
            if (index >> k & 1) {
                x |= 1u << (31 - k);
                y ^= v[k];
            }
        EXPECT_EQ(sobolPoint(index).x, x);
        EXPECT_EQ(sobolPoint(index).y, y);
    }
}

TEST(Sobol, EveryElementaryIntervalContainsOnePoint) {
    const auto sampler = make(sobolPlugin()).sampler;
    for (const uint64_t domain : {1ull, 77ull, 123456789ull})
        for (uint32_t dim = 0; dim < 5; ++dim)
            for (uint32_t m = 0; m <= 10; ++m) {
                const uint32_t n = 1u << m;
                for (const uint32_t first : {0u, 3 * n}) { // any aligned range is a net
                    std::vector<V2f> p(n);
                    std::vector<float> line(n);
                    sampler->fill2D({domain, first, n, n}, dim, p.data());
                    sampler->fill1D({domain, first, n, n}, dim, line.data());
                    for (uint32_t a = 0; a <= m; ++a) { // 2^a columns, 2^(m-a) rows
                        std::set<uint32_t> cells;
                        for (const V2f& q : p)
                            cells.insert(uint32_t(q.y * float(1u << (m - a))) << a |
                                         uint32_t(q.x * float(1u << a)));
                        EXPECT_EQ(cells.size(), n) << "m " << m << " a " << a;
                    }
                    std::set<uint32_t> strata;
                    for (const float x : line)
                        strata.insert(uint32_t(x * float(n)));
                    EXPECT_EQ(strata.size(), n);
                }
            }
}

TEST(Sobol, PixelsOfABlockAreOneNet) {
    const auto sampler = make(sobolPlugin()).sampler;
    for (const int edge : {2, 4, 8, 16}) // aligned parts of a block, too
        for (const uint32_t perPixel : {1u, 4u}) {
            const uint32_t n = uint32_t(edge * edge) * perPixel;
            std::vector<V2f> p;
            std::set<uint32_t> strata; // of numbers
            for (int y = 0; y < edge; ++y)
                for (int x = 0; x < edge; ++x) {
                    const uint64_t domain = pixelDomain(5, 16 - edge + x, 48 - edge + y);
                    for (const V2f& q : points(*sampler, domain, perPixel, 2))
                        p.push_back(q);
                    for (const float u : numbers(*sampler, domain, perPixel, 2))
                        strata.insert(uint32_t(u * float(n)));
                }
            EXPECT_EQ(strata.size(), n) << edge << " " << perPixel;
            for (uint32_t columns = 1; columns <= n; columns *= 2) {
                std::set<std::pair<uint32_t, uint32_t>> cells;
                for (const V2f& q : p)
                    cells.insert({uint32_t(q.x * float(columns)), uint32_t(q.y * float(n / columns))});
                EXPECT_EQ(cells.size(), n) << edge << " " << perPixel << " " << columns;
            }
        }
}

TEST(Sobol, BlocksHaveEvenNoise) {
    // The number alternates twice in each of the four strata of a pixel: a light that is switched on and off.
    // If all pixels of a block had the same pattern, blocks would have from 0 to 4 times the mean squared
    // error. The means of 256 independent pixels vary by 8 %.
    constexpr int kEdge = 16, kBlocks = 200;
    const auto sampler = make(sobolPlugin()).sampler;
    double sum = 0, squares = 0;
    for (int block = 0; block < kBlocks; ++block) {
        double error = 0;
        for (int i = 0; i < kEdge * kEdge; ++i) {
            double mean = 0;
            for (const float u :
                 numbers(*sampler, pixelDomain(5, kEdge * block + i % kEdge, i / kEdge), 4, 2))
                mean += int(8 * u) % 2 == 0 ? .25 : -.25;
            error += sqr(mean) / (kEdge * kEdge);
        }
        sum += error / kBlocks;
        squares += sqr(error) / kBlocks;
    }
    EXPECT_NEAR(sum, .25, .02);
    EXPECT_LT(std::sqrt(squares - sqr(sum)), .2 * sum);
}

TEST(Sobol, PixelsShareNoPoints) {
    // Also if they have different numbers of samples, or more than a sequence has for each pixel of a block.
    const auto sampler = make(sobolPlugin()).sampler;
    std::set<std::pair<float, float>> all;
    size_t count = 0;
    for (const uint32_t total : {1u, 3u, 4u, 16u, 1u << 30})
        for (int x = -20; x < 20; ++x)
            for (int y = -2; y < 2; ++y) {
                const uint32_t n = std::min(total, 16u);
                std::vector<V2f> p(n);
                sampler->fill2D({pixelDomain(5, x, y), 0, n, total}, 2, p.data());
                for (const V2f& q : p)
                    all.insert({q.x, q.y});
                count += n;
            }
    EXPECT_EQ(all.size(), count);
}

TEST(Sobol, ConvergesFasterThanIndependentSamples) {
    // The RMSE of the mean of a smooth function over 64 points.
    const auto rmse = [](const Sampler& sampler) {
        double sum = 0;
        for (uint64_t d = 0; d < 200; ++d) {
            double mean = 0;
            for (const V2f& p : points(sampler, hashOf(d), 64, 3))
                mean += std::exp(-4 * (sqr(p.x - .4f) + sqr(p.y - .6f))) / 64;
            const double exact = .5 * std::sqrt(M_PI / 4) * (std::erf(.8) + std::erf(1.2));
            sum += (mean - exact * exact) * (mean - exact * exact);
        }
        return std::sqrt(sum / 200);
    };
    const double random = rmse(*make(independentPlugin()).sampler);
    const double sobol = rmse(*make(sobolPlugin()).sampler);
    const double stratified =
        rmse(*make(stratifiedPlugin(), Params().ints("xsamples", {8}).ints("ysamples", {8})).sampler);
    EXPECT_LT(sobol, random / 5);
    EXPECT_LT(stratified, random / 3);
}

TEST(Stratified, EveryStratumRowAndColumnContainsOnePoint) {
    const auto setup = make(stratifiedPlugin(), Params().ints("xsamples", {6}).ints("ysamples", {4}));
    EXPECT_EQ(setup.samplesPerPixel, 24);
    for (uint64_t domain = 0; domain < 20; ++domain) {
        std::set<uint32_t> cells, columns, rows, lines;
        for (const V2f& p : points(*setup.sampler, domain, 24, 7)) {
            cells.insert(uint32_t(p.y * 4) * 6 + uint32_t(p.x * 6));
            columns.insert(uint32_t(p.x * 24));
            rows.insert(uint32_t(p.y * 24));
        }
        for (uint32_t i = 0; i < 24; ++i)
            lines.insert(uint32_t(setup.sampler->get1D(domain, i, 24, 7) * 24));
        EXPECT_EQ(cells.size(), 24u);
        EXPECT_EQ(columns.size(), 24u);
        EXPECT_EQ(rows.size(), 24u);
        EXPECT_EQ(lines.size(), 24u);
    }
}

TEST(Stratified, PointsAreCentersWithoutJitter) {
    const auto setup = make(stratifiedPlugin(),
                            Params().ints("xsamples", {3}).ints("ysamples", {2}).boolean("jitter", false));
    std::set<std::pair<int, int>> found;
    for (const V2f& p : points(*setup.sampler, 5, 6, 0)) {
        EXPECT_NEAR(p.x * 6, std::round(p.x * 6), 1e-5);
        EXPECT_NEAR(p.y * 4, std::round(p.y * 4), 1e-5);
        found.insert({int(std::round(p.x * 6)), int(std::round(p.y * 4))});
    }
    EXPECT_EQ(found, (std::set<std::pair<int, int>>{{1, 1}, {3, 1}, {5, 1}, {1, 3}, {3, 3}, {5, 3}}));
}

TEST(Stratified, PermutationsAreBijectiveAndUniform) {
    for (const uint32_t n : {1u, 2u, 3u, 5u, 8u, 13u, 64u, 100u}) {
        std::vector<double> counts(n * n);
        const int seeds = n < 16 ? 20000 : 4000;
        for (int seed = 0; seed < seeds; ++seed) {
            std::set<uint32_t> seen;
            for (uint32_t i = 0; i < n; ++i) {
                const uint32_t j = permutedIndex(i, n, hashOf(seed, n));
                EXPECT_LT(j, n);
                seen.insert(j);
                counts[i * n + j] += 1;
            }
            EXPECT_EQ(seen.size(), n);
        }
        if (n > 1) {
            EXPECT_GT(chiSquareP(counts, std::vector<double>(n * n, double(seeds) / n)), 1e-4) << n;
        }
    }
}

TEST(Samplers, SamplesPerPixelFollowTheSceneAndTheCommandLine) {
    EXPECT_EQ(make(sobolPlugin()).samplesPerPixel, 16);
    EXPECT_EQ(make(sobolPlugin(), {}, 0, Conventions::PbrtV2).samplesPerPixel, 4);
    EXPECT_EQ(make(sobolPlugin(), Params().ints("pixelsamples", {33})).samplesPerPixel, 64);
    EXPECT_EQ(make(sobolPlugin(), Params().ints("samples", {5})).samplesPerPixel, 8);
    EXPECT_EQ(make(sobolPlugin(), Params().ints("samples", {5}), 3).samplesPerPixel, 4);
    EXPECT_EQ(make(independentPlugin(), Params().ints("pixelsamples", {33})).samplesPerPixel, 33);
    EXPECT_EQ(make(independentPlugin(), {}, 7).samplesPerPixel, 7);
    EXPECT_EQ(make(stratifiedPlugin(), {}, 12).samplesPerPixel, 12);
    EXPECT_EQ(make(stratifiedPlugin()).samplesPerPixel, 16);
    const Params none = Params().ints("pixelsamples", {0});
    const Params negative = Params().ints("xsamples", {2}).ints("ysamples", {-1});
    EXPECT_EQ(errorOffset([&] { make(sobolPlugin(), none); }), 10);
    EXPECT_EQ(errorOffset([&] { make(independentPlugin(), none); }), 10);
    EXPECT_EQ(errorOffset([&] { make(stratifiedPlugin(), negative); }), 20);
}

TEST(Samplers, AliasesNameExistingSamplers) {
    for (const auto& [name, target] : samplerAliases()) {
        bool found = false;
        for (const SamplerPlugin& plugin : all()) {
            found |= plugin.name == target;
            EXPECT_NE(plugin.name, name);
        }
        EXPECT_TRUE(found) << name;
    }
    EXPECT_EQ(samplerAliases().at("lowdiscrepancy"), "sobol");
}
