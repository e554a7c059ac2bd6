// The light tree: its probabilities, and its estimates against those of all lights.
#include "core/math/sampling.h"
#include "core/scene/light_tree_builder.h"
#include "shading/emitted_light.h"
#include "shading/scene_template.h"
#include "support/chi_square.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <map>

namespace strobe {
namespace {

using namespace test;

struct TreeCase {
    const char* name;
    std::string lights; ///< scene text
    std::string floor = R"("matte" "rgb Kd" [.5 .4 .3])";
};
void PrintTo(const TreeCase& c, std::ostream* out) { *out << c.name; }

/// Returns `count` copies of `text` with $x, $y and $z at random points of a box, $i at random intensities,
/// $d and $e at random displacements, $a at random angles.
std::string scattered(const std::string& text, int count, uint64_t stream = 1) {
    std::string all;
    for (int i = 0; i < count; ++i) {
        const auto number = [&](int k, float low, float high) {
            return std::to_string(lerp(low, high, random1D(stream, uint64_t(i * 8 + k))));
        };
        all += "AttributeBegin " +
               substitute(text, {{"$x", number(0, -3, 3)},
                                 {"$y", number(1, -3, 3)},
                                 {"$z", number(2, .3f, 2)},
                                 {"$i", number(3, .1f, 1)},
                                 {"$d", number(4, -3, 3)},
                                 {"$e", number(6, -3, 3)},
                                 {"$a", number(5, 0, 360)}}) +
               " AttributeEnd\n";
    }
    return all;
}

const std::string kPoint = R"(LightSource "point" "rgb I" [$i $i .5] "point from" [$x $y $z])";
const std::string kSpot = R"(
    LightSource "spot" "rgb I" [3 $i $i] "point from" [$x $y $z] "point to" [$x $d 0] "float coneangle" 35
)";
const std::string kMoving = "ActiveTransform EndTime Translate $d 0 0 ActiveTransform All ";
const std::string kTurning = "ActiveTransform EndTime Rotate 160 1 $d 1 ActiveTransform All ";
const std::string kDisk = R"(
    Translate $x $y $z  Rotate $a 1 .3 0
    AreaLightSource "diffuse" "rgb L" [3 $i 2]
    Shape "disk" "float radius" .2
)";
const std::string kTwoSidedDisk = R"(
    Translate $x $y $z  Rotate $a 1 .3 0
    AreaLightSource "diffuse" "rgb L" [3 $i 2] "bool twosided" true
    Shape "disk" "float radius" .2
)";
const std::string kSphere = R"(
    Translate $x $y $z
    AreaLightSource "diffuse" "rgb L" [2 $i 2]
    Shape "sphere" "float radius" .15
)";
/// An octahedron with vertex normals, of which some triangles face each point.
const std::string kMesh = R"(
    Translate $x $y $z
    Scale .3 .3 .3
    AreaLightSource "diffuse" "rgb L" [2 2 $i]
    Shape "trianglemesh" "integer indices" [0 2 4 2 1 4 1 3 4 3 0 4 2 0 5 1 2 5 3 1 5 0 3 5]
      "point P" [1 0 0 -1 0 0 0 1 0 0 -1 0 0 0 1 0 0 -1]
      "normal N" [1 0 0 -1 0 0 0 1 0 0 -1 0 0 0 1 0 0 -1]
)";
const std::string kWall = R"(
    Material "matte" "rgb Kd" [.6 .6 .6]
    Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [.2 -9 0  .2 9 0  .2 9 9  .2 -9 9]
)";
const std::string kMirrorLike = R"("plastic" "rgb Kd" [.2 .2 .2] "rgb Ks" [.6 .6 .6] "float roughness" .05)";

