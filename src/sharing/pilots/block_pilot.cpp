#include "sharing/pilots/block_pilot.h"

#include "sharing/emission/emission_refinement.h"
#include "sharing/light_recorder.h"
#include "sharing/reconstruction.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace strobe {

namespace {

static_assert(std::size(kSharingChoices) == kSharingChoiceCount);

/// Records one block at a time.
class BlockState : public IntegratorState {
  public:
    BlockState(const Scene& scene, float cellSize, float clamp, LightParts parts)
        : m_scene(scene), m_cellSize(cellSize), m_clamp(clamp), m_parts(parts), m_frame(parts) {}
    std::unique_ptr<IntegratorWorker> makeWorker() override {
        return std::make_unique<RecordingWorker>(m_scene, m_cellSize, m_clamp, m_parts, m_frame);
    }
    bool observes() const override { return true; }
    /// Returns the light of the film, after its render.
    RecordedLight takeLight(const Film& film) { return m_frame.take(film); }

  private:
    const Scene& m_scene;
    const float m_cellSize, m_clamp;
    const LightParts m_parts;
    FrameLight m_frame;
};

/// Returns the image without the emission that camera rays hit. Its noise is EmissionRefinement's task.
std::vector<Rgb> reflectedLight(std::vector<Rgb> image, const RecordedLight& light) {
    std::vector<Rgb> out = std::move(image);
    for (const PixelEmission& emission : light.emission)
        out[emission.pixel] -= (emission.halves[0].emitted + emission.halves[1].emitted) *
                               (1 / float(light.weight(emission.pixel)));
    return out;
}

/// Clips the radiance of an image: unclipped errors would be those of a few rare bright samples.
void clip(std::vector<Rgb>& image) {
    for (Rgb& pixel : image)
        for (int c = 0; c < 3; ++c)
            pixel[c] = std::min(pixel[c], 1.f);
}

/// Returns the mean of the channels of an image.
double meanOf(const std::vector<Rgb>& image) {
    double sum = 0;
    for (const Rgb& pixel : image)
        for (int c = 0; c < 3; ++c)
            sum += double(pixel[c]);
    return sum / (3 * double(image.size()));
}

/// Returns the weight of the squared errors of an image with this mean: errors are relative to its radiance.
double weightOf(double mean) {
    constexpr double kDark = 0.1; // radiance below which errors do not count as relative ones
    return 1 / (sqr(mean) + sqr(kDark));
}

/// Returns the variance of an image, given two independent renders of it: sum over pixels and channels.
double varianceOf(const std::vector<Rgb>& a, const std::vector<Rgb>& b) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i)
        for (int c = 0; c < 3; ++c)
            sum += sqr(double(a[i][c]) - double(b[i][c]));
    return sum / 2;
}

/// Returns the squared bias of the means over windows of two renders `a` and `b`, whose images without
/// sharing are `ownA` and `ownB`: the product of the differences from the other render, whose noise is
/// independent. Pixel by pixel, this product would have as much noise as the images without sharing, and hide
/// the error of the shared ones.
double squaredBiasOf(const std::vector<Rgb>& a, const std::vector<Rgb>& b, const std::vector<Rgb>& ownA,
                     const std::vector<Rgb>& ownB, int width) {
    constexpr int kWindow = 4; // pixels
    const int height = int(a.size()) / width, columns = (width + kWindow - 1) / kWindow,
              rows = (height + kWindow - 1) / kWindow;
    double sum = 0;
    for (int window = 0; window < columns * rows; ++window) {
        const int left = kWindow * (window % columns), top = kWindow * (window / columns);
        Rgb ofA(0), ofB(0);
        int count = 0;
        for (int y = top; y < std::min(top + kWindow, height); ++y)
            for (int x = left; x < std::min(left + kWindow, width); ++x, ++count) {
                const size_t i = size_t(y * width + x);
                ofA += a[i] - ownB[i];
                ofB += b[i] - ownA[i];
            }
        const Rgb product = ofA * ofB;
        sum += double(product.x + product.y + product.z) / count;
    }
    return std::max(sum, 0.);
}

} // namespace

