#include "cameras/perspective.h"

#include "cameras/placed_camera.h"
#include "cameras/shutter.h"

#include <limits>

namespace strobe {

namespace {

const ParamDef<float> kFov{"fov", 90,
                           "field of view along the shorter image axis, in degrees, above 0 and below 180"};
const ParamDef<float> kHalfFov{
    "halffov", 0, "half of \"fov\", in degrees, for exporters that write it; default: half of \"fov\""};

/// Returns the direction, with z = 1, from the point `o` of the lens to the point in focus. `shift`: 1 /
/// focal distance; 0 without a lens.
inline V3f lensRayDirection(const ScreenWindow& screen, float shift, const V2f& film, const V3f& o) {
    const V2f p = screen.toScreen(film);
    return {p.x - o.x * shift, p.y - o.y * shift, 1}; // not d * focalDistance - o, which may overflow
}

/// Writes the rays of a static camera with a lens.
STROBE_TARGET_CLONES void staticLensRays(const M44f& m, const ScreenWindow& screen, float radius, float shift,
                                         const CameraSampleSoA& samples, int n, CameraRaySoA& out) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const V2f disk = concentricDisk(samples.lens.at(i));
        const V3f o(disk.x * radius, disk.y * radius, 0);
        const V3f from = transformPoint(m, o);
        const V3f d = normalize(transformVector(m, lensRayDirection(screen, shift, samples.film.at(i), o)));
        out.o.x[i] = from.x;
        out.o.y[i] = from.y;
        out.o.z[i] = from.z;
        out.d.x[i] = d.x;
        out.d.y[i] = d.y;
        out.d.z[i] = d.z;
    }
}

/// Writes the rays of a static pinhole camera, which start at one point.
STROBE_TARGET_CLONES void staticPinholeRays(const M44f& matrix, const ScreenWindow& window,
                                            const CameraSampleSoA& samples, int n, CameraRaySoA& out) {
    const M44f m = matrix; // local copies, which the stores of the loop cannot alias
    const ScreenWindow screen = window;
    constexpr float kMinLength2 = std::numeric_limits<float>::min();
    const V3f from = transformPoint(m, V3f(0));
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const V3f v = transformVector(m, lensRayDirection(screen, 0, samples.film.at(i), V3f(0)));
        const float l2 = length2(v);
        const V3f d = v * (1 / std::sqrt(l2 > kMinLength2 ? l2 : kMinLength2)); // branch-free
        out.o.x[i] = from.x;
        out.o.y[i] = from.y;
        out.o.z[i] = from.z;
        out.d.x[i] = d.x;
        out.d.y[i] = d.y;
        out.d.z[i] = d.z;
    }
}

/// The spread of the cones of pixels, computed from the direction of film point (0,0) and its change per
/// pixel.
struct PixelCones {
    V3f corner, dx, dy;
    float volume;

    STROBE_FORCE_INLINE float spread(float x, float y) const {
        // The solid angle of a pixel is the determinant of (v, dv/dx, dv/dy) over |v|³. The determinant is
        // constant over the film.
        const V3f v = corner + dx * x + dy * y;
        const float l2 = length2(v);
        return std::sqrt(volume / (l2 * std::sqrt(l2)));
    }
};

STROBE_TARGET_CLONES void findSpreads(const PixelCones& cones, const V2SoA& film, int n, float* spread) {
    const PixelCones c = cones;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        spread[i] = c.spread(film.x[i], film.y[i]);
}

class PerspectiveCamera final : public Camera {
  public:
    PerspectiveCamera(const CameraArgs& args, const ScreenWindow& screen, const Lens& lens)
        : m_placement(args.toWorld, args.shutter), m_screen(screen), m_lens(lens) {
        const M44f& m = m_placement.midShutter();
        m_cones.corner = transformVector(m, {screen.origin.x, screen.origin.y, 1});
        m_cones.dx = transformVector(m, {screen.pixel.x, 0, 0});
        m_cones.dy = transformVector(m, {0, screen.pixel.y, 0});
        m_cones.volume = absDot(m_cones.corner, cross(m_cones.dx, m_cones.dy));
    }

