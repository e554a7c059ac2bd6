#include "core/scene/scene.h"

#include "core/scene/surface_math.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace strobe {

LightSampler::LightSampler(std::vector<float> powers) {
    double sum = std::accumulate(powers.begin(), powers.end(), 0.);
    if (!(sum > 0 && std::isfinite(sum))) {
        std::fill(powers.begin(), powers.end(), 1.f);
        sum = double(powers.size());
    }
    const auto isLit = [](float power) { return power > 0; };
    const double litCount = double(std::count_if(powers.begin(), powers.end(), isLit));
    // Random numbers are multiples of 2^-24: an interval of 2^-23 contains at least one.
    const double minProbability = std::min(0x1p-23, 1 / litCount);
    double cumulative = 0;
    for (const float power : powers) {
        cumulative += isLit(power) ? power / sum * (1 - litCount * minProbability) + minProbability : 0;
        m_cdf.push_back(float(cumulative));
    }
    for (size_t i = m_cdf.size(); i-- > 0;) { // rounding: the interval of the last lit light ends at 1
        m_cdf[i] = 1;
        if (isLit(powers[i]))
            break;
    }
}

int LightSampler::pick(float u) const {
    return int(std::upper_bound(m_cdf.begin(), m_cdf.end(), u) - m_cdf.begin());
}

Scene::Scene(std::vector<Group> groups, std::vector<Instance> instances,
             std::vector<std::shared_ptr<const Material>> materials,
             std::vector<std::shared_ptr<const Light>> lights, std::shared_ptr<const Camera> camera,
             Shutter shutter, bool showsBackground)
    : m_groups(std::move(groups)), m_instances(std::move(instances)), m_materials(std::move(materials)),
      m_lights(std::move(lights)), m_camera(std::move(camera)), m_shutter(shutter),
      m_showsBackground(showsBackground), m_tracer(std::make_unique<Tracer>(m_groups, m_instances)) {
    const Box3f box = m_tracer->bounds();
    m_radius = box.isEmpty() || !(box.max.x < kInfinity) ? 1.f : 0.5f * length(box.max - box.min);
    std::vector<float> powers, isLit;
    for (size_t i = 0; i < m_lights.size(); ++i) {
        powers.push_back(luminance(m_lights[i]->power(m_radius)));
        isLit.push_back(powers.back() > 0 ? 1.f : 0.f);
        m_emitterCount += m_lights[i]->emitterCount();
        if (m_lights[i]->isEnvironment())
            m_environments.push_back(int(i));
    }
    m_moves = anythingMoves();
    m_lightSampler = LightSampler(std::move(powers));
    m_uniformLightSampler = LightSampler(std::move(isLit));
    for (const auto& material : m_materials)
        m_needsFootprint |= material->flags().needsFootprint;
    constexpr size_t kLargeMesh = 4096; // triangles, about 100 kB
    for (const Group& group : m_groups)
        for (const Geometry& geometry : group.geometries) {
            if (const TriangleMesh* mesh = geometry.placed.shape.mesh.get())
                m_hasLargeMeshes |= mesh->triangleCount() > kLargeMesh;
            m_hasMedia |= !isBlack(geometry.absorptionInside) || !isBlack(geometry.absorptionOutside);
        }
}

const LightTree& Scene::lightTree(const LightTreeSettings& settings) const {
    const std::lock_guard lock(m_lightTreeMutex);
    for (const auto& [key, tree] : m_lightTrees)
        if (key == settings)
            return *tree;
    m_lightTrees.emplace_back(settings, std::make_unique<const LightTree>(m_lights, m_radius, settings));
    return *m_lightTrees.back().second;
}

const SurfaceIds& Scene::surfaceIds() const {
    std::call_once(m_surfacesAreFound,
                   [&] { m_surfaceIds = std::make_unique<const SurfaceIds>(m_groups, m_instances); });
    return *m_surfaceIds;
}

Rgb Scene::environment(const V3f& d) const {
    Rgb sum(0);
    for (int i : m_environments)
        sum += m_lights[size_t(i)]->environment(d);
    return sum;
}

void Scene::meshSurface(const PlacedShape& placed, const Hit& hit, float time, RawSurfacePoint& s) {
    const TriangleMesh& mesh = *placed.shape.mesh;
    const Triangle triangle = triangleOf(mesh, hit.prim, time);
    s.p = triangle.point(hit.u, hit.v);
    s.ng = triangle.normal();
    s.ns = s.ng;
    if (!mesh.normals.empty()) {
        const V3f n = interpolatedNormal(mesh, hit.prim, hit.u, hit.v, time);
        if (length2(n) > 0)
            s.ns = n;
    }
    s.scale = triangle.scale();
    s.uv = triangleUv(mesh, hit.prim, hit.u, hit.v);
    if (s.material->flags().needsFootprint)
        triangle.derivatives(triangleUv(mesh, hit.prim, 0, 0), triangleUv(mesh, hit.prim, 1, 0),
                             triangleUv(mesh, hit.prim, 0, 1), s.dpdu, s.dpdv);
}

