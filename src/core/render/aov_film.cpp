#include "core/render/aov_film.h"

#include <fmt/format.h>

namespace strobe {

namespace {

// Dimensions between the camera sample's and those of shading.
enum : uint32_t { kDimAlbedoLobe = 3, kDimAlbedoDirection = 4 };
/// The depth of nothing: beyond everything, but a number that filters can bear. (Blender's, too.)
constexpr float kFarAway = 1e10f;

enum class Kind { OfOneSample, Mean, Crypto };

Kind kindOf(Aov aov) {
    switch (aov) {
    case Aov::Normal:
    case Aov::Albedo:
        return Kind::Mean;
    case Aov::CryptoObject:
    case Aov::CryptoMaterial:
        return Kind::Crypto;
    default:
        return Kind::OfOneSample;
    }
}

bool isOfObjects(Aov aov) { return aov == Aov::ObjectId || aov == Aov::CryptoObject; }

bool isOfSurface(Aov aov) { return aov == Aov::Position || aov == Aov::Uv; }

V2f middleOf(const PixelRef& pixel) { return {float(pixel.x) + 0.5f, float(pixel.y) + 0.5f}; }

} // namespace

AovFilm::AovFilm(const Scene& scene, const Sampler& sampler, const PixelBounds& pixelBounds,
                 AovFilmSettings settings)
    : m_scene(scene), m_sampler(sampler), m_pixelBounds(pixelBounds), m_settings(std::move(settings)),
      m_moves(scene.moves()) {
    const size_t pixels = size_t(pixelBounds.width()) * size_t(pixelBounds.height());
    m_samples.assign(pixels, 0);
    for (const Aov aov : m_settings.aovs) {
        if (isOfObjects(aov) && !m_objects)
            m_objects.emplace(scene);
        const size_t width = aovInfo(aov).channels.size();
        switch (kindOf(aov)) {
        case Kind::OfOneSample:
            m_planes.push_back({aov, width, std::vector<float>(pixels * width)});
            m_distance2.assign(pixels, kInfinity);
            m_needsSurface |= isOfSurface(aov);
            break;
        case Kind::Mean:
            m_means.push_back({aov, std::vector<double>(3 * pixels)});
            break;
        case Kind::Crypto:
            m_cryptos.push_back({aov, std::vector<CryptomatteCounts>(pixels)});
            break;
        }
    }
}

void AovFilm::add(const VisibilityBatch& batch, Counters& counters) {
    const size_t inSlice = batch.slice.count(), first = batch.wanted.first - batch.slice.first,
                 count = batch.wanted.count();
    for (size_t p = 0; p < batch.pixels.size(); ++p) {
        const PixelRef& pixel = batch.pixels[p];
        const size_t at = size_t(pixel.y - m_pixelBounds.y0) * size_t(m_pixelBounds.width()) +
                          size_t(pixel.x - m_pixelBounds.x0);
        const size_t begin = p * inSlice + first, end = begin + count;
        if (!m_planes.empty())
            addNearest(batch, begin, end, at, counters);
        if (!m_means.empty())
            for (size_t i = begin; i < end; ++i)
                if (const VisibilitySample sample = batch.samples[i]; sample.hit)
                    addMeans(batch, sample, at, counters);
        for (Crypto& crypto : m_cryptos)
            for (size_t i = begin; i < end; ++i)
                if (const Hit hit = batch.samples[i].hit)
                    crypto.counts[at].add(thingOf(crypto.aov, hit));
        m_samples[at] += uint32_t(count);
    }
}

void AovFilm::addNearest(const VisibilityBatch& batch, size_t first, size_t end, size_t at,
                         Counters& counters) {
    const V2f middle = middleOf(batch.pixels[batch.samples[first].pixel]);
    std::optional<VisibilitySample> nearest;
    for (size_t i = first; i < end; ++i)
        if (const V2f d = batch.samples[i].film - middle; d.length2() < m_distance2[at])
            m_distance2[at] = d.length2(), nearest = batch.samples[i];
    if (!nearest)
        return;
    std::optional<SurfacePoint> surface;
    if (nearest->hit && m_needsSurface) {
        surface = m_scene.surface(nearest->hit, nearest->ray.time);
        ++counters.surfaces;
    }
    for (Plane& plane : m_planes)
        show(plane.aov, *nearest, surface, &plane.values[at * plane.width], counters);
}

/// Writes the value of a aov that is of one sample. `surface`: if it was hit and is needed.
void AovFilm::show(Aov aov, const VisibilitySample& sample, const std::optional<SurfacePoint>& surface,
                   float* out, Counters& counters) const {
    const Hit& hit = sample.hit;
    const auto write = [&](const auto& v) { std::copy_n(&v.x, aovInfo(aov).channels.size(), out); };
    switch (aov) {
    case Aov::Depth: {
        const auto seen = m_scene.camera().project(sample.ray.o + sample.ray.d * hit.t, sample.ray.time);
        *out = hit && seen ? seen->depth : kFarAway;
        return;
    }
    case Aov::Position:
        return write(hit ? surface->p : V3f(0));
    case Aov::Uv:
        return write(hit ? surface->uv : V2f(0));
    case Aov::MotionVector:
        return write(hit && m_moves ? motion(hit, counters) : V2f(0));
    case Aov::PrimitiveId:
        *out = hit ? float(hit.prim + 1) : 0;
        return;
    default:
        *out = hit ? float(thingOf(aov, hit) + 1) : 0;
    }
}

/// How far the point that was hit moves on the film while the shutter is open. 0 where one of its ends is
/// behind the camera.
V2f AovFilm::motion(const Hit& hit, Counters& counters) const {
    const Camera& camera = m_scene.camera();
    const auto open = camera.project(m_scene.surface(hit, 0).p, 0);
    const auto close = camera.project(m_scene.surface(hit, 1).p, 1);
    counters.surfaces += 2;
    if (!open || !close)
        return V2f(0);
    const V2f step = camera.filmStep(open->film, close->film);
    return {step.x, -step.y};
}

void AovFilm::addMeans(const VisibilityBatch& batch, const VisibilitySample& sample, size_t at,
                       Counters& counters) {
    const SurfacePoint surface = m_scene.surface(sample.hit, sample.ray.time);
    ++counters.surfaces;
    for (Mean& mean : m_means) {
        const V3f value = mean.aov == Aov::Normal
                              ? (dot(surface.ng, sample.ray.d) > 0 ? -surface.ns : surface.ns)
                              : albedo(batch, sample, surface, counters);
        for (int c = 0; c < 3; ++c)
            mean.sums[3 * at + size_t(c)] += double(sample.weight) * double(value[c]);
    }
}

/// An unbiased estimate of the part of white light from all around that the material sends to the viewer:
/// exactly that of matte surfaces and mirrors.
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
    BsdfSample drawn;
    const bool any =
        material.sample(bsdf, wo, m_sampler.get1D(domain, sample.index, total, kDimAlbedoLobe),
                        m_sampler.get2D(domain, sample.index, total, kDimAlbedoDirection), drawn);
    return any ? drawn.weight : Rgb(0);
}

