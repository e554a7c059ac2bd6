#include "loader/build/geometry_builder.h"

#include "core/math/hash.h"
#include "core/scene/object_names.h"
#include "core/util/resource_policy.h"
#include "loader/build/deformation_fit.h"

#include <bit>
#include <unordered_map>

namespace strobe {

namespace {

constexpr float kMotionTolerancePixels = 0.05f;
constexpr size_t kMaxInstances = size_t(1) << 26;
constexpr size_t kBytesPerInstance = 1600; // measured, with Embree's
constexpr size_t kInstancesPerMemoryCheck = 1024;
constexpr int kMaxObjectDepth = 64;

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

/// Reserves space behind the last vertex: Embree reads sixteen bytes at every vertex.
void padForEmbree(TriangleMesh& mesh) {
    for (auto& key : mesh.positions)
        key.reserve(key.size() + 2);
}

void append(TransformChain& path, const TransformChain& outer) {
    for (const KeyedTransform& t : outer.chain())
        path.append(t);
}

/// An occurrence of a group in an object or in the world.
struct GroupUse {
    uint32_t group;
    TransformChain path; ///< from the group to the object or the world
    std::string name{};  ///< name of the enclosing instance; empty: none
};

/// Throws if the instances in the world, and the instances that they contain, are too many or exceed the
/// memory limit. Their number grows exponentially with the length of the text, so it is computed before any
/// is made. Objects contain instances of former objects only.
void checkInstances(const SceneDescription& description) {
    std::vector<size_t> counts; // by object, at most 1 + kMaxInstances
    const auto add = [&](const std::vector<InstanceDecl>& instances, size_t count) {
        for (const InstanceDecl& instance : instances)
            if (size_t(instance.object) < counts.size())
                count = std::min(count + counts[size_t(instance.object)], 1 + kMaxInstances);
        return count;
    };
    for (const ObjectDecl& object : description.objects)
        counts.push_back(add(object.instances, object.shapes.empty() ? 0 : 1));
    const std::vector<InstanceDecl>& instances = description.world.instances;
    const size_t count = add(instances, 0);
    if (count == 0)
        return;
    const auto largest = std::max_element(instances.begin(), instances.end(), [&](auto& a, auto& b) {
        return counts[size_t(a.object)] < counts[size_t(b.object)];
    });
    if (count > kMaxInstances)
        throw Error(largest->where,
                    "nested objects make more than " + std::to_string(kMaxInstances) + " instances");
    resourcePolicyOf(largest->where)
        .requireMemory(count * kBytesPerInstance, std::to_string(count) + " instances", "use fewer instances",
                       largest->where);
}

class GeometryBuilder {
  public:
    GeometryBuilder(SceneDescription& description, const Camera& camera, const Shutter& shutter,
                    int firstLight, ShapeStore& shapes, const MakeAreaLight& makeAreaLight,
                    Diagnostics& diagnostics)
        : m_description(description), m_camera(camera), m_shutter(shutter), m_firstLight(firstLight),
          m_shapes(shapes), m_makeAreaLight(makeAreaLight), m_diagnostics(diagnostics) {}

    BuiltGeometry build() {
        m_objectUses.resize(m_description.objects.size());
        m_groups.emplace_back();
        m_areaLightDecls.emplace_back();
        placeShapes(m_description.world.shapes, 0, m_worldUses);
        placeShapes(m_description.frameShapes, 0, m_worldUses);
        checkInstances(m_description);
        appendUses(m_description.world.instances, m_worldUses);
        // Instances precede area lights, which keep pointers to motions and to groups: these must no longer
        // move in memory.
        for (const GroupUse& use : m_worldUses)
            addInstance(use);
        makeAreaLights();
        return std::move(m_built);
    }

  private:
    /// Creates shapes. Static shapes go to group `staticGroup`; moving shapes go to new groups, one per path,
    /// whose uses are appended to `uses`.
    void placeShapes(std::vector<ShapeDecl>& decls, uint32_t staticGroup, std::vector<GroupUse>& uses) {
        MovingGroups movingGroups;
        m_shapes.create(decls, m_diagnostics);
        for (const ShapeDecl& decl : decls) {
            const bool moves = !isStaticDuring(TransformChain(decl.toParent), m_shutter);
            PlacedShape placed{{}, M44f(), nullptr, decl.reverseOrientation};
            if (moves)
                placed.shape = m_shapes.inObjectSpace(decl);
            else
                placed = m_shapes.inParentSpace(decl, m_shutter.open);
            if (!placed.shape.mesh && !placed.shape.quadric)
                continue;
            const uint32_t group = moves ? groupMovingWith(decl.toParent, movingGroups, uses) : staticGroup;
            if (std::shared_ptr<TriangleMesh>& mesh = placed.shape.mesh) {
                if (mesh->deforms()) {
                    const M44f toParent = moves ? decl.toParent.at(m_shutter.open) : M44f();
                    mesh = fitToShutter(*mesh, toParent, staticGroup == 0);
                }
                padForEmbree(*mesh);
            }
            m_groups[group].geometries.push_back({std::move(placed), decl.material, -1, decl.name,
                                                  absorption(decl.insideMedium),
                                                  absorption(decl.outsideMedium)});
            m_areaLightDecls[group].push_back(decl.areaLight);
        }
    }

    Rgb absorption(int medium) const {
        return medium < 0 ? Rgb(0) : m_description.media[size_t(medium)].absorption;
    }