/// Visits all shapes.
bool Scene::anythingMoves() const {
    const auto instanceMoves = [](const Instance& instance) {
        return instance.motion && !instance.motion->isStatic();
    };
    const auto geometryMoves = [](const Geometry& geometry) { return !geometry.placed.isStatic(); };
    return m_camera->moves() || std::any_of(m_instances.begin(), m_instances.end(), instanceMoves) ||
           std::any_of(m_groups.begin(), m_groups.end(), [&](const Group& group) {
               return std::any_of(group.geometries.begin(), group.geometries.end(), geometryMoves);
           });
}

void Scene::prefetch(std::span<const Hit> hits) const {
    const auto meshOf = [&](const Hit& hit) { return hit ? geometry(hit).placed.shape.mesh.get() : nullptr; };
    for (const Hit& hit : hits)
        if (const TriangleMesh* mesh = meshOf(hit))
            __builtin_prefetch(&mesh->indices[3 * size_t(hit.prim)]);
    for (const Hit& hit : hits)
        if (const TriangleMesh* mesh = meshOf(hit))
            for (int k = 0; k < 3; ++k) {
                const uint32_t vertex = mesh->indices[3 * size_t(hit.prim) + size_t(k)];
                __builtin_prefetch(&mesh->positions[0][vertex]);
                if (!mesh->normals.empty())
                    __builtin_prefetch(&mesh->normals[0][vertex]);
            }
}

RawSurfacePoint Scene::rawSurface(const Hit& hit, float time) const {
    const Geometry& geometry = this->geometry(hit);
    const PlacedShape& placed = geometry.placed;
    RawSurfacePoint s;
    s.material = m_materials[size_t(geometry.material)].get();
    s.prim = hit.prim;
    s.light = lightOf(hit);
    s.orientation = placed.reverseOrientation ? -1 : 1;
    const bool isMesh = placed.shape.mesh != nullptr;
    if (isMesh) {
        meshSurface(placed, hit, time, s);
    } else {
        const QuadricPoint q = placed.shape.quadric->point(hit.u, hit.v);
        s.p = q.p;
        s.ng = q.n;
        s.ns = q.n;
        s.uv = q.uv;
        s.dpdu = q.dpdu;
        s.dpdv = q.dpdv;
        s.scale = quadricScale(*placed.shape.quadric);
    }
    if (isBaked(hit, placed))
        return s;
    const Affine m(toWorld(hit, placed, time));
    s.p = m.point(s.p);
    s.ng = m.normal(s.ng);
    s.ns = isMesh ? m.normal(s.ns) : s.ng;
    s.dpdu = m.vector(s.dpdu);
    s.dpdv = m.vector(s.dpdv);
    s.scale = m.scale(s.scale);
    return s;
}

void Scene::tangents(const Hit& hit, float time, V3f& dpdu, V3f& dpdv) const {
    const PlacedShape& placed = geometry(hit).placed;
    if (placed.shape.mesh) {
        const TriangleMesh& mesh = *placed.shape.mesh;
        triangleOf(mesh, hit.prim, time)
            .derivatives(triangleUv(mesh, hit.prim, 0, 0), triangleUv(mesh, hit.prim, 1, 0),
                         triangleUv(mesh, hit.prim, 0, 1), dpdu, dpdv);
        if (!mesh.tangents.empty() && !mesh.deforms()) {
            const uint32_t* index = &mesh.indices[3 * size_t(hit.prim)];
            dpdu = mesh.tangents[index[0]] * (1 - hit.u - hit.v) + mesh.tangents[index[1]] * hit.u +
                   mesh.tangents[index[2]] * hit.v;
        }
    } else {
        const QuadricPoint q = placed.shape.quadric->point(hit.u, hit.v);
        dpdu = q.dpdu;
        dpdv = q.dpdv;
    }
    if (isBaked(hit, placed))
        return;
    const Affine m(toWorld(hit, placed, time));
    dpdu = m.vector(dpdu);
    dpdv = m.vector(dpdv);
}

void footprint(const SurfacePoint& s, const V3f& d, float width, TextureQuery& q) {
    const Footprint f(s.ng, s.dpdu, s.dpdv, d, width);
    q.duvdx = f.duvdx;
    q.duvdy = f.duvdy;
}

Rgb Scene::emitted(const SurfacePoint& s, const Hit& hit, const V3f& w) const {
    TextureQuery query;
    query.uv = s.uv;
    query.p = s.p;
    query.prim = s.prim;
    query.barycentrics = V2f(hit.u, hit.v);
    query.n = s.ng;
    return m_lights[size_t(s.light)]->emitted(s.ng, w, query);
}

} // namespace strobe
