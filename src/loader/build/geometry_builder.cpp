#include "loader/build/geometry_builder.h"

#include "core/math/hash.h"
#include "core/scene/object_names.h"
#include "core/util/parallel.h"
#include "core/util/resource_policy.h"

#include <bit>
#include <unordered_map>

namespace strobe {

namespace {

constexpr float kPathTolerancePixels = 0.05f;
constexpr size_t kMaxInstances = size_t(1) << 26, kBytesPerInstance = 600, kCheckEvery = 1024;
constexpr int kMaxObjectDepth = 64;

Box3f meshBounds(const TriangleMesh& mesh) {
    Box3f box;
    for (const auto& key : mesh.positions)
        for (const V3f& p : key)
            box.extendBy(p);
    return box;
}

Box3f shapeBounds(const Shape& shape) {
    return shape.mesh ? meshBounds(*shape.mesh) : shape.quadric->bounds();
}

Box3f transformBounds(const Box3f& box, const M44f& m) {
    Box3f out;
    if (box.isEmpty())
        return out;
    for (int i = 0; i < 8; ++i)
        out.extendBy(transformPoint(m, {i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y,
                                        i & 4 ? box.max.z : box.min.z}));
    return out;
}

float distanceTo(const Box3f& box, const V3f& p) {
    V3f d;
    for (int i = 0; i < 3; ++i)
        d[i] = std::max(0.f, std::max(box.min[i] - p[i], p[i] - box.max[i]));
    return length(d);
}

/// Applies a still transform to the vertices. True when that turns the mesh's orientation round.
bool bake(TriangleMesh& mesh, const M44f& m) {
    if (m == M44f())
        return false;
    const M44f inverse = m.inverse();
    for (auto& key : mesh.positions)
        for (V3f& p : key)
            p = transformPoint(m, p);
    for (auto& key : mesh.normals)
        for (V3f& n : key)
            n = transformNormal(inverse, n);
    for (V3f& t : mesh.tangents)
        t = transformVector(m, t);
    // A mirror turns the winding round; vertex normals have come through right.
    return determinant3(m) < 0 && mesh.normals.empty();
}

/// Vertex arrays at scene time `time`, linear between keys.
std::vector<V3f> keyAt(const std::vector<std::vector<V3f>>& keys, const std::vector<float>& times,
                       float time) {
    if (time <= times.front())
        return keys.front();
    if (time >= times.back())
        return keys.back();
    const size_t i = size_t(std::upper_bound(times.begin(), times.end(), time) - times.begin()) - 1;
    const float t = (time - times[i]) / (times[i + 1] - times[i]);
    if (t == 0)
        return keys[i];
    std::vector<V3f> out(keys[i].size());
    for (size_t k = 0; k < out.size(); ++k)
        out[k] = lerp(keys[i][k], keys[i + 1][k], t);
    return out;
}

float largestDeviation(const std::vector<V3f>& a, const std::vector<V3f>& b) {
    float largest2 = 0;
    for (size_t i = 0; i < a.size(); ++i)
        largest2 = std::max(largest2, length2(a[i] - b[i]));
    return std::sqrt(largest2);
}

/// A deforming mesh with keys uniform over the shutter, as few as stay within `tolerance`.
std::shared_ptr<TriangleMesh> fitDeformation(const TriangleMesh& source, const Shutter& shutter,
                                             float tolerance) {
    constexpr int kMaxSegments = 128; // Embree's limit
    const std::vector<float>& times = source.keyTimes;
    std::vector<float> inner; // source keys inside the shutter: where a uniform fit can be wrong
    for (float t : times)
        if (t > shutter.open && t < shutter.close)
            inner.push_back(t);
    const auto start = keyAt(source.positions, times, shutter.open);
    bool rests = largestDeviation(start, keyAt(source.positions, times, shutter.close)) <=
                 1e-6f * length(meshBounds(source).size());
    for (float t : inner)
        rests &= largestDeviation(start, keyAt(source.positions, times, t)) == 0;
    rests |= !(shutter.close > shutter.open);

    const auto resample = [&](const std::vector<std::vector<V3f>>& keys, int segments) {
        std::vector<std::vector<V3f>> out;
        for (int i = 0; i <= segments; ++i)
            out.push_back(keyAt(keys, times, shutter.sceneTime(segments ? float(i) / float(segments) : 0)));
        return out;
    };
    int segments = rests ? 0 : 1;
    auto positions = resample(source.positions, segments);
    const auto fits = [&] {
        for (float t : inner) {
            const float x = (t - shutter.open) / (shutter.close - shutter.open) * float(segments);
            const int i = std::min(int(x), segments - 1);
            const auto truth = keyAt(source.positions, times, t);
            std::vector<V3f> fitted(truth.size());
            for (size_t k = 0; k < truth.size(); ++k)
                fitted[k] = lerp(positions[i][k], positions[i + 1][k], x - float(i));
            if (largestDeviation(truth, fitted) > tolerance)
                return false;
        }
        return true;
    };
    while (segments > 0 && segments < kMaxSegments && !fits())
        positions = resample(source.positions, ++segments);
    auto mesh = std::make_shared<TriangleMesh>();
    mesh->indices = source.indices;
    mesh->positions = std::move(positions);
    if (!source.normals.empty())
        mesh->normals = resample(source.normals, segments);
    mesh->tangents = source.tangents;
    mesh->uvs = source.uvs;
    mesh->alpha = source.alpha;
    for (int i = 0; segments > 0 && i <= segments; ++i)
        mesh->keyTimes.push_back(float(i) / float(segments));
    return mesh;
}

/// Embree reads sixteen bytes at every vertex: leave room behind the last.
void padForEmbree(TriangleMesh& mesh) {
    for (auto& key : mesh.positions)
        key.reserve(key.size() + 2);
}

void append(TransformChain& path, const TransformChain& then) {
    for (const KeyedTransform& t : then.chain())
        path.append(t);
}

/// A group somewhere inside an object (or the world), with the path from there.
struct GroupUse {
    uint32_t group;
    TransformChain path;
    std::string name{}; ///< of the instance that it is part of, if any
};

class GeometryBuilder {
  public:
    GeometryBuilder(SceneDescription& description, const Camera& camera, const Shutter& shutter,
                    int firstLight, ShapeStore& shapes, const MakeAreaLight& makeAreaLight,
                    Diagnostics& messages)
        : m_description(description), m_camera(camera), m_shutter(shutter), m_firstLight(firstLight),
          m_shapes(shapes), m_makeAreaLight(makeAreaLight), m_messages(messages) {}

