// The correction of light that camera rays hit directly.
#include "sharing/emission/emission_refinement.h"

#include "sharing/frame_light.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

/// The edge of a bright lamp may be missed by all samples of a pixel and its neighbors. Its light must not be
/// lost if additional rays find it.
TEST(EmissionRefinement, AddsLightThatOnlyAdditionalRaysFind) {
    constexpr uint32_t kSamplesPerHalf = 2;
    constexpr int kMore = 60, kHits = 6;
    const PixelBounds bounds{0, 0, 3, 3};
    const Film film(3, 3, bounds);
    FrameLight frame(LightParts(1));
    ASSERT_TRUE(frame.beginTile(film));
    PixelLists lists;
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 3; ++x) {
            PixelLight pixel;
            for (HalfLight& half : pixel.halves)
                for (HalfLight::Quarter& quarter : half.quarters)
                    quarter.count = kSamplesPerHalf / kQuarters;
            frame.setPixel(x, y, pixel, lists);
        }
    PixelAccumulator more;
    for (int i = 0; i < kMore; ++i)
        more.add(Rgb(i < kHits ? 500.f : 0.f), 1);
    lists.refined.push_back({frame.indexOf(1, 1), more});
    frame.add({}, lists);

    const std::vector<PixelCorrection> corrections = emissionCorrections(frame.take(film));
    ASSERT_EQ(corrections.size(), 1u);
    EXPECT_EQ(corrections[0].pixel, frame.indexOf(1, 1));
    // The mean of all rays, as if the samples of the pixel were among them:
    constexpr float kMean = 500.f * kHits / (kMore + kHalves * kSamplesPerHalf);
    EXPECT_NEAR(corrections[0].value.x, kMean, 1e-3f * kMean);
}

} // namespace
} // namespace strobe
