#include "session/checkpoint.h"

#include <fmt/format.h>

namespace strobe {

namespace {

std::filesystem::path fileOf(const Options& options) {
    return options.outputs.front().string() + ".checkpoint";
}

SampleSlice samplesOf(const Options& options, const BuiltScene& built) {
    return options.samples.value_or(SampleSlice{0, uint32_t(built.sampler.samplesPerPixel)});
}

/// The pixels that have all samples, as rectangles: runs of rows, those that repeat in one.
std::vector<SampleBox> fullBoxes(const Film& film, const SampleSlice& samples) {
    std::vector<SampleBox> boxes;
    const PixelBounds& w = film.pixelBounds();
    std::vector<size_t> above; // boxes that reach down to the row before
    for (int y = w.y0; y < w.y1; ++y) {
        std::vector<size_t> open;
        for (int x = w.x0; x < w.x1;) {
            int end = x;
            while (end < w.x1 && film.hasSampleCount({end, y, end + 1, y + 1}, samples.count()))
                ++end;
            if (end > x) {
                const auto same = std::find_if(above.begin(), above.end(), [&](size_t i) {
                    return boxes[i].pixelBounds.x0 == x && boxes[i].pixelBounds.x1 == end;
                });
                open.push_back(same != above.end() ? *same : boxes.size());
                if (same == above.end())
                    boxes.push_back({{x, y, end, y}, samples});
                boxes[open.back()].pixelBounds.y1 = y + 1;
            }
            x = end + 1;
        }
        above = std::move(open);
    }
    return boxes;
}

} // namespace

RenderPart partOf(const Film& film, const Options& options, const BuiltScene& built) {
    RenderPart part;
    part.key = {{"version", STROBE_VERSION}, {"scene", fmt::format("{:016x}", options.content)}};
    for (const auto& [name, value] : built.metadata)
        if (const auto* text = std::get_if<std::string>(&value))
            part.key.emplace_back(name.substr(name.find(':') + 1), *text);
    part.key.emplace_back("bias:clamp", options.clamp > 0 ? fmt::format("{}", options.clamp) : "none");
    part.key.emplace_back("seed", std::to_string(options.seed));
    const Shutter& shutter = built.scene->shutter();
    part.key.emplace_back("shutter", fmt::format("{} {}", shutter.open, shutter.close));
    part.fullWidth = film.fullWidth(), part.fullHeight = film.fullHeight();
    part.samplesPerPixel = built.sampler.samplesPerPixel;
    part.pixelBounds = film.pixelBounds();
    part.boxes = fullBoxes(film, samplesOf(options, built));
    part.sums = film.sums();
    return part;
}

Checkpoint::Checkpoint(const Options& options, const BuiltScene& built)
    : m_options(options), m_built(built), m_file(fileOf(options)) {
    if (built.integrator->dependence() == SampleDependence::Render)
        throw Error(
            "--checkpoint: this integrator's samples depend on the course of the render, which cannot be "
            "taken up again",
            ErrorKind::Usage);
    if (!options.resume && std::filesystem::exists(m_file))
        throw Error(m_file.string() + " is there: --resume goes on from it; remove it to begin anew",
                    ErrorKind::Usage);
}

bool Checkpoint::resume(Film& film) const {
    if (!std::filesystem::exists(m_file))
        return false;
    const RenderPart part = readPart(m_file);
    RenderPart expected = partOf(film, m_options, m_built);
    expected.boxes.clear();
    const SampleSlice samples = samplesOf(m_options, m_built);
    const PixelBounds &w = part.pixelBounds, &own = film.pixelBounds();
    for (const SampleBox& box : part.boxes)
        if (box.samples != samples)
            throw Error(fmt::format("{}: it has samples {}:{}, not {}:{}", m_file.string(), box.samples.first,
                                    box.samples.end, samples.first, samples.end),
                        ErrorKind::Usage);
    addPart(expected, part, m_file);
    if (w.x0 != own.x0 || w.y0 != own.y0 || w.x1 != own.x1 || w.y1 != own.y1)
        throw Error(fmt::format("{}: its pixels are {} {} {} {}, not {} {} {} {}", m_file.string(), w.x0,
                                w.x1, w.y0, w.y1, own.x0, own.x1, own.y0, own.y1),
                    ErrorKind::Usage);
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x)
            film.add(x, y, part.sums[size_t(y - w.y0) * size_t(w.width()) + size_t(x - w.x0)]);
    return true;
}

void Checkpoint::save(const Film& film, FallbackWriter& rescue) const {
    const RenderPart part = partOf(film, m_options, m_built);
    if (!part.boxes.empty()) // else there is nothing to lose
        rescue.write(m_file, [&](const std::filesystem::path& file) { writePart(file, part); });
}

void Checkpoint::remove(const Options& options) {
    std::error_code ignored; // it may never have been written
    std::filesystem::remove(fileOf(options), ignored);
}

} // namespace strobe