    BuiltGeometry build() {
        m_objectUses.resize(m_description.objects.size());
        m_groups.emplace_back();
        m_areaLightDecls.emplace_back();
        placeShapes(m_description.world.shapes, 0, m_worldUses);
        placeShapes(m_description.frame.shapes, 0, m_worldUses);
        appendUses(m_description.world.instances, m_worldUses);
        // Instances first: area lights keep pointers to motions, and need groups that no longer move in
        // memory.
        for (const GroupUse& use : m_worldUses)
            addInstance(use);
        makeAreaLights();
        return std::move(m_built);
    }

  private:
    /// Makes shapes: those that rest into group `home`, those that move into groups of their own (shared by
    /// equal paths), whose uses are appended.
    void placeShapes(std::vector<ShapeDecl>& decls, uint32_t home, std::vector<GroupUse>& uses) {
        MovingGroups movingGroups;
        m_shapes.make(decls, m_messages);
        for (const ShapeDecl& decl : decls) {
            const bool moves = !isStaticDuring(TransformChain(decl.toParent), m_shutter);
            PlacedShape placed{{}, M44f(), nullptr, decl.reverseOrientation};
            if (moves)
                placed.shape = m_shapes.moving(decl);
            else
                placed = m_shapes.resting(decl, m_shutter.open);
            if (!placed.shape.mesh && !placed.shape.quadric)
                continue;
            const uint32_t group = moves ? groupMovingWith(decl.toParent, movingGroups, uses) : home;
            if (std::shared_ptr<TriangleMesh>& mesh = placed.shape.mesh) {
                if (mesh->deforms())
                    mesh = deformed(*mesh, moves ? decl.toParent.at(m_shutter.open) : M44f(), home == 0);
                padForEmbree(*mesh);
            }
            m_groups[group].geometries.push_back({std::move(placed), decl.material, -1, decl.name});
            m_areaLightDecls[group].push_back(decl.areaLight);
        }
    }

    std::shared_ptr<TriangleMesh> deformed(const TriangleMesh& mesh, const M44f& toWorld, bool inWorld) {
        const Box3f box = transformBounds(meshBounds(mesh), toWorld);
        const float scale = std::cbrt(std::abs(determinant3(toWorld)));
        // Objects may be placed anywhere: there, a twentieth of a pixel for a size of 2,500 pixels.
        return fitDeformation(mesh, m_shutter,
                              inWorld ? pixelTolerance(box) / std::max(scale, 1e-20f)
                                      : 2e-5f * length(box.size()));
    }

