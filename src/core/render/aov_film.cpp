#include "core/render/aov_film.h"

namespace strobe {

namespace {

// Sampler dimensions between those of the camera sample and those of shaders.
enum : uint32_t { kDimAlbedoLobe = 3, kDimAlbedoDirection = 4 };
/// The depth of a miss: behind all surfaces, but small enough for image filters; Blender uses the same.
constexpr float kMissDepth = 1e10f;

/// Returns whether the AOV identifies objects, rather than materials.
bool identifiesObjects(Aov aov) { return aov == Aov::ObjectId || aov == Aov::CryptoObject; }

bool needsSurface(Aov aov) { return aov == Aov::Position || aov == Aov::Uv; }

V2f centerOf(const PixelRef& pixel) { return {float(pixel.x) + 0.5f, float(pixel.y) + 0.5f}; }

} // namespace

AovFilm::AovFilm(const Scene& scene, const Sampler& sampler, const PixelBounds& pixelBounds,
                 AovFilmSettings settings)
    : m_scene(scene), m_sampler(sampler), m_moves(scene.moves()), m_sums(pixelBounds) {
    AovLayout layout{std::move(settings.aovs), settings.cryptoLevels};
    const auto has = [&](Aov aov) {
        return std::find(layout.aovs.begin(), layout.aovs.end(), aov) != layout.aovs.end();
    };
    if (std::any_of(layout.aovs.begin(), layout.aovs.end(), identifiesObjects))
        m_objects.emplace(scene);
    if (has(Aov::CryptoObject))
        layout.objectNames = m_objects->names();
    if (has(Aov::CryptoMaterial))
        layout.materialNames = std::move(settings.materialNames);
    m_nearestNeedsSurface = std::any_of(layout.aovs.begin(), layout.aovs.end(), needsSurface);
    m_sums = AovSums(pixelBounds, std::move(layout));
}

void AovFilm::add(const VisibilityBatch& batch, Counters& counters) {
    const size_t count = batch.filmSlice.count();
    for (size_t p = 0; p < batch.pixels.size(); ++p) {
        const PixelRef& ref = batch.pixels[p];
        const size_t pixel = m_sums.index(ref.x, ref.y);
        const size_t begin = batch.sampleIndex(uint32_t(p), batch.filmSlice.first), end = begin + count;
        if (!m_sums.nearest.empty())
            addNearest(batch, begin, end, pixel, counters);
        if (!m_sums.means.empty()) {
            for (size_t i = begin; i < end; ++i)
                addMeans(batch, batch.samples[i], pixel, counters);
        }
        for (AovSums::Cryptomatte& cryptomatte : m_sums.cryptomattes) {
            for (size_t i = begin; i < end; ++i)
                if (const Hit hit = batch.samples[i].hit)
                    cryptomatte.counts[pixel].add(nameIndex(cryptomatte.aov, hit));
        }
        m_sums.sampleCounts[pixel] += uint32_t(count);
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
        if (distance2 < m_sums.distance2[pixel]) {
            m_sums.distance2[pixel] = distance2;
            nearest = batch.samples[i];
        }
    }
    if (!nearest)
        return;
    m_sums.nearestSample[pixel] = nearest->index;
    std::optional<SurfacePoint> surface;
    if (nearest->hit && m_nearestNeedsSurface) {
        surface = m_scene.surface(nearest->hit, nearest->ray.time);
        ++counters.surfaces;
    }
    for (AovSums::Nearest& nearestAov : m_sums.nearest)
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
    const bool needsSurface = std::any_of(m_sums.means.begin(), m_sums.means.end(),
                                          [](const AovSums::Mean& mean) { return mean.aov != Aov::Alpha; });
    std::optional<SurfacePoint> surface;
    if (sample.hit && needsSurface) {
        surface = m_scene.surface(sample.hit, sample.ray.time);
        ++counters.surfaces;
    }
    for (AovSums::Mean& mean : m_sums.means) {
        V3f value(0);
        if (mean.aov == Aov::Alpha)
            value = V3f(sample.hit ? 1.f : 0.f);
        else if (surface && mean.aov == Aov::Normal)
            value = dot(surface->ng, sample.ray.d) > 0 ? -surface->ns : surface->ns;
        else if (surface)
            value = albedo(batch, sample, *surface, counters);
        mean.sums[pixel].add(value, sample.weight);
    }
}

/// Returns the shading frame of a material at a surface point; without normal maps.
Frame AovFilm::shadingFrame(const Material& material, const VisibilitySample& sample,
                            const SurfacePoint& surface) const {
    if (!material.flags().needsTangents)
        return Frame::fromNormal(surface.ns);
    V3f dpdu, dpdv;
    m_scene.tangents(sample.hit, sample.ray.time, dpdu, dpdv);
    return Frame::fromNormalTangent(surface.ns, dpdu);
}

/// Returns an unbiased estimate of the directional albedo: the fraction of uniform white light that the
/// material reflects or transmits towards the viewer. Exact for matte surfaces and mirrors.
Rgb AovFilm::albedo(const VisibilityBatch& batch, const VisibilitySample& sample, const SurfacePoint& surface,
                    Counters& counters) const {
    TextureQuery query;
    query.uv = surface.uv;
    query.p = surface.p;
    query.prim = sample.hit.prim;
    query.barycentrics = V2f(sample.hit.u, sample.hit.v);
    query.n = surface.ng;
    if (surface.material->flags().needsFootprint) {
        const RayCone cone = m_scene.camera().cone(sample.film);
        query.width = cone.width + sample.hit.t * cone.spread;
        footprint(surface, sample.ray.d, query.width, query);
        ++counters.footprints;
    }
    const Material& material = surface.material->chosen(query);
    Bsdf bsdf;
    bsdf.material = &material;
    material.prepare(query, bsdf);
    const uint64_t domain = batch.pixels[sample.pixel].domain;
    const uint32_t total = batch.samplesPerPixel;
    const V3f wo = shadingFrame(material, sample, surface).toLocal(-sample.ray.d);
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

} // namespace strobe
