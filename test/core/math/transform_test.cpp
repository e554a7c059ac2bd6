#include "core/math/transform.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

M44f rotationZ(float degrees) {
    M44f m;
    m.setEulerAngles(V3f(0, 0, radians(degrees)));
    return m;
}
M44f translation(const V3f& t) {
    M44f m;
    m.setTranslation(t);
    return m;
}
M44f scaling(const V3f& s) {
    M44f m;
    m.setScale(s);
    return m;
}

void expectNear(const M44f& a, const M44f& b, float tolerance) {
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            EXPECT_NEAR(a[i][j], b[i][j], tolerance) << i << ',' << j;
}

TEST(Transform, ComposeInvertsDecompose) {
    const M44f m = scaling({1, 2, 3}) * rotationZ(33) * scaling({2, 1, 1}) * translation({4, 5, 6});
    expectNear(compose(decompose(m)), m, 2e-6f);
    const M44f mirrored = scaling({-1, 2, 3}) * rotationZ(33) * translation({4, 5, 6});
    expectNear(compose(decompose(mirrored)), mirrored, 2e-6f);
}

TEST(Transform, RotationsAreInterpolatedAsQuaternions) {
    const KeyedTransform t({0, 1}, {M44f(), rotationZ(90)}, MotionConvention::ObjectToWorld);
    expectNear(t.at(0.5f), rotationZ(45), 1e-6f);
    expectNear(t.at(-1), M44f(), 0);
    expectNear(t.at(2), rotationZ(90), 0);
}

TEST(Transform, WorldToObjectConventionInterpolatesTheInverse) {
    // The keys of the scene anim-moving-reflection.
    const M44f end = scaling({1, 1.5f, 1}) * rotationZ(10) * translation({0, 0, 0});
    const M44f start = translation({.3f, 0, 0});
    const KeyedTransform t({0, 1}, {start, end}, MotionConvention::WorldToObject);
    const float x = 0.37f;
    // World-to-object applies the stretch, then the rotation by -10 x degrees, then the translation of the
    // inverse.
    M44f worldToObject =
        (M44f() * (1 - x) + (rotationZ(-10) * scaling({1, 1 / 1.5f, 1}) * rotationZ(10)) * x);
    worldToObject[3][3] = 1;
    worldToObject = worldToObject * rotationZ(-10 * x) * translation({-.3f * (1 - x), 0, 0});
    expectNear(t.at(x), worldToObject.inverse(), 2e-5f);
}

TEST(Transform, NearlyEqualKeysMakeAStaticTransform) {
    M44f other = rotationZ(20);
    other[3][0] += 1e-7f;
    EXPECT_TRUE(KeyedTransform({0, 1}, {rotationZ(20), other}, MotionConvention::ObjectToWorld).isStatic());
    EXPECT_TRUE(
        KeyedTransform({0, 1}, {rotationZ(20), rotationZ(20)}, MotionConvention::ObjectToWorld).isStatic());
    other[3][0] += 1e-3f;
    EXPECT_FALSE(KeyedTransform({0, 1}, {rotationZ(20), other}, MotionConvention::ObjectToWorld).isStatic());
}

TEST(Transform, SmallChangesFarFromTheOriginAreMotion) {
    const auto isStatic = [](const M44f& last) {
        return KeyedTransform({0, 1}, {translation({1e4f, 0, 1e6f}), last}, MotionConvention::ObjectToWorld)
            .isStatic();
    };
    EXPECT_FALSE(isStatic(rotationZ(.01f) * translation({1e4f, 0, 1e6f})));
    EXPECT_FALSE(isStatic(scaling({1, 1, 1.0001f}) * translation({1e4f, 0, 1e6f})));
    EXPECT_FALSE(isStatic(translation({1e4f, 10, 1e6f})));
    EXPECT_TRUE(isStatic(rotationZ(1e-6f) * translation({1e4f, .1f, 1e6f})));
}

TEST(Transform, ChainAppliesTheInnermostTransformFirst) {
    TransformChain path(KeyedTransform(translation({1, 0, 0})));
    path.append(KeyedTransform(rotationZ(90)));
    const V3f p = transformPoint(path.at(0), V3f(0));
    EXPECT_NEAR(p.x, 0, 1e-6);
    EXPECT_NEAR(p.y, 1, 1e-6);
    EXPECT_TRUE(path.isStatic());
}

class MotionFit : public testing::Test {
  protected:
    static constexpr float kTolerance = 1e-3f;
    const Box3f box{V3f(-1), V3f(1)};

