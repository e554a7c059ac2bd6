// Surface points at rest.
#include "sharing/rest_points.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

/// A surface that spins about its normal, the z axis, by a quarter of a turn. `tilted`: its mapped normal at
/// shutter fraction 0.
struct SpinningPoint {
    FirstVertex vertex;
    RawSurfacePoint rest;

    SpinningPoint(bool isMapped, const V3f& tilted, bool isFront) {
        const float side = isFront ? 1.f : -1.f;
        rest.ng = rest.ns = V3f(0, 0, 1);
        rest.dpdu = V3f(2, 0, 0);
        vertex.isFront = isFront;
        vertex.hasMappedNormal = isMapped;
        vertex.n = V3f(0, 0, side);
        vertex.ns = V3f(-tilted.y, tilted.x, tilted.z) * side;
        vertex.dpdu = V3f(0, 2, 0);
    }
};

TEST(ShadingNormalAtRest, TurnsMappedNormalsWithTheSurface) {
    const V3f tilted(0.6f, 0, 0.8f);
    for (const bool isFront : {true, false}) {
        const SpinningPoint point(true, tilted, isFront);
        const V3f found = shadingNormalAtRest(point.vertex, point.rest);
        const V3f expected = isFront ? tilted : -tilted;
        for (int axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(found[axis], expected[axis], 1e-6f) << isFront << axis;
    }
}

TEST(ShadingNormalAtRest, IsTheInterpolatedNormalOfOtherMaterials) {
    const SpinningPoint point(false, V3f(0.6f, 0, 0.8f), false);
    EXPECT_EQ(shadingNormalAtRest(point.vertex, point.rest), -point.rest.ns);
}

TEST(SurfaceOfTilt, DividesASurfaceByTheTiltOfMappedNormals) {
    const V3f up(0, 0, 1);
    const auto tilted = [](float degrees, float azimuth) {
        const float angle = degrees * kPi / 180;
        return V3f(std::sin(angle) * std::cos(azimuth), std::sin(angle) * std::sin(azimuth), std::cos(angle));
    };
    for (int i = 0; i < 16; ++i)
        EXPECT_EQ(surfaceOfTilt(7, up, tilted(15, float(i))), 7u);
    const uint64_t left = surfaceOfTilt(7, up, tilted(40, kPi)), right = surfaceOfTilt(7, up, tilted(40, 0));
    EXPECT_NE(left, 7u);
    EXPECT_NE(right, 7u);
    EXPECT_NE(left, right);
    EXPECT_EQ(surfaceOfTilt(7, up, tilted(38, 0.1f)), right);
    EXPECT_NE(surfaceOfTilt(8, up, tilted(40, 0)), right);
}

} // namespace
} // namespace strobe
