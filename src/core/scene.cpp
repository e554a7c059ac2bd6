#include "core/scene.h"

#include <algorithm>
#include <numeric>

namespace strobe {

LightPicker::LightPicker(std::vector<float> powers) : m_probability(std::move(powers)) {
    const float sum = std::accumulate(m_probability.begin(), m_probability.end(), 0.f);
    float running = 0;
    for (float& p : m_probability) {
        p = sum > 0 ? p / sum : 1.f / float(m_probability.size());
        m_cdf.push_back(running += p);
    }
}

int LightPicker::pick(float u) const {
    const auto it = std::upper_bound(m_cdf.begin(), m_cdf.end(), u);
    int i = std::min(int(it - m_cdf.begin()), int(m_cdf.size()) - 1);
    while (i > 0 && m_probability[size_t(i)] == 0)
        --i; // u rounded past the last light that has any power
    return i;
}

Scene::Scene(std::vector<Group> groups, std::vector<Instance> instances,
             std::vector<std::shared_ptr<const Material>> materials,
             std::vector<std::shared_ptr<const Light>> lights, std::shared_ptr<const Camera> camera,
             Shutter shutter)
    : m_groups(std::move(groups)), m_instances(std::move(instances)), m_materials(std::move(materials)),
      m_lights(std::move(lights)), m_camera(std::move(camera)), m_shutter(shutter),
      m_tracer(std::make_unique<Tracer>(m_groups, m_instances)) {
    const Box3f box = m_tracer->bounds();
    const float radius = box.isEmpty() || !(box.max.x < kInfinity) ? 1.f : 0.5f * length(box.max - box.min);
    std::vector<float> powers;
    for (size_t i = 0; i < m_lights.size(); ++i) {
        powers.push_back(luminance(m_lights[i]->power(radius)));
        if (m_lights[i]->isEnvironment())
            m_environments.push_back(int(i));
    }
    m_lightPicker = LightPicker(std::move(powers));
    for (const auto& material : m_materials)
        m_needsFootprint |= material->needsFootprint();
    constexpr size_t kLarge = 4096; // triangles: some 100 kB
    for (const Group& group : m_groups)
        for (const Geometry& geometry : group.geometries)
            if (const TriangleMesh* mesh = geometry.placed.shape.mesh.get())
                m_hasLargeMeshes |= mesh->triangleCount() > kLarge;
}

Rgb Scene::environment(const V3f& d) const {
    Rgb sum(0);
    for (int i : m_environments)
        sum += m_lights[size_t(i)]->environment(d);
    return sum;
}

namespace {

V3f interpolated(const std::vector<std::vector<V3f>>& keys, const uint32_t* index, float u, float v,
                 float time) {
    const auto at = [&](const std::vector<V3f>& values) {
        return values[index[0]] * (1 - u - v) + values[index[1]] * u + values[index[2]] * v;
    };
    if (keys.size() == 1)
        return at(keys[0]);
    const float x = time * float(keys.size() - 1);
    const size_t i = std::min(size_t(std::max(x, 0.f)), keys.size() - 2);
    return lerp(at(keys[i]), at(keys[i + 1]), x - float(i));
}

float largest(const V3f& v) { return std::max(std::abs(v.x), std::max(std::abs(v.y), std::abs(v.z))); }

/// dp/du and dp/dv of a triangle with corner texture coordinates uv.
void derivatives(const V3f p[3], const V2f uv[3], V3f& dpdu, V3f& dpdv) {
    const V2f duv02 = uv[0] - uv[2], duv12 = uv[1] - uv[2];
    const V3f dp02 = p[0] - p[2], dp12 = p[1] - p[2];
    const float det = duv02.x * duv12.y - duv02.y * duv12.x;
    if (std::abs(det) < 1e-20f)
        return;
    dpdu = (dp02 * duv12.y - dp12 * duv02.y) * (1 / det);
    dpdv = (dp12 * duv02.x - dp02 * duv12.x) * (1 / det);
}

} // namespace

void Scene::meshSurface(const PlacedShape& placed, const Hit& hit, float time, RawSurfacePoint& s) {
    const TriangleMesh& mesh = *placed.shape.mesh;
    const uint32_t* index = &mesh.indices[3 * size_t(hit.prim)];
    V3f v[3];
    triangleVertices(mesh, hit.prim, time, v);
    s.p = v[0] * (1 - hit.u - hit.v) + v[1] * hit.u + v[2] * hit.v;
    s.ng = cross(v[1] - v[0], v[2] - v[0]);
    s.ns = s.ng;
    if (!mesh.normals.empty()) {
        const V3f n = interpolated(mesh.normals, index, hit.u, hit.v, time);
        if (length2(n) > 0)
            s.ns = n;
    }
    s.scale = std::max(largest(v[0]), std::max(largest(v[1]), largest(v[2])));
    s.uv = triangleUv(mesh, hit.prim, hit.u, hit.v);
    if (s.material->needsFootprint()) {
        const V2f uv[3] = {triangleUv(mesh, hit.prim, 0, 0), triangleUv(mesh, hit.prim, 1, 0),
                           triangleUv(mesh, hit.prim, 0, 1)};
        derivatives(v, uv, s.dpdu, s.dpdv);
    }
}

bool Scene::moves() const {
    const auto moved = [](const Instance& instance) {
        return instance.motion && !instance.motion->isStill();
    };
    const auto changes = [](const Geometry& geometry) { return !geometry.placed.isStill(); };
    return m_camera->moves() || std::any_of(m_instances.begin(), m_instances.end(), moved) ||
           std::any_of(m_groups.begin(), m_groups.end(), [&](const Group& group) {
               return std::any_of(group.geometries.begin(), group.geometries.end(), changes);
           });
}

namespace {

/// A normal through a transform, as `transformNormal` with its inverse: that is its cofactors over its
/// determinant. (The determinant is more than the sign: without it, what is scaled down a lot underflows.)
V3f turnedNormal(const M44f& m, const V3f& n) {
    const V3f x(m[0][0], m[0][1], m[0][2]), y(m[1][0], m[1][1], m[1][2]), z(m[2][0], m[2][1], m[2][2]);
    const V3f yz = cross(y, z);
    const float determinant = dot(x, yz);
    const float scale = determinant != 0 ? 1 / determinant : 1;
    return (yz * n.x + cross(z, x) * n.y + cross(x, y) * n.z) * scale;
}

} // namespace

void Scene::fetchAhead(std::span<const Hit> hits) const {
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
    s.light = geometry.light;
    s.orientation = placed.reverseOrientation ? -1 : 1;
    const Instance* instance = hit.instance == kNone ? nullptr : &m_instances[hit.instance];
    if (instance)
        s.light = instance->lights.empty() ? -1 : instance->lights[hit.geometry];

    const bool isMesh = placed.shape.mesh != nullptr;
    if (isMesh) {
        meshSurface(placed, hit, time, s);
    } else {
        const QuadricPoint q = placed.shape.quadric->point(hit.u, hit.v);
        s.p = q.p, s.ng = s.ns = q.n, s.uv = q.uv, s.dpdu = q.dpdu, s.dpdv = q.dpdv;
        const Box3f box = placed.shape.quadric->bounds();
        s.scale = 4 * std::max(largest(box.min), largest(box.max)); // the closed form loses a little more
    }
    // Meshes of the world are baked: no transform to apply.
    if (instance || !isMesh) {
        const M44f m = instance ? placed.toParent * instance->motion->at(time) : placed.toParent;
        s.p = transformPoint(m, s.p);
        s.ng = turnedNormal(m, s.ng);
        s.ns = isMesh ? turnedNormal(m, s.ns) : s.ng;
        s.dpdu = transformVector(m, s.dpdu);
        s.dpdv = transformVector(m, s.dpdv);
        const float stretch =
            std::max(largest({m[0][0], m[0][1], m[0][2]}),
                     std::max(largest({m[1][0], m[1][1], m[1][2]}), largest({m[2][0], m[2][1], m[2][2]})));
        s.scale = s.scale * stretch + largest({m[3][0], m[3][1], m[3][2]});
    }
    return s;
}

void Scene::tangents(const Hit& hit, float time, V3f& dpdu, V3f& dpdv) const {
    const PlacedShape& placed = geometry(hit).placed;
    dpdu = dpdv = V3f(0);
    if (placed.shape.mesh) {
        const TriangleMesh& mesh = *placed.shape.mesh;
        V3f v[3];
        triangleVertices(mesh, hit.prim, time, v);
        const V2f uv[3] = {triangleUv(mesh, hit.prim, 0, 0), triangleUv(mesh, hit.prim, 1, 0),
                           triangleUv(mesh, hit.prim, 0, 1)};
        derivatives(v, uv, dpdu, dpdv);
        if (!mesh.tangents.empty() && !mesh.deforms()) {
            const uint32_t* index = &mesh.indices[3 * size_t(hit.prim)];
            dpdu = mesh.tangents[index[0]] * (1 - hit.u - hit.v) + mesh.tangents[index[1]] * hit.u +
                   mesh.tangents[index[2]] * hit.v;
        }
    } else {
        const QuadricPoint q = placed.shape.quadric->point(hit.u, hit.v);
        dpdu = q.dpdu, dpdv = q.dpdv;
    }
    if (hit.instance == kNone && placed.shape.mesh)
        return; // baked
    const M44f m = hit.instance == kNone ? placed.toParent
                                         : placed.toParent * m_instances[hit.instance].motion->at(time);
    dpdu = transformVector(m, dpdu), dpdv = transformVector(m, dpdv);
}

void footprint(const SurfacePoint& s, const V3f& d, float width, TextureQuery& q) {
    const float cosine = dot(d, s.ng); // times the normal's length, as all that follows
    if (!(sqr(cosine) > 1e-6f * length2(s.ng)) || width <= 0)
        return;
    const float uu = dot(s.dpdu, s.dpdu), uv = dot(s.dpdu, s.dpdv), vv = dot(s.dpdv, s.dpdv);
    const float det = uu * vv - uv * uv;
    if (!(det > 0))
        return;
    // What lies across d is moved along d onto the tangent plane, then into (u,v) by least squares.
    const V3f n = s.ng * (1 / cosine), along = s.dpdu - n * dot(d, s.dpdu),
              across = s.dpdv - n * dot(d, s.dpdv);
    const float scale = width / det;
    const V3f toU = (along * vv - across * uv) * scale, toV = (across * uu - along * uv) * scale;
    const Frame frame = Frame::fromNormal(d);
    q.duvdx = {dot(frame.s, toU), dot(frame.s, toV)};
    q.duvdy = {dot(frame.t, toU), dot(frame.t, toV)};
}

} // namespace strobe