    /// Checks that `motion` deviates from `path` by at most 1.2 kTolerance at 501 times.
    void expectFollows(const Motion& motion, const TransformChain& path, const Shutter& shutter) {
        for (int i = 0; i <= 500; ++i) {
            const float t = float(i) / 500;
            const M44f expected = path.at(shutter.sceneTime(t));
            const M44f fitted = motion.at(t);
            for (const V3f& corner : {V3f(-1), V3f(1), V3f(1, -1, 1)})
                EXPECT_LE(length(transformPoint(expected, corner) - transformPoint(fitted, corner)),
                          1.2f * kTolerance);
        }
    }
};

TEST_F(MotionFit, TranslationNeedsTwoMatrices) {
    const TransformChain path(
        KeyedTransform({0, 1}, {M44f(), translation({5, 0, 0})}, MotionConvention::ObjectToWorld));
    const Motion motion(path, {0, 1}, box, kTolerance);
    EXPECT_EQ(motion.keyCount(), 2);
    EXPECT_FALSE(motion.usesRotation());
    EXPECT_TRUE(motion.onlyTranslates());
    expectFollows(motion, path, {0, 1});
}

TEST_F(MotionFit, ScalingIsNotATranslation) {
    const M44f small = scaling(V3f(1e-4f));
    const auto onlyTranslates = [&](const M44f& last) {
        const TransformChain path(KeyedTransform({0, 1}, {small, last}, MotionConvention::WorldToObject));
        return Motion(path, {.1f, .6f}, box, kTolerance).onlyTranslates();
    };
    EXPECT_TRUE(onlyTranslates(small * translation({5, 2, 1})));
    EXPECT_FALSE(onlyTranslates(scaling(V3f(1.1e-4f)) * translation({5, 2, 1})));
}

TEST_F(MotionFit, FullTurnNeedsFiveKeysAtMost) {
    std::vector<M44f> keys;
    for (int i = 0; i <= 4; ++i)
        keys.push_back(rotationZ(90.f * float(i)));
    const TransformChain path(KeyedTransform({0, .25f, .5f, .75f, 1}, keys, MotionConvention::ObjectToWorld));
    const Motion motion(path, {0, 1}, box, kTolerance);
    EXPECT_TRUE(motion.usesRotation());
    EXPECT_FALSE(motion.onlyTranslates());
    EXPECT_LE(motion.keyCount(), 5);
    expectFollows(motion, path, {0, 1});
}

TEST_F(MotionFit, FitsNestedTransformsWithUnevenKeysAndStretch) {
    TransformChain path(KeyedTransform({0, .2f, 1},
                                       {M44f(), rotationZ(40) * scaling({1, 2, 1}), translation({1, 2, 3})},
                                       MotionConvention::WorldToObject));
    path.append(KeyedTransform({0, 1}, {M44f(), rotationZ(-70)}, MotionConvention::ObjectToWorld));
    const Shutter shutter{.05f, .8f};
    const Motion motion(path, shutter, box, kTolerance);
    EXPECT_TRUE(motion.converged());
    expectFollows(motion, path, shutter);
}

TEST_F(MotionFit, AtSoAEqualsAt) {
    const auto moving = [&](const M44f& last) {
        return Motion(KeyedTransform({0, 1}, {M44f(), last}, MotionConvention::WorldToObject), {0, 1}, box,
                      kTolerance);
    };
    const Motion motions[] = {Motion(translation({1, 2, 3})), moving(translation({5, 0, 0})),
                              moving(scaling({1, 2, 1}) * translation({5, 0, 0})), moving(rotationZ(170))};
    EXPECT_TRUE(motions[2].keyCount() > 2 && !motions[2].usesRotation());
    EXPECT_TRUE(motions[3].usesRotation());
    float time[kSoAWidth];
    for (int i = 0; i < kSoAWidth; ++i)
        time[i] = float(i) / float(kSoAWidth - 1);
    for (const Motion& motion : motions) {
        AffineSoA transforms;
        motion.atSoA(time, 0, 3, transforms);
        motion.atSoA(time, 3, kSoAWidth, transforms);
        for (int i = 0; i < kSoAWidth; ++i) {
            const M44f m = motion.at(time[i]);
            const V3f rows[] = {transforms.x.at(i), transforms.y.at(i), transforms.z.at(i),
                                transforms.o.at(i)};
            for (int row = 0; row < 4; ++row)
                EXPECT_EQ(rows[row], V3f(m[row][0], m[row][1], m[row][2])) << i;
        }
    }
}

TEST_F(MotionFit, MotionOutsideTheShutterIntervalIsStatic) {
    const TransformChain path(KeyedTransform({0, .5f, 1}, {M44f(), M44f(), translation({5, 0, 0})},
                                             MotionConvention::ObjectToWorld));
    EXPECT_TRUE(Motion(path, {0, .5f}, box, kTolerance).isStatic());
    EXPECT_TRUE(Motion(path, {.8f, .8f}, box, kTolerance).isStatic());
    EXPECT_FALSE(Motion(path, {0, .6f}, box, kTolerance).isStatic());
}

} // namespace
} // namespace strobe
