#include "session/checkpoint.h"

#include "core/math/pixel_rectangles.h"
#include "core/util/version.h"

namespace strobe {

namespace {

std::filesystem::path checkpointFile(const FrameJob& job) {
    return job.options.output.images.front().string() + ".checkpoint";
}

SampleSlice samplesOf(const FrameJob& job, const BuiltScene& built) {
    return job.options.sampleRange.value_or(SampleSlice{0, uint32_t(built.sampler.samplesPerPixel)});
}

bool isFinished(const Film& film, const PixelBounds& pixels, const SampleSlice& samples) {
    return film.hasSampleCount(pixels, samples.count());
}

/// Returns the pixels that have all samples, as rectangles.
std::vector<SampleBox> finishedBoxes(const Film& film, const SampleSlice& samples) {
    std::vector<SampleBox> boxes;
    const auto contains = [&](int x, int y) { return isFinished(film, {x, y, x + 1, y + 1}, samples); };
    for (const PixelBounds& rectangle : rectanglesOf(film.pixelBounds(), contains))
        boxes.push_back({rectangle, samples});
    return boxes;
}

/// Returns the records of pixels of the film that have all samples.
std::vector<FilmRecord> finishedRecords(const FilmRecords& all, const Film& film,
                                        const SampleSlice& samples) {
    std::vector<FilmRecord> records = all.all();
    std::erase_if(records,
                  [&](const FilmRecord& record) { return !isFinished(film, record.pixels, samples); });
    return records;
}

/// Returns the names of AOVs, and what else their layers depend on besides the scene.
std::string aovText(const AovLayout& layout) {
    std::string text;
    for (const Aov aov : layout.aovs) {
        text += (text.empty() ? "" : ",") + std::string(aovInfo(aov).name);
        if (aov == Aov::CryptoObject || aov == Aov::CryptoMaterial)
            text += fmt::format("({})", layout.cryptoLevels);
    }
    return text.empty() ? "none" : text;
}

/// Returns the options of glTF files that are not the default.
std::string gltfText(const BuildOptions& build) {
    std::string text = build.gltfPhotometric ? "" : " web";
    text += build.gltfCulling ? " culling" : "";
    if (build.gltfPointRadius > 0)
        text += fmt::format(" points {}", build.gltfPointRadius);
    text += build.gltfGround ? " ground" : "";
    if (!build.gltfAnimation.empty())
        text += fmt::format(" animation \"{}\"", build.gltfAnimation);
    if (!build.gltfCamera.empty())
        text += fmt::format(" camera \"{}\"", build.gltfCamera);
    return text.empty() ? text : text.substr(1);
}

} // namespace

RenderPart partOf(const Film& film, const FrameJob& job, const BuiltScene& built, const AovLayout& layout) {
    const RenderOptions& options = job.options;
    RenderPart part;
    part.key = {{"version", version()}, {RenderPart::kScene, fmt::format("{:016x}", job.content.hash)}};
    part.files = job.content.files;
    if (const std::string config = options.output.format.color->contentHash(); !config.empty())
        part.key.emplace_back("color config", config);
    for (const auto& [name, value] : built.metadata)
        if (const auto* text = std::get_if<std::string>(&value))
            part.key.emplace_back(name.substr(name.find(':') + 1), *text);
    part.key.emplace_back("bias:clamp", options.clamp > 0 ? fmt::format("{}", options.clamp) : "none");
    part.key.emplace_back("seed", std::to_string(options.seed));
    const Shutter& shutter = built.scene->shutter();
    part.key.emplace_back("shutter", fmt::format("{} {}", shutter.open, shutter.close));
    part.key.emplace_back("aov", aovText(layout));
    if (options.build.transparent)
        part.key.emplace_back("background", "transparent");
    if (const std::string text = gltfText(options.build); !text.empty())
        part.key.emplace_back("glTF options", text);
    if (const std::string note = film.records().note(); !note.empty())
        part.key.emplace_back(RenderPart::kNote, note);
    part.fullWidth = film.fullWidth();
    part.fullHeight = film.fullHeight();
    part.samplesPerPixel = built.sampler.samplesPerPixel;
    part.pixelBounds = film.pixelBounds();
    part.boxes = finishedBoxes(film, samplesOf(job, built));
    part.sums = film.sums();
    part.records = finishedRecords(film.records(), film, samplesOf(job, built));
    part.layout = layout;
    part.layers = finishedRecords(film.layerRecords(), film, samplesOf(job, built));
    return part;
}

Checkpoint::Checkpoint(const FrameJob& job, const BuiltScene& built, AovLayout layout)
    : m_job(job), m_built(built), m_layout(std::move(layout)), m_file(checkpointFile(job)), m_lock(m_file) {
    if (built.integrator->dependence() == SampleDependence::Render)
        throw Error("--checkpoint: samples of this integrator depend on other pixels or on the order of "
                    "rendering: it cannot "
                    "continue a render",
                    ErrorKind::Usage);
    if (!job.options.progressive.resume && exists(job))
        throw Error(m_file.string() + " exists: continue from it with --resume, or remove it to start anew",
                    ErrorKind::Usage);
}

bool Checkpoint::resume(Film& film) const {
    if (!exists(m_job))
        return false;
    const RenderPart part = readPart(m_file);
    // The integrator has not decided yet. Renderer::render compares the decisions.
    film.records().setNote(part.keyValue(RenderPart::kNote));
    RenderPart expected = partOf(film, m_job, m_built, m_layout);
    expected.boxes.clear();
    const SampleSlice samples = samplesOf(m_job, m_built);
    for (const SampleBox& box : part.boxes)
        if (box.samples != samples)
            throw Error(fmt::format("{}: it has samples {}:{}, not {}:{}", m_file.string(), box.samples.first,
                                    box.samples.end, samples.first, samples.end),
                        ErrorKind::Usage);
    addPart(expected, part, m_file);
    const PixelBounds& saved = part.pixelBounds;
    const PixelBounds& own = film.pixelBounds();
    if (saved.x0 != own.x0 || saved.y0 != own.y0 || saved.x1 != own.x1 || saved.y1 != own.y1)
        throw Error(fmt::format("{}: its pixels are {} {} {} {}, not {} {} {} {}", m_file.string(), saved.x0,
                                saved.x1, saved.y0, saved.y1, own.x0, own.x1, own.y0, own.y1),
                    ErrorKind::Usage);
    addToFilm(part, film);
    return true;
}

void Checkpoint::save(const Film& film, FallbackWriter& fallback) const {
    const RenderPart part = partOf(film, m_job, m_built, m_layout);
    if (!part.boxes.empty())
        fallback.write(m_file, [&](const std::filesystem::path& file) { writePart(file, part); });
}

bool Checkpoint::exists(const FrameJob& job) {
    std::error_code ignored; // of a folder that cannot be read
    return std::filesystem::exists(checkpointFile(job), ignored);
}

void Checkpoint::remove(const FrameJob& job) {
    std::error_code ignored; // it may never have been written
    std::filesystem::remove(checkpointFile(job), ignored);
}

} // namespace strobe
