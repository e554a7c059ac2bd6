#include "core/render/aov_film.h"

#include <fmt/format.h>

namespace strobe {

namespace {

// Sampler dimensions between those of the camera sample and those of shaders.
enum : uint32_t { kDimAlbedoLobe = 3, kDimAlbedoDirection = 4 };
/// The depth of a miss: behind all surfaces, but small enough for image filters; Blender uses the same.
constexpr float kMissDepth = 1e10f;

enum class Kind { Nearest, Mean, Cryptomatte };

Kind kindOf(Aov aov) {
    switch (aov) {
    case Aov::Normal:
    case Aov::Albedo:
        return Kind::Mean;
    case Aov::CryptoObject:
    case Aov::CryptoMaterial:
        return Kind::Cryptomatte;
    default:
        return Kind::Nearest;
    }
}

/// Returns whether the AOV identifies objects, rather than materials.
bool identifiesObjects(Aov aov) { return aov == Aov::ObjectId || aov == Aov::CryptoObject; }

bool needsSurface(Aov aov) { return aov == Aov::Position || aov == Aov::Uv; }

V2f centerOf(const PixelRef& pixel) { return {float(pixel.x) + 0.5f, float(pixel.y) + 0.5f}; }

} // namespace

AovFilm::AovFilm(const Scene& scene, const Sampler& sampler, const PixelBounds& pixelBounds,
                 AovFilmSettings settings)
    : m_scene(scene), m_sampler(sampler), m_pixelBounds(pixelBounds), m_settings(std::move(settings)),
      m_moves(scene.moves()) {
    const size_t pixels = size_t(pixelBounds.width()) * size_t(pixelBounds.height());
    m_sampleCounts.assign(pixels, 0);
    for (const Aov aov : m_settings.aovs) {
        if (identifiesObjects(aov) && !m_objects)
            m_objects.emplace(scene);
        const size_t channels = aovInfo(aov).channels.size();
        switch (kindOf(aov)) {
        case Kind::Nearest:
            m_nearest.push_back({aov, channels, std::vector<float>(pixels * channels)});
            m_distance2.assign(pixels, kInfinity);
            m_nearestNeedsSurface |= needsSurface(aov);
            break;
        case Kind::Mean:
            m_means.push_back({aov, std::vector<double>(3 * pixels)});
            break;
        case Kind::Cryptomatte:
            m_cryptomattes.push_back({aov, std::vector<CryptomatteCounts>(pixels)});
            break;
        }
    }
}

void AovFilm::add(const VisibilityBatch& batch, Counters& counters) {
    const size_t count = batch.filmSlice.count();
    for (size_t p = 0; p < batch.pixels.size(); ++p) {
        const PixelRef& ref = batch.pixels[p];
        const size_t pixel = size_t(ref.y - m_pixelBounds.y0) * size_t(m_pixelBounds.width()) +
                             size_t(ref.x - m_pixelBounds.x0);
        const size_t begin = batch.sampleIndex(uint32_t(p), batch.filmSlice.first), end = begin + count;
        if (!m_nearest.empty())
            addNearest(batch, begin, end, pixel, counters);
        if (!m_means.empty()) {
            for (size_t i = begin; i < end; ++i)
                if (const VisibilitySample sample = batch.samples[i]; sample.hit)
                    addMeans(batch, sample, pixel, counters);
        }
        for (CryptomatteAov& cryptomatte : m_cryptomattes) {
            for (size_t i = begin; i < end; ++i)
                if (const Hit hit = batch.samples[i].hit)
                    cryptomatte.counts[pixel].add(nameIndex(cryptomatte.aov, hit));
        }
        m_sampleCounts[pixel] += uint32_t(count);
    }
}

/// Updates m_nearest if one of samples begin … end-1 of the batch is nearer to the pixel center than all
/// before.
void AovFilm::addNearest(const VisibilityBatch& batch, size_t begin, size_t end, size_t pixel,
                         Counters& counters) {
    const V2f center = centerOf(batch.pixels[batch.samples[begin].pixel]);
    std::optional<VisibilitySample> nearest;
    for (size_t i = begin; i < end; ++i) {
        const float distance2 = (batch.samples[i].film - center).length2();
        if (distance2 < m_distance2[pixel]) {
            m_distance2[pixel] = distance2;
            nearest = batch.samples[i];
        }
    }
    if (!nearest)
        return;
    std::optional<SurfacePoint> surface;
    if (nearest->hit && m_nearestNeedsSurface) {
        surface = m_scene.surface(nearest->hit, nearest->ray.time);
        ++counters.surfaces;
    }
    for (NearestAov& nearestAov : m_nearest)
        writeNearest(nearestAov.aov, *nearest, surface, &nearestAov.values[pixel * nearestAov.channels],
                     counters);
}

/// Writes the channels of an AOV of Kind::Nearest. `surface` is set if the AOV needs it and there is a hit.
void AovFilm::writeNearest(Aov aov, const VisibilitySample& sample,
                           const std::optional<SurfacePoint>& surface, float* out, Counters& counters) const {
    const Hit& hit = sample.hit;
    const auto write = [&](const auto& vector) { std::copy_n(&vector.x, aovInfo(aov).channels.size(), out); };
    switch (aov) {
    case Aov::Depth:
        *out = depth(sample);
        return;
    case Aov::Position:
        return write(hit ? surface->p : V3f(0));
    case Aov::Uv:
        return write(hit ? surface->uv : V2f(0));
    case Aov::MotionVector:
        return write(hit && m_moves ? motionVector(hit, counters) : V2f(0));
    case Aov::PrimitiveId:
        *out = hit ? float(hit.prim + 1) : 0;
        return;
    default: // ObjectId, MaterialId
        *out = hit ? float(nameIndex(aov, hit) + 1) : 0;
    }
}

float AovFilm::depth(const VisibilitySample& sample) const {
    const V3f p = sample.ray.o + sample.ray.d * sample.hit.t;
    const auto projected = m_scene.camera().project(p, sample.ray.time);
    return sample.hit && projected ? projected->depth : kMissDepth;
}

/// Returns the displacement of the point on the film from shutter open to close, in pixels to the right and
/// up. Zero if the point is behind the camera at one of these times.
V2f AovFilm::motionVector(const Hit& hit, Counters& counters) const {
    const Camera& camera = m_scene.camera();
    const auto open = camera.project(m_scene.surface(hit, 0).p, 0);
    const auto close = camera.project(m_scene.surface(hit, 1).p, 1);
    counters.surfaces += 2;
    if (!open || !close)
        return V2f(0);
    const V2f step = camera.filmStep(open->film, close->film);
    return {step.x, -step.y};
}

void AovFilm::addMeans(const VisibilityBatch& batch, const VisibilitySample& sample, size_t pixel,
                       Counters& counters) {
    const SurfacePoint surface = m_scene.surface(sample.hit, sample.ray.time);
    ++counters.surfaces;
    for (MeanAov& mean : m_means) {
        const V3f value = mean.aov == Aov::Normal
                              ? (dot(surface.ng, sample.ray.d) > 0 ? -surface.ns : surface.ns)
                              : albedo(batch, sample, surface, counters);
        for (int c = 0; c < 3; ++c)
            mean.sums[3 * pixel + size_t(c)] += double(sample.weight) * double(value[c]);
    }
}

/// Returns an unbiased estimate of the directional albedo: the fraction of uniform white light that the
/// material reflects or transmits towards the viewer. Exact for matte surfaces and mirrors.
Rgb AovFilm::albedo(const VisibilityBatch& batch, const VisibilitySample& sample, const SurfacePoint& surface,
                    Counters& counters) const {
    const Material& material = *surface.material;
    TextureQuery query;
    query.uv = surface.uv;
    query.p = surface.p;
    query.prim = sample.hit.prim;
    query.barycentrics = V2f(sample.hit.u, sample.hit.v);
    if (material.flags().needsFootprint) {
        const RayCone cone = m_scene.camera().cone(sample.film);
        footprint(surface, sample.ray.d, cone.width + sample.hit.t * cone.spread, query);
        ++counters.footprints;
    }
    Bsdf bsdf;
    bsdf.material = &material;
    material.prepare(query, bsdf);
    const uint64_t domain = batch.pixels[sample.pixel].domain;
    const uint32_t total = batch.samplesPerPixel;
    const V3f wo = Frame::fromNormal(surface.ns).toLocal(-sample.ray.d);
    BsdfSample bsdfSample;
    const bool isValid =
        material.sample(bsdf, wo, m_sampler.get1D(domain, sample.index, total, kDimAlbedoLobe),
                        m_sampler.get2D(domain, sample.index, total, kDimAlbedoDirection), bsdfSample);
    return isValid ? bsdfSample.weight : Rgb(0);
}

/// Returns the index in names(aov) of the object or material that was hit.
uint32_t AovFilm::nameIndex(Aov aov, const Hit& hit) const {
    return identifiesObjects(aov) ? (*m_objects)(hit) : uint32_t(m_scene.geometry(hit).material);
}

const std::vector<std::string>& AovFilm::names(Aov aov) const {
    return identifiesObjects(aov) ? m_objects->names() : m_settings.materialNames;
}

std::vector<AovChannel> AovFilm::channels() const {
    std::vector<AovChannel> out;
    const auto append = [&](Aov aov, size_t channelIndex, bool exact, const auto& valueOf) {
        const AovInfo& info = aovInfo(aov);
        AovChannel& channel = out.emplace_back();
        channel = {info.name, info.channels[channelIndex], std::vector<float>(m_sampleCounts.size()), exact};
        for (size_t pixel = 0; pixel < m_sampleCounts.size(); ++pixel)
            channel.values[pixel] = valueOf(pixel);
    };
    for (const NearestAov& nearest : m_nearest)
        for (size_t c = 0; c < nearest.channels; ++c)
            append(nearest.aov, c, true,
                   [&](size_t pixel) { return nearest.values[pixel * nearest.channels + c]; });
    for (const MeanAov& mean : m_means)
        for (size_t c = 0; c < 3; ++c)
            append(mean.aov, c, false, [&](size_t pixel) {
                return m_sampleCounts[pixel] ? float(mean.sums[3 * pixel + c] / m_sampleCounts[pixel]) : 0;
            });
    for (const CryptomatteAov& cryptomatte : m_cryptomattes)
        appendCryptomatte(cryptomatte, out);
    return out;
}

/// Appends the ranked ids and coverages, two levels per layer of four channels.
void AovFilm::appendCryptomatte(const CryptomatteAov& cryptomatte, std::vector<AovChannel>& out) const {
    const size_t levels = size_t(m_settings.cryptoLevels + 1) / 2 * 2, first = out.size();
    for (size_t i = 0; i < 2 * levels; ++i)
        out.push_back({fmt::format("{}{:02}", aovInfo(cryptomatte.aov).channels[0], i / 4),
                       std::string(1, "RGBA"[i % 4]), std::vector<float>(m_sampleCounts.size()), true});
    std::vector<uint32_t> ids;
    for (const std::string& name : names(cryptomatte.aov))
        ids.push_back(cryptomatteId(name));
    std::vector<float> ranked(2 * levels);
    for (size_t pixel = 0; pixel < m_sampleCounts.size(); ++pixel) {
        cryptomatte.counts[pixel].rank(ids, m_sampleCounts[pixel], int(levels), ranked.data());
        for (size_t i = 0; i < ranked.size(); ++i)
            out[first + i].values[pixel] = ranked[i];
    }
}

Metadata AovFilm::metadata() const {
    Metadata metadata;
    for (const CryptomatteAov& cryptomatte : m_cryptomattes)
        for (auto& entry : cryptomatteMetadata(aovInfo(cryptomatte.aov).channels[0], names(cryptomatte.aov)))
            metadata.push_back(std::move(entry));
    return metadata;
}

std::vector<std::string> AovFilm::warnings() const {
    std::vector<std::string> messages;
    for (const CryptomatteAov& cryptomatte : m_cryptomattes)
        for (const auto& [a, b] : cryptomatteCollisions(names(cryptomatte.aov)))
            messages.push_back(fmt::format("{}: \"{}\" and \"{}\" have the same id and share a matte",
                                           aovInfo(cryptomatte.aov).channels[0], a, b));
    return messages;
}

} // namespace strobe
