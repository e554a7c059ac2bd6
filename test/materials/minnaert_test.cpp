// The material of docs/tutorial-material.md. The tests of all materials cover its sampling.
#include "materials/minnaert.h"

#include "materials/material_fixture.h"
#include "materials/matte.h"

#include <gtest/gtest.h>

namespace strobe::test {
namespace {

TEST(Minnaert, WithExponentOneIsLambertian) {
    const MaterialPtr minnaert = makeMaterial(minnaertPlugin(), {floatParam("exponent", 1)});
    const MaterialPtr matte = makeMaterial(mattePlugin(), {});
    for (const V3f& wo : viewDirections()) {
        const V3f wi = normalize(V3f(.3f, -.2f, wo.z));
        Rgb f, expected;
        float pdf, expectedPdf;
        minnaert->evalCos(prepared(*minnaert), wo, &wi, 1, &f, &pdf);
        matte->evalCos(prepared(*matte), wo, &wi, 1, &expected, &expectedPdf);
        EXPECT_FLOAT_EQ(f.y, expected.y);
        EXPECT_FLOAT_EQ(pdf, expectedPdf);
    }
}

TEST(Minnaert, ReflectsLessTowardsTheSilhouette) {
    const MaterialPtr material =
        makeMaterial(minnaertPlugin(), {rgbParam("Kd", Rgb(1)), floatParam("exponent", 3)});
    const V3f wo = normalize(V3f(1, 0, 1));
    EXPECT_NEAR(integrate(*material, prepared(*material), wo).albedo, .5, 1e-4) << "cos²45°";
}

TEST(Minnaert, AnExponentBelowOneIsAnError) {
    try {
        makeMaterial(minnaertPlugin(), {floatParam("exponent", .5f)});
        FAIL();
    } catch (const Error& e) {
        EXPECT_STREQ(e.what(), "\"exponent\" must be at least 1");
    }
}

} // namespace
} // namespace strobe::test