std::vector<TreeCase> cases() {
    return {
        {"Points", scattered(kPoint, 40)},
        {"MovingPoints", scattered(kMoving + kPoint, 40)},
        {"ManyPoints", scattered(kPoint, 200) + scattered(kMoving + kPoint, 100, 2)},
        {"Spots", scattered(kSpot, 40)},
        {"TurningSpots", scattered(kTurning + kSpot, 12)},
        {"DisksAndSpheres", scattered(kDisk, 12) + scattered(kTwoSidedDisk, 6, 2) + scattered(kSphere, 9, 3),
         kMirrorLike},
        {"MovingDisks", scattered(kMoving + kDisk, 15) + scattered(kTurning + kTwoSidedDisk, 5, 2)},
        {"Meshes", scattered(kMesh, 7), kMirrorLike},
        {"TurningMeshes", scattered(kTurning + kMesh, 4) + scattered(kMoving + kMesh, 3, 2)},
        {"LampsBehindAWall", scattered(kPoint, 20) + kWall},
        {"EnvironmentBesideLamps",
         R"(LightSource "infinite" "rgb L" [.2 .3 .4] LightSource "distant" "rgb L" [.5 .5 .3] "point from" [1 1 1]
            "point to" [0 0 0] )" +
             scattered(kSphere, 12) + scattered(kPoint, 9, 4),
         kMirrorLike},
    };
}

std::string sceneOf(const TreeCase& c, const std::string& integrator, int samples = 32) {
    const char* scene = R"(
        Film "image" "integer xresolution" 5 "integer yresolution" 4
        Sampler "sobol" "integer pixelsamples" $samples
        Integrator $integrator
        LookAt 0 -6 5  0 0 0  0 0 1
        TransformTimes 0 1
        Camera "perspective" "float fov" 40
        WorldBegin
        AttributeBegin
        $lights
        AttributeEnd
        Material $floor
        Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-9 -9 0  9 -9 0  9 9 0  -9 9 0]
    )";
    return substitute(scene, {{"$samples", std::to_string(samples)},
                              {"$integrator", integrator},
                              {"$lights", c.lights},
                              {"$floor", c.floor}});
}

class LightTreeTest : public testing::TestWithParam<TreeCase> {};

/// Compares each pixel's mean.
void expectEqualMeans(const TreeCase& c, const std::string& integrator, const std::string& strategy) {
    constexpr int kSeeds = 24;
    const std::string all = "\"" + integrator + R"(" "integer maxdepth" 2 "string strategy" "all")";
    const std::string tree = "\"" + integrator + R"(" "integer maxdepth" 2 "string strategy" )" + strategy;
    const PixelStatistics a = renderSeeds(test::build(sceneOf(c, all)), kSeeds);
    const PixelStatistics b = renderSeeds(test::build(sceneOf(c, tree)), kSeeds, 1000);
    const double z = criticalZ(a.mean.size(), kSeeds);
    for (size_t i = 0; i < a.mean.size(); ++i)
        EXPECT_NEAR(a.mean[i], b.mean[i], z * std::hypot(a.error[i], b.error[i]) + 1e-5 * a.mean[i])
            << integrator << " " << strategy << " " << i;
}

TEST_P(LightTreeTest, MeansEqualThoseOfAllLights) {
    expectEqualMeans(GetParam(), "directlighting", R"("tree")");
    expectEqualMeans(GetParam(), "path", R"("tree" "integer lightsamples" 3)");
    expectEqualMeans(GetParam(), "directlighting", R"("tree" "string lightmotion" "swept")");
}

/// A random point above the floor, with normals that differ a little.
LightPoint randomPoint(uint64_t i) {
    const auto u = [&](uint64_t k) { return random1D(77, i * 8 + k); };
    const V3f ng = uniformSphere({u(3), u(4)});
    return {V3f(lerp(-4.f, 4.f, u(0)), lerp(-4.f, 4.f, u(1)), lerp(0.f, 3.f, u(2))), ng,
            normalize(ng + uniformSphere({u(4), u(3)}) * .2f), i % 5 == 0, u(5)};
}

std::vector<LightTreeSettings> allSettings() {
    return {{false, LightMotion::Split},
            {false, LightMotion::Linear},
            {false, LightMotion::Swept},
            {true, LightMotion::Split}};
}

/// Calls work(light, emitter) for all emitters.
template <class Work>
void forEmitters(const Scene& scene, const Work& work) {
    for (size_t i = 0; i < scene.lights().size(); ++i)
        for (uint32_t e = 0; e < scene.lights()[i]->emitterCount(); ++e)
            work(int(i), e);
}

