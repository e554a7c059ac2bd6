#include "cameras/orthographic.h"

#include "cameras/placed_camera.h"
#include "cameras/shutter.h"

namespace strobe {

namespace {

class OrthographicCamera final : public Camera {
  public:
    OrthographicCamera(const CameraArgs& args, const ScreenWindow& screen, const Lens& lens)
        : m_placement(args.toWorld, args.shutter), m_screen(screen), m_lens(lens) {
        const M44f& m = m_placement.midShutter();
        const V3f axis = normalize(transformVector(m, {0, 0, 1}));
        const V3f dx = transformVector(m, {screen.pixel.x, 0, 0});
        const V3f dy = transformVector(m, {0, screen.pixel.y, 0});
        m_width = std::sqrt(absDot(axis, cross(dx, dy))); // of a pixel, projected along the axis
    }

    void rays(const CameraSample* samples, int n, Ray* out) const override {
        for (int i = 0; i < n; ++i) {
            const CameraSample& s = samples[i];
            const M44f m = m_placement.at(s.time);
            const V2f p = m_screen.toScreen(s.film);
            const V3f lens = m_lens.samplePoint(s.lens), o = V3f(p.x, p.y, 0) + lens, d = direction(lens);
            out[i] = {transformPoint(m, o), normalize(transformVector(m, d)), s.time};
        }
    }

    RayCone cone(const V2f&) const override { return {m_width, 0}; }
    bool hasLens() const override { return m_lens.radius > 0; }
    bool moves() const override { return m_placement.moves(); }
    V3f position(float time) const override { return transformPoint(m_placement.at(time), V3f(0)); }
    V3f viewpoint(const V3f& p, const V2f& lens, float time) const override {
        const M44f m = m_placement.at(time);
        const V3f cameraPoint = transformPoint(m.inverse(), p);
        return transformPoint(m, cameraPoint - direction(m_lens.samplePoint(lens)) * cameraPoint.z);
    }
    std::optional<FilmPoint> project(const V3f& p, float time) const override {
        float depth;
        const V3f q = m_placement.toCamera(p, time, depth);
        if (!(q.z > 0))
            return std::nullopt;
        return FilmPoint{m_screen.toFilm({q.x, q.y}), depth};
    }
    std::optional<CameraMatrices> matrices() const override {
        return cameraMatrices(m_placement, m_screen, false);
    }

  private:
    /// Returns the direction of the ray from a point of the lens, in camera space with z = 1.
    V3f direction(const V3f& lens) const {
        return m_lens.radius > 0 ? V3f(0, 0, 1) - lens * (1 / m_lens.focalDistance) : V3f(0, 0, 1);
    }

    CameraPlacement m_placement;
    ScreenWindow m_screen;
    Lens m_lens;
    float m_width; ///< of a pixel, in scene units
};

std::shared_ptr<const Camera> createOrthographic(const ParamSet& params, const BuildContext&,
                                                 const CameraArgs& args) {
    return std::make_shared<OrthographicCamera>(args, readScreenWindow(params, args.resolution),
                                                readLens(params));
}

} // namespace

Plugin<std::shared_ptr<const Camera>, const CameraArgs&> orthographicPlugin() {
    return {"orthographic",
            "parallel rays, optionally with a thin lens",
            {kScreenWindow, kFrameAspect, kLensRadius, kFocalDistance, kShutterOpen, kShutterClose},
            createOrthographic};
}

} // namespace strobe