uint32_t AovFilm::thingOf(Aov aov, const Hit& hit) const {
    return isOfObjects(aov) ? (*m_objects)(hit) : uint32_t(m_scene.geometry(hit).material);
}

const std::vector<std::string>& AovFilm::namesOf(Aov aov) const {
    return isOfObjects(aov) ? m_objects->names() : m_settings.materialNames;
}

std::vector<AovChannel> AovFilm::channels() const {
    std::vector<AovChannel> out;
    const auto add = [&](Aov aov, size_t channel, bool exact, const auto& valueAt) {
        const AovInfo& info = aovInfo(aov);
        AovChannel& made = out.emplace_back();
        made = {info.name, info.channels[channel], std::vector<float>(m_samples.size()), exact};
        for (size_t at = 0; at < m_samples.size(); ++at)
            made.values[at] = valueAt(at);
    };
    for (const Plane& plane : m_planes)
        for (size_t c = 0; c < plane.width; ++c)
            add(plane.aov, c, true, [&](size_t at) { return plane.values[at * plane.width + c]; });
    for (const Mean& mean : m_means)
        for (size_t c = 0; c < 3; ++c)
            add(mean.aov, c, false,
                [&](size_t at) { return m_samples[at] ? float(mean.sums[3 * at + c] / m_samples[at]) : 0; });
    for (const Crypto& crypto : m_cryptos)
        appendCrypto(crypto, out);
    return out;
}

void AovFilm::appendCrypto(const Crypto& crypto, std::vector<AovChannel>& out) const {
    const size_t levels = size_t(m_settings.cryptoLevels + 1) / 2 * 2, first = out.size();
    for (size_t i = 0; i < 2 * levels; ++i)
        out.push_back({fmt::format("{}{:02}", aovInfo(crypto.aov).channels[0], i / 4),
                       std::string(1, "RGBA"[i % 4]), std::vector<float>(m_samples.size()), true});
    std::vector<uint32_t> ids;
    for (const std::string& name : namesOf(crypto.aov))
        ids.push_back(cryptomatteId(name));
    std::vector<float> ranked(2 * levels);
    for (size_t at = 0; at < m_samples.size(); ++at) {
        crypto.counts[at].rank(ids, m_samples[at], int(levels), ranked.data());
        for (size_t i = 0; i < ranked.size(); ++i)
            out[first + i].values[at] = ranked[i];
    }
}

Metadata AovFilm::metadata() const {
    Metadata all;
    for (const Crypto& crypto : m_cryptos)
        for (auto& entry : cryptomatteMetadata(aovInfo(crypto.aov).channels[0], namesOf(crypto.aov)))
            all.push_back(std::move(entry));
    return all;
}

std::vector<std::string> AovFilm::warnings() const {
    std::vector<std::string> all;
    for (const Crypto& crypto : m_cryptos)
        for (const auto& [a, b] : cryptomatteCollisions(namesOf(crypto.aov)))
            all.push_back(
                fmt::format("{}: \"{}\" and \"{}\" happen to have the same id: their mattes are one",
                            aovInfo(crypto.aov).channels[0], a, b));
    return all;
}

} // namespace strobe