TEST_P(LightTreeTest, ProbabilitiesHaveTheSumOne) {
    const BuiltScene built = test::build(sceneOf(GetParam(), R"("path")"));
    for (const LightTreeSettings& settings : allSettings()) {
        const LightTree& tree = built.scene->lightTree(settings);
        for (uint64_t i = 0; i < 1000; ++i) {
            double sum = 0;
            forEmitters(*built.scene, [&](int light, uint32_t emitter) {
                sum += double(tree.probability(randomPoint(i), light, emitter));
            });
            ASSERT_NEAR(sum, 1, 1e-5) << i;
        }
    }
}

/// An emitter whose probability is 0 contributes nothing: the surface is behind it, or it faces away.
TEST_P(LightTreeTest, EmittersThatContributeHaveAProbability) {
    const BuiltScene built = test::build(sceneOf(GetParam(), R"("path")"));
    for (const LightTreeSettings& settings : allSettings()) {
        const LightTree& tree = built.scene->lightTree(settings);
        for (uint64_t i = 0; i < 300; ++i) {
            const LightPoint point = randomPoint(i);
            forEmitters(*built.scene, [&](int light, uint32_t emitter) {
                if (tree.probability(point, light, emitter) > 0)
                    return;
                for (uint64_t k = 0; k < 16; ++k) {
                    const LightSample s = built.scene->lights()[size_t(light)]->sampleEmitter(
                        emitter, point.p, point.time, random2D(5, k));
                    EXPECT_TRUE(isBlack(s.radiance) || (dot(s.wi, point.ng) <= 1e-4f && !point.transmits))
                        << light << " " << emitter << " at " << i;
                }
            });
        }
    }
}

struct Queries {
    V3SoA p, ng, ns;
    alignas(64) float cosWo[kSoAWidth],
        transmissive[kSoAWidth], time[kSoAWidth], u[kSoAWidth], fine[kSoAWidth];
    void set(int i, const LightPoint& point, uint64_t index) {
        p.set(i, point.p);
        ng.set(i, -point.ng); // the viewer is on the other side
        ns.set(i, -point.ns);
        cosWo[i] = -1;
        transmissive[i] = point.transmits ? 1 : 0;
        time[i] = point.time;
        u[i] = random1D(8, index);
        fine[i] = random1D(9, index);
    }
    LightPickQuery query(int samplesPerPoint = 1) const {
        return {p, ng, ns, cosWo, transmissive, time, u, fine, kSoAWidth, samplesPerPoint};
    }
};

TEST_P(LightTreeTest, PicksHaveTheirProbabilities) {
    const BuiltScene built = test::build(sceneOf(GetParam(), R"("path")"));
    for (const LightTreeSettings& settings : allSettings()) {
        const LightTree& tree = built.scene->lightTree(settings);
        for (uint64_t i = 0; i < 4; ++i) {
            const LightPoint point = randomPoint(i);
            std::map<std::pair<int, uint32_t>, double> counts;
            constexpr int kRounds = 400;
            for (uint64_t round = 0; round < kRounds; ++round) {
                Queries q;
                for (int k = 0; k < kSoAWidth; ++k)
                    q.set(k, point, (i * kRounds + round) * kSoAWidth + uint64_t(k));
                LightPickSoA picks;
                tree.pick(q.query(), picks);
                for (int k = 0; k < kSoAWidth; ++k) {
                    ++counts[{picks.light[k], picks.emitter[k]}];
                    ASSERT_EQ(picks.probability[k],
                              tree.probability(point, picks.light[k], picks.emitter[k]));
                }
            }
            std::vector<double> observed, expected;
            forEmitters(*built.scene, [&](int light, uint32_t emitter) {
                observed.push_back(counts[{light, emitter}]);
                expected.push_back(double(tree.probability(point, light, emitter)) * kRounds * kSoAWidth);
            });
            EXPECT_GT(chiSquareP(observed, expected), 1e-5) << i;
        }
    }
}

