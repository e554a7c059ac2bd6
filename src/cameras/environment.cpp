#include "cameras/environment.h"

#include "cameras/placed_camera.h"
#include "cameras/shutter.h"
#include "core/math/equal_area.h"

namespace strobe {

namespace {

const ParamDef<std::string> kMapping{"mapping", "equirectangular",
                                     "equirectangular: latitude-longitude; equalarea: octahedral (pbrt-v4), "
                                     "the default of the name \"spherical\""};

/// The octahedral equal-area mapping. y is up, as in the other mapping.
class EqualAreaCamera final : public Camera {
  public:
    explicit EqualAreaCamera(const CameraArgs& args)
        : m_placement(args.toWorld, args.shutter), m_resolution(args.resolution) {}

    void rays(const CameraSample* samples, int n, Ray* out) const override {
        for (int i = 0; i < n; ++i) {
            const CameraSample& s = samples[i];
            const M44f m = m_placement.at(s.time);
            const V3f w = equalAreaDirection(s.film / m_resolution);
            out[i] = {transformPoint(m, V3f(0)), normalize(transformVector(m, {w.x, w.z, w.y})), s.time};
        }
    }
    RayCone cone(const V2f&) const override {
        return {0, std::sqrt(4 * kPi / (m_resolution.x * m_resolution.y))};
    }
    bool hasLens() const override { return false; }
    bool moves() const override { return m_placement.moves(); }
    V3f position(float time) const override { return transformPoint(m_placement.at(time), V3f(0)); }
    V3f viewpoint(const V3f&, const V2f&, float time) const override { return position(time); }
    std::optional<FilmPoint> project(const V3f& p, float time) const override {
        const float distance = length(p - position(time));
        if (!(distance > 0))
            return std::nullopt;
        float depth;
        const V3f q = normalize(m_placement.toCamera(p, time, depth));
        return FilmPoint{equalAreaPoint({q.x, q.z, q.y}) * m_resolution, distance};
    }
    V2f filmStep(const V2f& from, const V2f& to) const override { return to - from; }

  private:
    CameraPlacement m_placement;
    V2f m_resolution; ///< in pixels
};

class EnvironmentCamera final : public Camera {
  public:
    explicit EnvironmentCamera(const CameraArgs& args)
        : m_placement(args.toWorld, args.shutter),
          m_perPixel(2 * kPi / float(args.resolution.x), kPi / float(args.resolution.y)) {}

    void rays(const CameraSample* samples, int n, Ray* out) const override {
        for (int i = 0; i < n; ++i) {
            const CameraSample& s = samples[i];
            const M44f m = m_placement.at(s.time);
            const float phi = s.film.x * m_perPixel.x, theta = s.film.y * m_perPixel.y;
            const float sinTheta = std::sin(theta);
            const V3f d(sinTheta * std::cos(phi), std::cos(theta), sinTheta * std::sin(phi));
            out[i] = {transformPoint(m, V3f(0)), normalize(transformVector(m, d)), s.time};
        }
    }

    RayCone cone(const V2f& film) const override {
        // The solid angle of a whole row of pixels, divided by their number, which does not vanish at the
        // poles.
        const float top = (film.y - .5f) * m_perPixel.y, half = .5f * m_perPixel.y;
        const float center = std::clamp(top + half, half, kPi - half);
        return {0, std::sqrt(m_perPixel.x * 2 * std::sin(center) * std::sin(half))};
    }

    bool hasLens() const override { return false; }
    bool moves() const override { return m_placement.moves(); }
    V3f position(float time) const override { return transformPoint(m_placement.at(time), V3f(0)); }
    V3f viewpoint(const V3f&, const V2f&, float time) const override { return position(time); }
    std::optional<FilmPoint> project(const V3f& p, float time) const override {
        const float distance = length(p - position(time));
        if (!(distance > 0))
            return std::nullopt;
        float depth;
        const V3f q = m_placement.toCamera(p, time, depth);
        const float phi = std::atan2(q.z, q.x), theta = std::atan2(std::hypot(q.x, q.z), q.y);
        return FilmPoint{{(phi < 0 ? phi + 2 * kPi : phi) / m_perPixel.x, theta / m_perPixel.y}, distance};
    }
    V2f filmStep(const V2f& from, const V2f& to) const override {
        const float width = 2 * kPi / m_perPixel.x, x = to.x - from.x; // the film wraps in x
        return {x - width * std::round(x / width), to.y - from.y};
    }

  private:
    CameraPlacement m_placement;
    V2f m_perPixel; ///< azimuth and polar angle of one pixel, in radians
};

std::shared_ptr<const Camera> createEnvironment(const ParamSet& params, const BuildContext&,
                                                const CameraArgs& args) {
    if (parseWord<bool>(params, kMapping, {{"equirectangular", false}, {"equalarea", true}}))
        return std::make_shared<EqualAreaCamera>(args);
    return std::make_shared<EnvironmentCamera>(args);
}

} // namespace

Plugin<std::shared_ptr<const Camera>, const CameraArgs&> environmentPlugin() {
    return {"environment",
            "all directions, as a latitude-longitude image or an octahedral map",
            {kMapping, kShutterOpen, kShutterClose},
            createEnvironment};
}

} // namespace strobe
