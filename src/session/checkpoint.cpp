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

std::string sliceText(const PartHeader& part) {
    return part.slices
               ? fmt::format("slice {} of {}", part.slices->numbers.front() + 1, part.slices->tiles.count)
               : "all slices";
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

PartHeader partHeaderOf(const Film& film, const FrameJob& job, const BuiltScene& built,
                        const AovLayout& layout) {
    const RenderOptions& options = job.options;
    PartHeader part;
    part.key = {{"version", version()}, {PartHeader::kScene, fmt::format("{:016x}", job.content.hash)}};
    part.files = job.content.files;
    if (const std::string config = options.output.format.color->contentHash(); !config.empty())
        part.key.emplace_back("color config", config);
    for (const auto& [name, value] : built.metadata)
        if (const auto* text = std::get_if<std::string>(&value))
            part.key.emplace_back(name.substr(name.find(':') + 1), *text);
    part.key.emplace_back("bias:clamp", options.clamp > 0 ? fmt::format("{}", options.clamp) : "none");
    part.key.emplace_back("seed", std::to_string(options.seed));
    if (job.number && options.slice) { // other parts have the pixels that they cover in their frame keys
        part.key.emplace_back(PartHeader::kFrame, std::to_string(*job.number));
        part.key.emplace_back(PartHeader::kFrameKey, job.key);
    }
    const Shutter& shutter = built.scene->shutter();
    part.key.emplace_back("shutter", fmt::format("{} {}", shutter.open, shutter.close));
    part.key.emplace_back("aov", aovText(layout));
    if (options.build.transparent)
        part.key.emplace_back("background", "transparent");
    if (const std::string text = gltfText(options.build); !text.empty())
        part.key.emplace_back("glTF options", text);
    if (const std::string note = film.records().note(); !note.empty())
        part.key.emplace_back(PartHeader::kNote, note);
    part.fullWidth = film.fullWidth();
    part.fullHeight = film.fullHeight();
    part.samplesPerPixel = built.sampler.samplesPerPixel;
    part.pixelBounds = film.pixelBounds();
    part.boxes = finishedBoxes(film, samplesOf(job, built));
    if (options.slice)
        part.slices = {tilesOfSlices(built, options.slice->count), {options.slice->number}};
    part.layout = layout;
    return part;
}

void writePart(const std::filesystem::path& file, const PartHeader& part, const Film& film) {
    const SampleSlice samples = part.boxes.front().samples;
    PartWriter writer(part);
    writer.addSums(film.sums());
    for (const FilmRecord& record : film.records().all())
        if (isFinished(film, record.pixels, samples))
            writer.addRecord(record);
    for (const FilmRecord& record : film.layerRecords().all())
        if (isFinished(film, record.pixels, samples))
            writer.addLayers(record);
    writer.write(file);
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
    PartReader part(m_file);
    // The integrator has not decided yet. Renderer::render compares the decisions.
    film.records().setNote(part.header().keyValue(PartHeader::kNote));
    checkHeader(part.header(), film);
    addToFilm(part, film);
    return true;
}

/// Throws Error of kind Usage if a checkpoint with this header is not of this render.
void Checkpoint::checkHeader(const PartHeader& saved, const Film& film) const {
    const auto fail = [&](const std::string& reason) {
        throw Error(m_file.string() + ": " + reason, ErrorKind::Usage);
    };
    const PartHeader own = partHeaderOf(film, m_job, m_built, m_layout);
    const SampleSlice samples = samplesOf(m_job, m_built);
    for (const SampleBox& box : saved.boxes)
        if (box.samples != samples)
            fail(fmt::format("it has samples {}:{}, not {}:{}", box.samples.first, box.samples.end,
                             samples.first, samples.end));
    if (const std::string difference = differenceOf(own, saved); !difference.empty())
        fail(difference);
    const PixelBounds &a = saved.pixelBounds, &b = own.pixelBounds;
    if (!(a == b))
        fail(fmt::format("its pixels are {} {} {} {}, not {} {} {} {}", a.x0, a.x1, a.y0, a.y1, b.x0, b.x1,
                         b.y0, b.y1));
    if (sliceText(saved) != sliceText(own))
        fail(fmt::format("it has {}, not {}", sliceText(saved), sliceText(own)));
}

void Checkpoint::save(const Film& film, FallbackWriter& fallback) const {
    const PartHeader part = partHeaderOf(film, m_job, m_built, m_layout);
    if (!part.boxes.empty())
        fallback.write(m_file, [&](const std::filesystem::path& file) { writePart(file, part, film); });
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