/// Samples that share a point share evaluated nodes; their choices do not change.
TEST_P(LightTreeTest, PicksDoNotDependOnTheirOrder) {
    const BuiltScene built = test::build(sceneOf(GetParam(), R"("path")"));
    for (const LightTreeSettings& settings : allSettings()) {
        const LightTree& tree = built.scene->lightTree(settings);
        for (const int perPoint : {3, 16, kSoAWidth}) {
            Queries q;
            for (int k = 0; k < kSoAWidth; ++k)
                q.set(k, randomPoint(uint64_t(k / perPoint)), uint64_t(k));
            LightPickSoA one, several;
            tree.pick(q.query(), one);
            tree.pick(q.query(perPoint), several);
            for (int k = 0; k < kSoAWidth; ++k) {
                EXPECT_EQ(one.light[k], several.light[k]);
                EXPECT_EQ(one.emitter[k], several.emitter[k]);
                EXPECT_EQ(one.probability[k], several.probability[k]);
            }
        }
    }
}

/// A light that a ray from a point hits, at the center of a cone of directions that hit the same emitter.
struct LitCone {
    LightPoint point;
    V3f wi;
    SurfacePoint s;
};
constexpr float kConeAngle = .006f; // radians

/// Returns the hit of a ray. Its geometry is kNone if there is none.
Hit trace(const Scene& scene, const LightPoint& point, const V3f& wi) {
    RayPacket packet;
    packet.set(0, point.p, wi, 0, kInfinity, point.time);
    scene.tracer().intersect(packet, 1, false);
    return scene.tracer().hit(packet, 0);
}

/// Finds a cone. Its rim hits the same emitter.
std::optional<LitCone> findCone(const Scene& scene, uint64_t index) {
    LightPoint point = randomPoint(index);
    point.transmits = false;
    const V3f wi = uniformSphere(random2D(31, index));
    const auto target = [&](const V3f& d) { return trace(scene, point, d); };
    const Hit hit = target(wi);
    if (!hit || dot(wi, point.ng) < .1f)
        return std::nullopt;
    const SurfacePoint s = scene.surface(hit, point.time);
    if (s.light < 0 || isBlack(scene.emitted(s, hit, -wi)) || std::abs(dot(wi, s.ng)) < .2f)
        return std::nullopt;
    const Frame frame = Frame::fromNormal(wi);
    for (int i = 0; i < 8; ++i) {
        const float phi = float(i) * kPi / 4;
        const Hit rim =
            target(frame.toWorld(V3f(std::sin(kConeAngle) * std::cos(phi),
                                     std::sin(kConeAngle) * std::sin(phi), std::cos(kConeAngle))));
        if (!rim || rim.geometry != hit.geometry || rim.instance != hit.instance || rim.prim != hit.prim)
            return std::nullopt;
    }
    return LitCone{point, wi, s};
}

/// Returns how many of `count` light samples fall into the cone, on the emitter that its center hits.
double countInCone(const Scene& scene, const LightTree& tree, const LitCone& cone, int count) {
    const uint32_t emitter = tree.emitterOf(cone.s.light, cone.s.prim);
    double inside = 0;
    for (int first = 0; first < count; first += kSoAWidth) {
        Queries q;
        for (int k = 0; k < kSoAWidth; ++k)
            q.set(k, cone.point, uint64_t(first + k));
        LightPickSoA picks;
        tree.pick(q.query(kSoAWidth), picks);
        for (int k = 0; k < kSoAWidth; ++k) {
            if (picks.light[k] != cone.s.light || picks.emitter[k] != emitter)
                continue;
            const LightSample sample = scene.lights()[size_t(picks.light[k])]->sampleEmitter(
                emitter, cone.point.p, cone.point.time, random2D(41, uint64_t(first + k)));
            inside += length(sample.wi - cone.wi) < 2 * std::sin(kConeAngle / 2) ? 1 : 0;
        }
    }
    return inside;
}