    void rays(const CameraSample* samples, int n, Ray* out) const override {
        const float shift = lensShift();
        for (int i = 0; i < n; ++i) {
            const CameraSample& s = samples[i];
            const M44f m = m_placement.at(s.time);
            const V3f o = m_lens.samplePoint(s.lens), d = lensRayDirection(m_screen, shift, s.film, o);
            out[i] = {transformPoint(m, o), normalize(transformVector(m, d)), s.time};
        }
    }
    void raySoA(const CameraSampleSoA& samples, int n, CameraRaySoA& out) const override {
        if (m_placement.moves())
            Camera::raySoA(samples, n, out);
        else if (!hasLens())
            staticPinholeRays(m_placement.midShutter(), m_screen, samples, n, out);
        else
            staticLensRays(m_placement.midShutter(), m_screen, m_lens.radius, lensShift(), samples, n, out);
    }

    RayCone cone(const V2f& film) const override { return {0, m_cones.spread(film.x, film.y)}; }
    void coneSoA(const V2SoA& film, int n, float* width, float* spread) const override {
        std::fill_n(width, n, 0.f);
        findSpreads(m_cones, film, n, spread);
    }

    bool hasLens() const override { return m_lens.radius > 0; }
    bool moves() const override { return m_placement.moves(); }
    V3f position(float time) const override { return transformPoint(m_placement.at(time), V3f(0)); }
    V3f viewpoint(const V3f&, const V2f& lens, float time) const override {
        return transformPoint(m_placement.at(time), m_lens.samplePoint(lens));
    }
    void viewpointSoA(const V3SoA& p, const V2SoA& lens, const float* time, int n,
                      V3SoA& out) const override {
        if (hasLens() || moves())
            return Camera::viewpointSoA(p, lens, time, n, out);
        const V3f origin = position(0);
        std::fill_n(out.x, n, origin.x);
        std::fill_n(out.y, n, origin.y);
        std::fill_n(out.z, n, origin.z);
    }
    std::optional<FilmPoint> project(const V3f& p, float time) const override {
        float depth;
        const V3f q = m_placement.toCamera(p, time, depth);
        if (!(q.z > 0))
            return std::nullopt;
        return FilmPoint{m_screen.toFilm({q.x / q.z, q.y / q.z}), depth};
    }
    std::optional<CameraMatrices> matrices() const override {
        return cameraMatrices(m_placement, m_screen, true);
    }

  private:
    float lensShift() const { return m_lens.radius > 0 ? 1 / m_lens.focalDistance : 0; }

    CameraPlacement m_placement;
    ScreenWindow m_screen; ///< on the plane z = 1
    Lens m_lens;
    PixelCones m_cones; ///< in world space
};

/// Returns half of the field of view in radians. Throws a located Error.
float halfFov(const ParamSet& params) {
    const ParamDef<float>& def = params.has(kHalfFov) ? kHalfFov : kFov;
    if (params.has(kHalfFov) && params.has(kFov))
        throw Error(params.whereIs(kHalfFov), "\"fov\" and \"halffov\" must not both be given");
    const float degrees = params.get(def) * (params.has(kHalfFov) ? 1 : .5f);
    if (!(degrees > 0 && degrees < 90))
        throw Error(params.whereIs(def), "the field of view must be above 0 and below 180 degrees");
    return radians(degrees);
}

std::shared_ptr<const Camera> createPerspective(const ParamSet& params, const BuildContext&,
                                                const CameraArgs& args) {
    ScreenWindow screen = readScreenWindow(params, args.resolution);
    const float scale = std::tan(halfFov(params));
    screen.origin *= scale;
    screen.pixel *= scale;
    return std::make_shared<PerspectiveCamera>(args, screen, readLens(params));
}

} // namespace

Plugin<std::shared_ptr<const Camera>, const CameraArgs&> perspectivePlugin() {
    return {"perspective",
            "pinhole or thin lens camera",
            {kFov, kHalfFov, kScreenWindow, kFrameAspect, kLensRadius, kFocalDistance, kShutterOpen,
             kShutterClose},
            createPerspective};
}

} // namespace strobe