/// Renders blocks on one thread.
class BlockRenderer::ThreadPilot {
  public:
    ThreadPilot(const Scene& scene, const RenderContext& context, int samplesPerPixel, float cellSize,
                LightParts parts)
        : m_state(scene, cellSize, context.clamp, parts),
          m_renderer(context.makePilotRenderer(m_state, samplesPerPixel)),
          m_film(context.pilotBounds.x1, context.pilotBounds.y1, {}) {}
    std::pair<std::vector<Rgb>, RecordedLight> render(const PixelBounds& block, uint64_t seed) {
        m_film.moveTo(block);
        std::vector<V2i> pixels;
        for (int y = block.y0; y < block.y1; ++y)
            for (int x = block.x0; x < block.x1; ++x)
                pixels.push_back({x, y});
        m_renderer->render(m_film, pixels, seed);
        // The film may be used again while the light is joined: see PerThread.
        std::vector<Rgb> image = m_film.image().pixels;
        return {std::move(image), m_state.takeLight(m_film)};
    }

  private:
    BlockState m_state;
    const std::unique_ptr<PilotRenderer> m_renderer;
    Film m_film;
};

BlockRenderer::BlockRenderer(const Scene& scene, const RenderContext& context, int samplesPerPixel,
                             float cellSize, LightParts parts)
    : m_scene(scene), m_context(context), m_samplesPerPixel(samplesPerPixel), m_cellSize(cellSize),
      m_parts(parts) {}

BlockRenderer::~BlockRenderer() = default;

void BlockRenderer::render(const std::array<uint64_t, 2>& seeds, BlockPilot& block) {
    const Images first = renderOnce(seeds[0], block), second = renderOnce(seeds[1], block);
    const double weight = weightOf((meanOf(first[0]) + meanOf(second[0])) / 2);
    for (size_t choice = 0; choice < kSharingChoiceCount; ++choice) {
        const auto &a = first[choice], &b = second[choice];
        block.errors[choice] = weight * varianceOf(a, b);
        if (choice > 0)
            block.errors[choice] += weight * squaredBiasOf(a, b, first[0], second[0], block.bounds.width());
    }
}

/// Renders a block, sets all measurements but its errors, and returns the clipped images by kSharingChoices.
BlockRenderer::Images BlockRenderer::renderOnce(uint64_t seed, BlockPilot& block) {
    auto [image, light] = m_threads
                              .local([&] {
                                  return std::make_unique<ThreadPilot>(m_scene, m_context, m_samplesPerPixel,
                                                                       m_cellSize, m_parts);
                              })
                              .render(block.bounds, seed);
    block.pixels = double(image.size());
    block.cells = double(light.cells.size());
    block.emissionCoefficient = block.pixels * strobe::emissionCoefficient(light);
    const std::vector<Rgb> own = reflectedLight(std::move(image), light);
    LightSharing sharing(std::move(light));
    SharedPart parts[kParts];
    block.sharedVariance = 0;
    for (const LightPart part : kAllParts) {
        if (m_parts.has(part))
            parts[int(part)] = sharing.share(part);
        for (const PixelSharing& pixel : parts[int(part)].pixels)
            block.sharedVariance += double(pixel.variance);
    }
    Images images;
    for (size_t choice = 0; choice < kSharingChoiceCount; ++choice) {
        images[choice] = own;
        for (const LightPart part : kAllParts)
            if (kSharingChoices[choice].has(part))
                for (size_t i = 0; i < parts[int(part)].correction.size(); ++i)
                    images[choice][i] += parts[int(part)].correction[i];
        clip(images[choice]);
    }
    return images;
}

} // namespace strobe