/// The density of light samples, counted, gives the weight of a BSDF sample that hits a light.
TEST(LightTree, MisWeightsEqualBruteForce) {
    for (const char* name :
         {"DisksAndSpheres", "MovingDisks", "Meshes", "TurningMeshes", "EnvironmentBesideLamps"}) {
        const auto all = cases();
        const auto& c = *std::find_if(all.begin(), all.end(),
                                      [&](const TreeCase& x) { return x.name == std::string(name); });
        const BuiltScene built = test::build(sceneOf(c, R"("path")"));
        const Scene& scene = *built.scene;
        PathSettings settings{};
        settings.strategy = LightStrategy::Tree;
        const LightTree& tree = scene.lightTree(settings.tree);
        const PathContext context{scene, *built.sampler.sampler, settings, scene.lightSampler(), &tree};
        constexpr int kSamples = 1 << 17, kCones = 12;
        int cones = 0;
        for (uint64_t i = 0; cones < kCones && i < 100000; ++i) {
            const auto cone = findCone(scene, i);
            if (!cone)
                continue;
            ++cones;
            Path path;
            path.ray = {cone->point.p, cone->wi, cone->point.time};
            path.setPreviousVertex(cone->point);
            path.maxBsdfPdf = kInfinity;
            const double inside = countInCone(scene, tree, *cone, kSamples);
            const double solidAngle = 2 * double(kPi) * (1 - std::cos(double(kConeAngle)));
            const auto density = [&](double count) { return float(count / (kSamples * solidAngle)); };
            // Five standard errors, and 2 % for the variation in the cone.
            const double error = 5 * std::sqrt(inside + 1) + .02 * inside;
            const float bsdfPdf = density(inside + 1);
            const float weight = treeLightRayWeight(context, path, bsdfPdf, cone->s, cone->wi);
            EXPECT_GE(weight, powerHeuristic(1, bsdfPdf, 1, density(inside + error))) << name << " " << i;
            EXPECT_LE(weight, powerHeuristic(1, bsdfPdf, 1, density(std::max(inside - error, 0.))))
                << name << " " << i;
        }
        EXPECT_EQ(cones, kCones) << name;
    }
}

std::string nameOf(const testing::TestParamInfo<TreeCase>& info) { return info.param.name; }
INSTANTIATE_TEST_SUITE_P(Scenes, LightTreeTest, testing::ValuesIn(cases()), nameOf);

TEST(LightTree, ImagesDoNotDependOnThreadsAndTiles) {
    for (const char* integrator :
         {R"("path" "string strategy" "tree")", R"("directlighting" "string strategy" "bvh")"}) {
        const BuiltScene built = test::build(sceneOf(cases()[5], integrator, 8));
        EXPECT_EQ(render(built, 3, 1, 16).image.pixels, render(built, 3, 2, 2).image.pixels);
    }
}

TEST(LightTree, FewLightsAreAllSampled) {
    const auto picture = [](int lights, const std::string& strategy) {
        const TreeCase c{"", scattered(kPoint, lights)};
        return render(test::build(sceneOf(c, "\"path\"" + strategy, 1))).image.pixels;
    };
    EXPECT_EQ(picture(128, ""), picture(128, R"("string strategy" "all")"));
    EXPECT_EQ(picture(129, ""), picture(129, R"("string strategy" "tree")"));
    EXPECT_NE(picture(129, ""), picture(129, R"("string strategy" "all")"));
}

TEST(LightTree, BlackLightsAreNotChosen) {
    const std::string black = R"(LightSource "point" "rgb I" [0 0 0] )";
    for (const char* integrator : {"path", "directlighting"}) {
        const std::string tree = std::string("\"") + integrator + R"(" "string strategy" "tree")";
        const BuiltScene built = test::build(sceneOf({"", black + black}, tree));
        const PixelStatistics image = renderSeeds(built, 2);
        EXPECT_EQ(image.mean, std::vector<double>(image.mean.size(), 0));
    }
}

TEST(LightTree, PathsTakeFewerLightSamplesThanDirectLight) {
    const auto picture = [](const std::string& shader, const std::string& parameter) {
        return render(test::build(sceneOf(cases()[0], shader + R"("string strategy" "tree")" + parameter, 2)))
            .image.pixels;
    };
    EXPECT_EQ(picture(R"("path")", ""), picture(R"("path")", R"("integer lightsamples" 4)"));
    EXPECT_EQ(picture(R"("directlighting")", ""),
              picture(R"("directlighting")", R"("integer lightsamples" 16)"));
}