    struct HashOfKeys {
        size_t operator()(const KeyedTransform& transform) const {
            uint64_t hash = 0;
            for (const M44f& key : transform.keys())
                for (int i = 0; i < 16; ++i) // -0 is equal to 0
                    hash = hashCombine(hash, std::bit_cast<uint32_t>(key.getValue()[i] + 0.f));
            return hash;
        }
    };
    using MovingGroups = std::unordered_map<KeyedTransform, uint32_t, HashOfKeys>;

    uint32_t groupMovingWith(const KeyedTransform& toParent, MovingGroups& movingGroups,
                             std::vector<GroupUse>& uses) {
        const auto [known, isNew] = movingGroups.try_emplace(toParent, uint32_t(m_groups.size()));
        if (isNew)
            uses.push_back({newGroup(), TransformChain(toParent)});
        return known->second;
    }

    uint32_t newGroup() {
        m_groups.emplace_back();
        m_areaLightDecls.emplace_back();
        return uint32_t(m_groups.size() - 1);
    }

    /// The groups of an object, built at its first use; nested instances are flattened, since Embree as
    /// distributed follows one level.
    const std::vector<GroupUse>& usesOf(const InstanceDecl& instance) {
        auto& cached = m_objectUses[size_t(instance.object)];
        if (cached)
            return *cached;
        ObjectDecl& object = m_description.objects[size_t(instance.object)];
        std::vector<GroupUse> uses;
        const uint32_t home = newGroup();
        placeShapes(object.shapes, home, uses);
        if (!m_groups[home].geometries.empty())
            uses.push_back({home, TransformChain()});
        ++m_depth;
        appendUses(object.instances, uses);
        --m_depth;
        return cached.emplace(std::move(uses));
    }

    /// A few lines of text can ask for more instances than any machine holds: those of those of those.
    /// `count`: in all, with those now added.
    void checkCount(size_t count, size_t added, const InstanceDecl& instance) {
        if (count > kMaxInstances)
            throw Error(instance.where, "objects that hold one another make more than " +
                                            std::to_string(kMaxInstances) + " instances");
        m_unchecked += added;
        if (m_unchecked < kCheckEvery) // the system is asked for the memory in use: that takes its time
            return;
        m_unchecked = 0;
        resourcePolicyOf(instance.where)
            .requireMemory(count * kBytesPerInstance, std::to_string(count) + " instances", "use fewer",
                           instance.where);
    }

    void appendUses(const std::vector<InstanceDecl>& instances, std::vector<GroupUse>& uses) {
        Numbering numbers;
        for (const InstanceDecl& instance : instances) {
            if (m_depth > kMaxObjectDepth)
                throw Error(instance.where, "objects hold one another more than " +
                                                std::to_string(kMaxObjectDepth) + " deep");
            const std::string name = instance.name.empty()
                                         ? numbers.next(m_description.objects[size_t(instance.object)].name)
                                         : instance.name;
            const std::vector<GroupUse>& inner = usesOf(instance);
            checkCount(uses.size() + inner.size(), inner.size(), instance);
            for (GroupUse use : inner) {
                append(use.path, instance.toParent);
                use.name = joinedName(name, use.name);
                uses.push_back(std::move(use));
            }
        }
    }

    void addInstance(const GroupUse& use) {
        const Box3f bounds = groupBounds(use.group);
        Box3f swept;
        for (int i = use.path.isStatic() ? 8 : 0; i <= 8; ++i)
            swept.extendBy(transformBounds(bounds, use.path.at(m_shutter.sceneTime(float(i) / 8))));
        auto motion = std::make_shared<Motion>(use.path, m_shutter, bounds, pixelTolerance(swept));
        if (!motion->converged())
            m_messages.warnOnce(
                "motion fit", {},
                "a motion turns too much during the shutter to be followed within 1/20 pixel; it is "
                "approximated by 128 pieces");
        m_built.instances.push_back({use.group, std::move(motion), {}, use.name});
    }

    Box3f groupBounds(uint32_t group) {
        if (m_groupBounds.size() <= group)
            m_groupBounds.resize(m_groups.size());
        Box3f& box = m_groupBounds[group];
        if (box.isEmpty())
            for (const Geometry& g : m_groups[group].geometries)
                box.extendBy(transformBounds(shapeBounds(g.placed.shape), g.placed.toParent));
        return box;
    }

    /// A twentieth of a pixel where the box comes nearest to the camera.
    float pixelTolerance(const Box3f& box) const {
        float distance = kInfinity;
        for (int i = 0; i <= 8; ++i)
            distance = std::min(distance, distanceTo(box, m_camera.position(float(i) / 8)));
        const RayCone cone = m_camera.cone(V2f(0));
        const float pixel = cone.width + distance * cone.spread;
        return std::max(kPathTolerancePixels * pixel, 1e-5f * length(box.size()));
    }

