#include "cameras/orthographic.h"

#include "cameras/placed_camera.h"
#include "cameras/shutter.h"

namespace strobe {

namespace {

class OrthographicCamera final : public Camera {
  public:
    OrthographicCamera(const CameraArgs& args, const ScreenWindow& screen, const Lens& lens)
        : m_placement(args.toWorld, args.shutter), m_screen(screen), m_lens(lens) {
        const M44f& m = m_placement.middle();
        const V3f axis = normalize(transformVector(m, {0, 0, 1}));
        const V3f dx = transformVector(m, {screen.pixel.x, 0, 0});
        const V3f dy = transformVector(m, {0, screen.pixel.y, 0});
        m_width = std::sqrt(absDot(axis, cross(dx, dy))); // of the pixel, seen along the axis
    }

    void rays(const CameraSample* samples, int n, Ray* out) const override {
        for (int i = 0; i < n; ++i) {
            const CameraSample& s = samples[i];
            const M44f m = m_placement.at(s.time);
            const V2f p = m_screen.at(s.film);
            const V3f lens = m_lens.at(s.lens), o = V3f(p.x, p.y, 0) + lens, d = direction(lens);
            out[i] = {transformPoint(m, o), normalize(transformVector(m, d)), s.time};
        }
    }

    RayCone cone(const V2f&) const override { return {m_width, 0}; }
    bool hasLens() const override { return m_lens.radius > 0; }
    bool moves() const override { return m_placement.moves(); }
    V3f position(float time) const override { return transformPoint(m_placement.at(time), V3f(0)); }
    V3f viewpoint(const V3f& p, const V2f& lens, float time) const override {
        const M44f m = m_placement.at(time);
        const V3f inCamera = transformPoint(m.inverse(), p);
        return transformPoint(m, inCamera - direction(m_lens.at(lens)) * inCamera.z);
    }
    std::optional<FilmPoint> project(const V3f& p, float time) const override {
        float depth;
        const V3f at = m_placement.toCamera(p, time, depth);
        if (!(at.z > 0))
            return std::nullopt;
        return FilmPoint{m_screen.filmAt({at.x, at.y}), depth};
    }

  private:
    /// In camera space, with z = 1.
    V3f direction(const V3f& lens) const {
        return m_lens.radius > 0 ? V3f(0, 0, 1) - lens * (1 / m_lens.focalDistance) : V3f(0, 0, 1);
    }

    CameraPlacement m_placement;
    ScreenWindow m_screen;
    Lens m_lens;
    float m_width;
};

std::shared_ptr<const Camera> createOrthographic(const ParamSet& params, const BuildContext&,
                                                 const CameraArgs& args) {
    return std::make_shared<OrthographicCamera>(args, readScreenWindow(params, args.resolution),
                                                readLens(params));
}

} // namespace

Plugin<std::shared_ptr<const Camera>, const CameraArgs&> orthographicPlugin() {
    return {"orthographic",
            "parallel rays",
            {kScreenWindow, kFrameAspect, kLensRadius, kFocalDistance, kShutterOpen, kShutterClose},
            createOrthographic};
}

} // namespace strobe