TEST(LightTree, NamesOfPbrtMeanWhatTheySay) {
    const auto picture = [](const std::string& parameter) {
        return render(test::build(sceneOf(cases()[0], "\"path\"" + parameter, 2))).image.pixels;
    };
    const auto one = picture(R"("string strategy" "one")"), tree = picture(R"("string strategy" "tree")");
    EXPECT_EQ(one, picture(R"("string lightsampler" "power")"));
    EXPECT_EQ(tree, picture(R"("string lightsampler" "bvh")"));
    EXPECT_EQ(tree, picture(R"("string lightsamplestrategy" "spatial")"));
    const auto uniform = picture(R"("string lightsamplestrategy" "uniform")");
    const auto exhaustive = picture(R"("string lightsampler" "exhaustive")");
    for (const auto& other : {one, tree})
        for (const auto& image : {uniform, exhaustive})
            EXPECT_NE(image, other);
}

/// Lamps that fly through each other: the bounds of one tree widen, those of intervals do not.
TEST(LightTree, LampsThatCrossHaveTreesForIntervals) {
    const std::string moving = "ActiveTransform EndTime Translate $d $e 0 ActiveTransform All ";
    const BuiltScene built = test::build(sceneOf({"", scattered(moving + kPoint, 500)}, R"("path")"));
    const auto intervals = [&](LightMotion motion) {
        return built.scene->lightTree({false, motion}).intervalCount();
    };
    EXPECT_EQ(intervals(LightMotion::Swept), 1u);
    EXPECT_EQ(intervals(LightMotion::Linear), 1u);
    EXPECT_GT(intervals(LightMotion::Split), 1u);
    const std::string together = "ActiveTransform EndTime Translate 3 2 0 ActiveTransform All ";
    for (const std::string& lights : {scattered(kPoint, 500), together + scattered(kPoint, 500)}) {
        const BuiltScene other = test::build(sceneOf({"", lights}, R"("path")"));
        EXPECT_EQ(other.scene->lightTree({}).intervalCount(), 1u);
    }
}

/// A million coincident, collinear or equal emitters do not end in a deep tree, and the tree is small.
TEST(LightTree, DegenerateEmittersAreSplit) {
    for (const float spacing : {0.f, 1e-3f, 1e10f}) {
        std::vector<TreeEmitter> emitters(20000);
        for (size_t i = 0; i < emitters.size(); ++i) {
            emitters[i].bounds.begin = emitters[i].bounds.end = V3f(spacing * float(i), 0, 0);
            emitters[i].bounds.intensity = i % 3 ? 1.f : 0.f;
            emitters[i].index = uint32_t(i);
        }
        const LightSubtree tree = buildLightTree(emitters, emitters.size(), false);
        EXPECT_EQ(tree.leaves.size(), 13333u);
        EXPECT_EQ(tree.slots[0], LightSubtree::kNoSlot);
        EXPECT_LT(tree.nodes.size() * sizeof(LightNode), 120 * tree.leaves.size());
        for (const uint32_t slot : tree.slots) {
            int depth = 0;
            for (uint32_t s = slot; s != LightSubtree::kNoSlot && s >= LightNode::kWidth; ++depth)
                s = tree.parents[s / LightNode::kWidth];
            ASSERT_LT(depth, 63);
        }
    }
}

/// Scattered emitters take about 100 bytes each.
TEST(LightTree, ScatteredEmittersTakeLittleMemory) {
    for (const size_t count : {1000, 10000, 100000}) {
        std::vector<TreeEmitter> emitters(count);
        for (size_t i = 0; i < count; ++i) {
            EmitterBounds& b = emitters[i].bounds;
            b.begin = b.end = V3f(random1D(1, i), random1D(2, i), random1D(3, i));
            b.intensity = random1D(4, i) + .1f;
            emitters[i].index = uint32_t(i);
        }
        const LightSubtree tree = buildLightTree(emitters, count, false);
        const size_t bytes =
            tree.nodes.size() * sizeof(LightNode) +
            (tree.parents.size() + tree.leaves.size() + tree.slots.size()) * sizeof(uint32_t);
        RecordProperty("bytes" + std::to_string(count), int(bytes));
        EXPECT_LT(bytes, 110 * count);
    }
}

} // namespace
} // namespace strobe
