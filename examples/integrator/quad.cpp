// The integrator of docs/tutorial-integrator.md: the samples of neighboring pixels share shades.
#include <strobe/plugin.h>

#include <map>

namespace strobe {

namespace {

const ParamDef<int> kSize{"size", 2, "width of the squares whose samples share, in pixels", nullptr,
                          kAtLeastOne};

/// Samples with equal keys share a shade: they lie in one square of the film and hit one primitive.
struct GroupKey {
    int x, y; ///< of the square, in units of its width
    uint32_t instance, geometry, prim;
    auto operator<=>(const GroupKey&) const = default;
};

/// Maps the samples of one thread to shades.
class QuadWorker : public IntegratorWorker {
  public:
    QuadWorker(const Scene& scene, int size) : m_scene(scene), m_size(float(size)) {}

    /// Requests a shade for the first sample of each group, and for each sample that missed.
    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        m_requestOfGroup.clear();
        m_requestOfSample.clear();
        for (const VisibilitySample& sample : batch.samples) {
            const uint32_t newRequest = uint32_t(requests.size());
            uint32_t request = newRequest;
            if (sample.hit)
                request = m_requestOfGroup.try_emplace(keyOf(sample), newRequest).first->second;
            if (request == newRequest)
                requests.push_back(requestFor(m_scene, batch, sample));
            m_requestOfSample.push_back(request);
        }
    }

    /// Gives each sample the radiance of its request.
    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb> shaded,
                                 std::span<Rgb> values) override {
        for (size_t i = 0; i < values.size(); ++i)
            values[i] = shaded[m_requestOfSample[i]];
        return values;
    }

  private:
    GroupKey keyOf(const VisibilitySample& sample) const {
        return {int(std::floor(sample.film.x / m_size)), int(std::floor(sample.film.y / m_size)),
                sample.hit.instance, sample.hit.geometry, sample.hit.prim};
    }

    const Scene& m_scene;
    const float m_size;
    // Of the current batch:
    std::map<GroupKey, uint32_t> m_requestOfGroup;
    std::vector<uint32_t> m_requestOfSample; ///< by sample; indices of requests
};

class Quad : public Integrator {
  public:
    explicit Quad(int size) : m_size(size) {}

    /// The diagonal of a square. Without a bound if samples of one square may see distant points of a
    /// primitive: at other times, or through other points of the lens.
    BiasBound biasBound(const Scene& scene) const override {
        const bool isBounded = !scene.moves() && !scene.camera().hasLens();
        return {isBounded ? std::sqrt(2.f) * float(m_size) : kInfinity, scene.moves() ? 1.f : 0.f};
    }

    /// The tiles determine which pixels are in a batch, and so which of them can share.
    SampleDependence dependence() const override { return SampleDependence::Render; }

    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext&) const override {
        return std::make_unique<UnsharedState<QuadWorker, int>>(scene, m_size);
    }

  private:
    const int m_size;
};

} // namespace

/// The row of the plugin table.
IntegratorPlugin quadPlugin() {
    return {"quad",
            "samples of neighboring pixels that hit the same primitive share a shade; biased",
            {kSize},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const Quad>(params.get(kSize));
            }};
}

} // namespace strobe

STROBE_PLUGIN_LIBRARY([](strobe::PluginRows& rows) { rows.add(strobe::quadPlugin()); })
