// Bump maps, normal maps and mixes.
#include "materials/material_fixture.h"
#include "materials/matte.h"
#include "materials/metal.h"
#include "materials/mirror.h"
#include "materials/mix.h"
#include "materials/normals.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe::test {
namespace {

/// A plane over uv or over the position: a + b·uv + c·p.
class Slope : public Texture {
  public:
    Slope(const V2f& ofUv, const V3f& ofP) : m_ofUv(ofUv), m_ofP(ofP) {}
    Rgb rgb(const TextureQuery& q) const override { return Rgb(value(q)); }
    float value(const TextureQuery& q) const override { return q.uv.dot(m_ofUv) + dot(q.p, m_ofP); }

  private:
    V2f m_ofUv;
    V3f m_ofP;
};

FloatInput slope(const V2f& ofUv, const V3f& ofP) {
    FloatInput in(0);
    in.texture = std::make_shared<Slope>(ofUv, ofP);
    return in;
}

V3f unit(const V3f& v) { return v * (1 / std::sqrt(length2(v))); }

void expectNear(const V3f& a, const V3f& b) {
    EXPECT_NEAR(a.x, b.x, 1e-4f);
    EXPECT_NEAR(a.y, b.y, 1e-4f);
    EXPECT_NEAR(a.z, b.z, 1e-4f);
}

TEST(BumpMap, NormalsAreThoseOfTheDisplacedPlane) {
    TextureQuery q;
    q.uv = V2f(0);
    q.p = V3f(0);
    q.duvdx = V2f(.01f, 0);
    q.duvdy = V2f(0, .02f);
    const TangentFrame frame{V3f(2, 0, 0), V3f(0, 4, 0), V3f(0, 0, 1), false};
    // The height rises by 1 per u, hence by 1/2 per x, and by -2 per v, hence by -1/2 per y.
    const V3f expected = unit(V3f(-.5f, .5f, 1));
    for (const FloatInput& height : {slope({1, -2}, V3f(0)), slope(V2f(0), {.5f, -.5f, 0})})
        for (const BumpTangents tangents : {BumpTangents::Exact, BumpTangents::Unit, BumpTangents::EqualToDu})
            expectNear(unit(makeBumpMap(height, tangents)->normal(q, frame)), expected);
    TangentFrame below = frame; // the height is along the normal, whichever side that is
    below.n = V3f(0, 0, -1);
    expectNear(unit(makeBumpMap(slope({1, -2}, V3f(0)), BumpTangents::Exact)->normal(q, below)),
               unit(V3f(-.5f, .5f, -1)));
    EXPECT_TRUE(makeBumpMap(slope({1, 0}, V3f(0)), BumpTangents::Exact)->needsFootprint());
}

TEST(BumpMap, MeshesWithVertexNormalsFollowTheVersionOfPbrt) {
    TextureQuery q; // without a footprint
    q.uv = V2f(0);
    q.p = V3f(0);
    const TangentFrame frame{V3f(2, 0, .5f), V3f(0, 4, 0), V3f(0, 0, 1), true};
    const FloatInput height = slope({1, 1}, V3f(0));
    const float length = std::sqrt(4.25f);
    expectNear(unit(makeBumpMap(height, BumpTangents::Exact)->normal(q, frame)),
               unit(V3f(-1 / length, -.25f, 1)));
    expectNear(unit(makeBumpMap(height, BumpTangents::Unit)->normal(q, frame)), unit(V3f(-1, -1, 1)));
    expectNear(unit(makeBumpMap(height, BumpTangents::EqualToDu)->normal(q, frame)),
               unit(V3f(-1 / length, -1 / length, 1)));
    const TangentFrame none{V3f(0), V3f(0), V3f(0, 0, 1), false}; // no texture coordinates: any unit tangents
    EXPECT_NEAR(unit(makeBumpMap(height, BumpTangents::Exact)->normal(q, none)).z, 1 / std::sqrt(3.f), 1e-3f);
}

TEST(NormalMap, TiltsAlongTheTangents) {
    class Constant : public Texture {
        Rgb rgb(const TextureQuery&) const override { return {.75f, .6f, 1}; }
    };
    const NormalsPtr normals = makeNormalMap(std::make_shared<Constant>(), 2);
    const TangentFrame frame{V3f(3, 0, 0), V3f(0, 2, 0), V3f(0, 0, 1), true};
    expectNear(normals->normal({}, frame), V3f(1, .4f, 1));
    const TangentFrame mirrored{V3f(3, 0, 0), V3f(0, -2, 0), V3f(0, 0, 1), true};
    expectNear(normals->normal({}, mirrored), V3f(1, -.4f, 1));
}

TEST(MaterialWithNormals, IsItsBaseButForTheNormal) {
    const MaterialPtr base = makeMaterial(mattePlugin(), {rgbParam("Kd", Rgb(.5f))});
    const MaterialPtr bumped = withNormals(base, makeBumpMap(slope({1, 0}, V3f(0)), BumpTangents::Exact));
    EXPECT_EQ(bumped->flags().shadingNormal, ShadingNormal::Mapped);
    EXPECT_TRUE(bumped->flags().needsFootprint);
    EXPECT_EQ(bumped->flags().diffuse, base->flags().diffuse);
    const Bsdf a = prepared(*base), b = prepared(*bumped);
    const V3f wo = unit(V3f(.3f, .1f, 1)), wi = unit(V3f(-.5f, .2f, 1));
    Rgb f, g;
    base->evalCos(a, wo, &wi, 1, &f, nullptr);
    bumped->evalCos(b, wo, &wi, 1, &g, nullptr);
    EXPECT_EQ(f, g);
    EXPECT_EQ(base->albedo(a), bumped->albedo(b));
    EXPECT_EQ(base->reflectance(a, wo), bumped->reflectance(b, wo));
    EXPECT_EQ(base->maxPdf(a, wo), bumped->maxPdf(b, wo));
    const MaterialPtr metal = makeMaterial(metalPlugin(), {});
    EXPECT_FALSE(bumped->isSpecular(b));
    EXPECT_TRUE(withNormals(metal, makeBumpMap(slope({1, 0}, V3f(0)), BumpTangents::Exact))
                    ->isSpecular(prepared(*metal)));
}

/// In a uniform environment, a white mirror is white under all bump maps: its reflections are kept above the
/// surface.
TEST(MaterialWithNormals, MirrorsKeepTheirReflectionsAboveTheSurface) {
    const auto mean = [](const std::string& material) {
        const std::string scene = R"(
Film "image" "integer xresolution" 64 "integer yresolution" 64
Sampler "sobol" "integer pixelsamples" 16
Integrator "path" "integer maxdepth" 3
LookAt 0 -3 .6  0 0 0  0 0 1
Camera "perspective" "float fov" 20
WorldBegin
LightSource "infinite" "rgb L" [1 1 1]
Texture "bumps" "float" "fbm"
Texture "high" "float" "scale" "texture tex1" "bumps" "float tex2" 10
Material )" + material + R"(
Scale 4 4 4
Shape "disk"
)";
        const Image image = render(build(scene)).image;
        double sum = 0;
        for (const Rgb& c : image.pixels)
            sum += c.x / double(image.pixels.size());
        return sum;
    };
    EXPECT_NEAR(mean(R"("mirror" "rgb Kr" [1 1 1] "texture displacement" "high")"), 1, 1e-4);
    EXPECT_NEAR(mean(R"("matte" "rgb Kd" [1 1 1])"), 1, .01);
    EXPECT_NEAR(mean(R"("matte" "rgb Kd" [1 1 1] "texture bumpmap" "high")"), 1,
                .01); // both sides of the horizon count
}