    void makeAreaLights() {
        for (size_t i = 0; i < m_groups[0].geometries.size(); ++i)
            m_groups[0].geometries[i].light = makeAreaLight(0, i, nullptr);
        for (Instance& instance : m_built.instances) {
            const auto& decls = m_areaLightDecls[instance.group];
            if (std::none_of(decls.begin(), decls.end(), [](int decl) { return decl >= 0; }))
                continue;
            for (size_t i = 0; i < decls.size(); ++i)
                instance.lights.push_back(makeAreaLight(instance.group, i, instance.motion));
        }
        m_built.groups = std::move(m_groups);
    }

    /// The index of the new light, or -1 when the shape does not shine.
    int makeAreaLight(uint32_t group, size_t geometry, std::shared_ptr<const Motion> motion) {
        const int decl = m_areaLightDecls[group][geometry];
        if (decl < 0)
            return -1;
        PlacedShape placed = m_groups[group].geometries[geometry].placed;
        placed.motion = std::move(motion);
        auto light = m_makeAreaLight(m_description.areaLights[size_t(decl)], placed);
        if (!light) // of a kind that is left out
            return -1;
        m_built.areaLights.push_back(std::move(light));
        return m_firstLight + int(m_built.areaLights.size()) - 1;
    }

    SceneDescription& m_description;
    const Camera& m_camera;
    const Shutter m_shutter;
    const int m_firstLight;
    ShapeStore& m_shapes;
    const MakeAreaLight& m_makeAreaLight;
    Diagnostics& m_messages;

    std::vector<Group> m_groups;
    std::vector<std::vector<int>> m_areaLightDecls; ///< beside m_groups[].geometries; -1: does not shine
    std::vector<Box3f> m_groupBounds;
    std::vector<GroupUse> m_worldUses;
    std::vector<std::optional<std::vector<GroupUse>>> m_objectUses;
    size_t m_unchecked = 0; ///< instances since memory was checked
    int m_depth = 0;        ///< of objects in objects, while m_objectUses is filled
    BuiltGeometry m_built;
};

} // namespace

void ShapeStore::make(std::vector<ShapeDecl>& decls, Diagnostics& messages) {
    struct Made {
        Shape shape;
        Diagnostics messages = Diagnostics::recorder();
        std::exception_ptr error;
    };
    std::vector<ShapeDecl*> missing;
    for (ShapeDecl& decl : decls)
        if (!m_entries.contains(&decl))
            missing.push_back(&decl);
    std::vector<Made> made(missing.size());
    parallelFor(missing.size(), [&](size_t i) {
        try {
            made[i].shape = m_make(*missing[i], made[i].messages);
        } catch (...) {
            made[i].error = std::current_exception();
        }
    });
    for (size_t i = 0; i < missing.size(); ++i) {
        made[i].messages.replayTo(messages);
        if (made[i].error)
            std::rethrow_exception(made[i].error);
        m_entries[missing[i]] = {std::move(made[i].shape)};
    }
}

ShapeStore::Entry& ShapeStore::take(const ShapeDecl& decl) {
    Entry& entry = m_entries.at(&decl);
    if (m_keep && !decl.isPassing)
        return entry;
    m_passing = std::move(entry);
    m_entries.erase(&decl);
    return m_passing;
}

PlacedShape ShapeStore::resting(const ShapeDecl& decl, float time) {
    const M44f m = decl.toParent.at(time);
    Entry& kept = take(decl);
    if (!kept.shape.mesh)
        return {kept.shape, m, nullptr, decl.reverseOrientation};
    Entry baked = kept;
    if (!baked.isBaked) {
        const bool forGood = !m_keep || decl.isPassing || decl.toParent.isStatic();
        if (!forGood)
            baked.shape.mesh = std::make_shared<TriangleMesh>(*baked.shape.mesh);
        baked.isMirrored = bake(*baked.shape.mesh, m);
        baked.isBaked = true;
        if (forGood)
            kept = baked;
    }
    return {baked.shape, M44f(), nullptr, decl.reverseOrientation != baked.isMirrored};
}

BuiltGeometry buildGeometry(SceneDescription& description, const Camera& camera, const Shutter& shutter,
                            int firstLight, ShapeStore& shapes, const MakeAreaLight& makeAreaLight,
                            Diagnostics& messages) {
    return GeometryBuilder(description, camera, shutter, firstLight, shapes, makeAreaLight, messages).build();
}

} // namespace strobe