    /// `inWorld`: `toParent` leads to the world, else to the space of an object.
    std::shared_ptr<TriangleMesh> fitToShutter(const TriangleMesh& mesh, const M44f& toParent,
                                               bool inWorld) const {
        const Box3f box = transformBounds(meshBounds(mesh), toParent);
        const float scale = std::cbrt(std::abs(determinant3(toParent)));
        // The distance of an object's instances is unknown. Their tolerance, a fraction of the mesh's size,
        // is a twentieth of a pixel for a mesh of 2,500 pixels.
        return fitDeformation(mesh, m_shutter,
                              inWorld ? pixelTolerance(box) / std::max(scale, 1e-20f)
                                      : 2e-5f * length(box.size()));
    }

    struct KeyedTransformHash {
        size_t operator()(const KeyedTransform& transform) const {
            uint64_t hash = 0;
            for (const M44f& key : transform.keys())
                for (int i = 0; i < 16; ++i) // adding 0 turns -0 into 0, which compares equal
                    hash = hashCombine(hash, std::bit_cast<uint32_t>(key.getValue()[i] + 0.f));
            return hash;
        }
    };
    using MovingGroups = std::unordered_map<KeyedTransform, uint32_t, KeyedTransformHash>;

    /// Returns the group of the shapes that move with `toParent`, which is created at its first use.
    uint32_t groupMovingWith(const KeyedTransform& toParent, MovingGroups& movingGroups,
                             std::vector<GroupUse>& uses) {
        const auto [entry, isNew] = movingGroups.try_emplace(toParent, uint32_t(m_groups.size()));
        if (isNew)
            uses.push_back({newGroup(), TransformChain(toParent)});
        return entry->second;
    }

    uint32_t newGroup() {
        m_groups.emplace_back();
        m_areaLightDecls.emplace_back();
        return uint32_t(m_groups.size() - 1);
    }

    /// Returns the groups of an object, which are built at its first use. Nested instances are flattened:
    /// Embree's default build supports one level of instancing.
    const std::vector<GroupUse>& usesOf(const InstanceDecl& instance) {
        auto& cached = m_objectUses[size_t(instance.object)];
        if (cached)
            return *cached;
        ObjectDecl& object = m_description.objects[size_t(instance.object)];
        std::vector<GroupUse> uses;
        const uint32_t staticGroup = newGroup();
        placeShapes(object.shapes, staticGroup, uses);
        if (!m_groups[staticGroup].geometries.empty())
            uses.push_back({staticGroup, TransformChain()});
        ++m_depth;
        appendUses(object.instances, uses);
        --m_depth;
        return cached.emplace(std::move(uses));
    }

    /// Throws if `count` instances, of which the last `added` are new, are too many or exceed the memory
    /// limit: instances of instances grow exponentially with the length of the text.
    void checkCount(size_t count, size_t added, const InstanceDecl& instance) {
        if (count > kMaxInstances)
            throw Error(instance.where,
                        "nested objects make more than " + std::to_string(kMaxInstances) + " instances");
        m_uncheckedInstances += added;
        if (m_uncheckedInstances < kInstancesPerMemoryCheck) // reading the memory in use takes a system call
            return;
        m_uncheckedInstances = 0;
        resourcePolicyOf(instance.where)
            .requireMemory(count * kBytesPerInstance, std::to_string(count) + " instances",
                           "use fewer instances", instance.where);
    }

    void appendUses(const std::vector<InstanceDecl>& instances, std::vector<GroupUse>& uses) {
        Numbering numbers;
        for (const InstanceDecl& instance : instances) {
            if (m_depth > kMaxObjectDepth)
                throw Error(instance.where,
                            "objects are nested more than " + std::to_string(kMaxObjectDepth) + " deep");
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
            m_diagnostics.warnOnce(
                "motion fit", {},
                "a motion rotates too much during the shutter for an error below 1/20 pixel; it is "
                "approximated by 128 segments");
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

    /// Returns a twentieth of a pixel's width where the box is nearest to the camera, in world units.
    float pixelTolerance(const Box3f& box) const {
        float distance = kInfinity;
        for (int i = 0; i <= 8; ++i)
            distance = std::min(distance, distanceTo(box, m_camera.position(float(i) / 8)));
        const RayCone cone = m_camera.cone(V2f(0));
        const float pixel = cone.width + distance * cone.spread;
        return std::max(kMotionTolerancePixels * pixel, 1e-5f * length(box.size()));
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

    /// Returns the index of the new light, or -1 if the shape is not a light.
    int makeAreaLight(uint32_t group, size_t geometry, std::shared_ptr<const Motion> motion) {
        const int decl = m_areaLightDecls[group][geometry];
        if (decl < 0)
            return -1;
        PlacedShape placed = m_groups[group].geometries[geometry].placed;
        placed.motion = std::move(motion);
        auto light = m_makeAreaLight(m_description.areaLights[size_t(decl)], placed);
        if (!light) // skipped
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
    Diagnostics& m_diagnostics;

    std::vector<Group> m_groups;
    std::vector<std::vector<int>> m_areaLightDecls; ///< parallel to m_groups[].geometries; -1: not a light
    std::vector<Box3f> m_groupBounds;
    std::vector<GroupUse> m_worldUses;
    std::vector<std::optional<std::vector<GroupUse>>> m_objectUses;
    size_t m_uncheckedInstances = 0; ///< instances since the last check of memory
    int m_depth = 0;                 ///< nesting of objects, while m_objectUses is filled
    BuiltGeometry m_built;
};

} // namespace

BuiltGeometry buildGeometry(SceneDescription& description, const Camera& camera, const Shutter& shutter,
                            int firstLight, ShapeStore& shapes, const MakeAreaLight& makeAreaLight,
                            Diagnostics& diagnostics) {
    return GeometryBuilder(description, camera, shutter, firstLight, shapes, makeAreaLight, diagnostics)
        .build();
}

} // namespace strobe