TEST(Mix, ChoosesByTheAmount) {
    const MaterialPtr a = makeMaterial(mattePlugin(), {}), b = makeMaterial(mirrorPlugin(), {});
    Random random(1);
    for (const float amount : {0.f, .3f, 1.f}) {
        const MaterialPtr mix = makeMix(a, b, amount, 0), other = makeMix(a, b, amount, 1);
        int seconds = 0, differences = 0;
        constexpr int kCount = 10000;
        for (int i = 0; i < kCount; ++i) {
            TextureQuery q;
            q.p = random.direction() * 100;
            const Material& chosen = mix->chosen(q);
            EXPECT_EQ(&chosen, &mix->chosen(q));
            EXPECT_TRUE(&chosen == a.get() || &chosen == b.get());
            seconds += &chosen == b.get();
            differences += &chosen != &other->chosen(q);
        }
        EXPECT_NEAR(seconds, kCount * amount, 5 * std::sqrt(kCount * amount * (1 - amount)));
        EXPECT_NEAR(differences, kCount * 2 * amount * (1 - amount), 250);
    }
    const MaterialFlags flags = makeMix(a, b, .5f, 0)->flags();
    EXPECT_TRUE(flags.isMix && flags.smooth && flags.textured);
    EXPECT_FALSE(flags.diffuse);
    const MaterialPtr nested = makeMix(b, makeMix(b, a, 1, 0), 1, 1);
    EXPECT_EQ(&nested->chosen({}), a.get());
}

} // namespace
} // namespace strobe::test
