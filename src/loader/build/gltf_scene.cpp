#include "loader/build/gltf_scene.h"

#include "loader/parser/current_transform.h"

namespace strobe {
namespace {

Param floatParam(const char* name, ParamType type, std::vector<float> values) {
    return {name, type, {}, std::move(values), {}, {}};
}

Statement statement(std::string name, std::vector<Param> params, const Location& where) {
    Statement out{std::move(name), ParamSet(where), where};
    for (Param& param : params)
        out.params.add(std::move(param));
    return out;
}

/// Returns `path` followed by `outer`, without identities.
TransformChain joined(TransformChain path, const TransformChain& outer) {
    for (const KeyedTransform& t : outer.chain())
        if (!(t.isStatic() && t.keys().front() == M44f()))
            path.append(t);
    return path;
}

/// Returns the path of an instance through its node.
TransformChain fromInstance(const M44f& toNode, const TransformChain& path) {
    return toNode == M44f() ? path : joined(TransformChain(KeyedTransform(toNode)), path);
}

constexpr Shutter kTimeZero{0, 0};

} // namespace

/// A glTF file and the declarations that it adds to the description.
class GltfScene::File {
  public:
    File(SceneDescription& description, const GltfDecl& decl, TextureCache& textures,
         Diagnostics& diagnostics)
        : m_decl(decl), m_importer(decl.document, decl.settings, textures, diagnostics),
          m_firstMaterial(int(description.materials.size())) {
        for (const gltf::ImportedMaterial& material : m_importer.materials())
            addMaterial(description, material);
        const std::vector<TransformChain> motions = m_importer.motions(kTimeZero);
        for (gltf::ImportedObject& object : m_importer.takeObjects())
            addObject(description, object, motions);
        m_firstLight = description.lights.size();
        for (const gltf::ImportedLight& light : m_importer.lights())
            description.lights.push_back({statementOf(light), toParentSpace(motions[light.node], kTimeZero)});
    }

    const gltf::Importer& importer() const { return m_importer; }
    const GltfDecl& decl() const { return m_decl; }

    bool hasLights() const { return !m_importer.lights().empty(); }
    /// Appends the indices of the description's lights that move.
    void appendMovingLights(std::vector<size_t>& out) const {
        for (size_t i = 0; i < m_importer.lights().size(); ++i)
            if (moves(m_importer.lights()[i].moves))
                out.push_back(m_firstLight + i);
    }
    /// Appends the outermost vertices, in the parent's space.
    void appendExtremes(std::vector<V3f>& out) const {
        const M44f toParent = m_decl.toParent.at(0);
        for (const V3f& p : m_importer.extremes())
            out.push_back(transformPoint(toParent, p));
    }

    /// Returns the position of the file's camera at time 0, in the parent's space.
    V3f eye() const {
        const TransformChain path =
            joined(m_importer.motions(kTimeZero)[m_importer.camera()->node], m_decl.toParent);
        return transformPoint(path.at(0), V3f(0));
    }

    /// Appends everything that moves or deforms while the shutter is open. `cameraToWorld`: set to the
    /// transform of the file's camera; may be null.
    void addFrame(SceneDescription& description, const Shutter& shutter,
                  KeyedTransform* cameraToWorld) const {
        const std::vector<TransformChain> motions = m_importer.motions(shutter);
        for (const MovingInstance& moving : m_movingInstances)
            parent(description)
                .instances.push_back(
                    {moving.object,
                     joined(fromInstance(moving.toNode, motions[moving.node]), m_decl.toParent),
                     m_decl.where});
        for (gltf::ImportedDeformation& d : m_importer.deformations(motions, shutter))
            addShapes(description, d.name, shapesOf(d.name, d.shapes, true),
                      joined(d.toScene, m_decl.toParent),
                      m_decl.object < 0 ? &description.frameShapes : nullptr);
        for (size_t i = 0; i < m_importer.lights().size(); ++i)
            if (const gltf::ImportedLight& light = m_importer.lights()[i]; moves(light.moves))
                description.lights[m_firstLight + i].toWorld = toParentSpace(motions[light.node], shutter);
        if (cameraToWorld) {
            // glTF's cameras look along -z, strobe's along +z; both have +x to the right.
            const M44f flipZ(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1);
            *cameraToWorld = toParentSpace(
                joined(TransformChain(KeyedTransform(flipZ)), motions[m_importer.camera()->node]), shutter);
        }
    }

  private:
    /// An instance of an object whose node is animated.
    struct MovingInstance {
        int object;
        size_t node;
        M44f toNode;
    };
    bool moves(bool movesInFile) const { return movesInFile || !m_decl.toParent.isStatic(); }
    KeyedTransform toParentSpace(const TransformChain& toScene, const Shutter& shutter) const {
        return m_importer.flattened(joined(toScene, m_decl.toParent), shutter);
    }
    /// Returns the object that the file belongs to, or the world.
    ObjectDecl& parent(SceneDescription& description) const {
        return m_decl.object < 0 ? description.world : description.objects[size_t(m_decl.object)];
    }

    void addMaterial(SceneDescription& description, const gltf::ImportedMaterial& material) {
        m_areaLights.push_back(-1);
        if (!isBlack(material.emission)) {
            m_areaLights.back() = int(description.areaLights.size());
            const Rgb& e = material.emission;
            Statement light = statement("diffuse",
                                        {floatParam("L", ParamType::Rgb, {e.x, e.y, e.z}),
                                         {"twosided", ParamType::Bool, {}, {}, {material.doubleSided}, {}}},
                                        m_decl.where);
            if (material.emissionTexture) {
                const int index = int(description.textures.size());
                description.textures.push_back({material.name, false, {}, {}, material.emissionTexture});
                light.params.add({"texture", ParamType::Texture, {}, {}, {index, index}, {material.name}});
            }
            description.areaLights.push_back({std::move(light)});
        }
        m_media.push_back(isBlack(material.absorption) ? -1 : int(description.media.size()));
        if (!isBlack(material.absorption))
            description.media.push_back({material.absorption, Rgb(0)});
        description.materials.push_back(
            {material.name, {"metallicroughness", ParamSet(), m_decl.where}, material.material});
    }

    std::vector<ShapeDecl> shapesOf(const std::string& name, const std::vector<gltf::ImportedShape>& shapes,
                                    bool isPerFrame) const {
        std::vector<ShapeDecl> out;
        for (const gltf::ImportedShape& shape : shapes)
            out.push_back({statement("gltf", {}, m_decl.where),
                           {},
                           m_firstMaterial + shape.material,
                           m_areaLights[size_t(shape.material)],
                           false,
                           name,
                           {shape.mesh, nullptr},
                           isPerFrame,
                           m_media[size_t(shape.material)]});
        return out;
    }

    /// Adds shapes that occur once. A path of one transform becomes theirs, and they are appended to
    /// `direct`, so that static shapes need no instance. Else, or if `direct` is null, they become an object
    /// with an instance.
    void addShapes(SceneDescription& description, const std::string& name, std::vector<ShapeDecl> shapes,
                   const TransformChain& path, std::vector<ShapeDecl>* direct) const {
        if (direct && path.chain().size() <= 1) {
            for (ShapeDecl& shape : shapes) {
                if (!path.chain().empty())
                    shape.toParent = path.chain().front();
                direct->push_back(std::move(shape));
            }
            return;
        }
        parent(description).instances.push_back({int(description.objects.size()), path, m_decl.where});
        description.objects.push_back({name, m_decl.where, std::move(shapes), {}});
    }

    void addObject(SceneDescription& description, const gltf::ImportedObject& object,
                   const std::vector<TransformChain>& motions) {
        const auto pathOf = [&](const gltf::ImportedObject::Instance& instance) {
            return joined(fromInstance(instance.toNode, motions[instance.node]), m_decl.toParent);
        };
        std::vector<ShapeDecl> shapes = shapesOf(object.name, object.shapes, false);
        if (object.instances.size() == 1 && !object.instances[0].moves)
            return addShapes(description, object.name, std::move(shapes), pathOf(object.instances[0]),
                             &parent(description).shapes);
        const int index = int(description.objects.size());
        for (const gltf::ImportedObject::Instance& instance : object.instances)
            if (instance.moves)
                m_movingInstances.push_back({index, instance.node, instance.toNode});
            else
                parent(description).instances.push_back({index, pathOf(instance), m_decl.where});
        description.objects.push_back({object.name, m_decl.where, std::move(shapes), {}});
    }

    Statement statementOf(const gltf::ImportedLight& light) const {
        const Rgb& c = light.intensity;
        const auto color = [&](const char* name) {
            return floatParam(name, ParamType::Rgb, {c.x, c.y, c.z});
        };
        const Param direction = floatParam("to", ParamType::Vector3, {0, 0, -1});
        const auto degrees = [](const char* name, float radians) {
            return floatParam(name, ParamType::Float, {radians * (180 / kPi)});
        };
        switch (light.kind) {
        case gltf::ImportedLight::Directional:
            return statement("distant", {color("L"), direction}, m_decl.where);
        case gltf::ImportedLight::Spot:
            return statement("spot",
                             {color("I"),
                              direction,
                              degrees("coneangle", light.outerAngle),
                              degrees("conedeltaangle", light.outerAngle - light.innerAngle),
                              {"falloff", ParamType::String, {}, {}, {}, {"squared"}}},
                             m_decl.where);
        case gltf::ImportedLight::Point:
            break;
        }
        return statement("point", {color("I")}, m_decl.where);
    }

    const GltfDecl m_decl;
    gltf::Importer m_importer;
    const int m_firstMaterial;
    size_t m_firstLight = 0;
    std::vector<int> m_areaLights; ///< by material of the file; -1: no emission
    std::vector<int> m_media;      ///< by material of the file; -1: no absorption inside
    std::vector<MovingInstance> m_movingInstances;
};

namespace {

void addStudio(SceneDescription& description) {
    description.lights.push_back({statement("studio", {}, {}), KeyedTransform()});
}

/// Adds a point light at a camera that is inside of the scene, as in a room, which the studio may not light.
void addLightInside(SceneDescription& description, const V3f& eye, const std::vector<V3f>& points) {
    Box3f box;
    for (const V3f& p : points)
        box.extendBy(p);
    if (points.empty() || !box.intersects(eye))
        return;
    const float distance = extentOf(points) / 8; // of surfaces with an irradiance of 1
    const Param position = floatParam("from", ParamType::Vector3, {eye.x, eye.y, eye.z});
    description.lights.push_back(
        {statement("point", {floatParam("I", ParamType::Rgb, std::vector<float>(3, sqr(distance))), position},
                   {}),
         KeyedTransform()});
}

/// Adds a matte floor at the height of the lowest point. It is so large that its edge is near the horizon.
void addGround(SceneDescription& description, const std::vector<V3f>& points) {
    constexpr float kSizes = 60;
    const float size = std::max(extentOf(points), 1e-6f);
    description.materials.push_back(
        {"ground", statement("matte", {floatParam("Kd", ParamType::Rgb, {.2f, .2f, .2f})}, {}), nullptr});
    ShapeDecl disk{statement("disk", {floatParam("radius", ParamType::Float, {kSizes * size})}, {}), {}, {}};
    // The disk's z becomes up.
    const float height = lowestPoint(points) - 1e-4f * size;
    disk.toParent = KeyedTransform(M44f(1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, height, 0, 1));
    disk.material = int(description.materials.size()) - 1;
    disk.name = "ground";
    description.world.shapes.push_back(std::move(disk));
}

constexpr float kDefaultHalfFov = 20; // degrees

} // namespace

GltfScene::GltfScene(SceneDescription& description, TextureCache& textures, bool hasGround,
                     Diagnostics& diagnostics) {
    const bool isLitByScene = !description.lights.empty() || !description.areaLights.empty();
    bool isLitByFiles = false;
    for (const GltfDecl& decl : description.gltfs) {
        m_files.push_back(std::make_unique<File>(description, decl, textures, diagnostics));
        const File& file = *m_files.back();
        isLitByFiles |= file.hasLights();
        file.appendMovingLights(m_movingLights);
        file.appendExtremes(m_extremes);
        if (!m_cameraFile && file.importer().camera() && decl.object < 0)
            m_cameraFile = &file;
    }
    m_isLitByFiles = isLitByFiles && !isLitByScene;
    if (!m_files.empty() && !isLitByFiles && !isLitByScene) {
        addStudio(description);
        if (m_cameraFile && !description.camera)
            addLightInside(description, m_cameraFile->eye(), m_extremes);
    }
    if (!m_files.empty() && hasGround)
        addGround(description, m_extremes);
    m_givesCamera = !m_files.empty() && !description.camera;
}

GltfScene::~GltfScene() = default;

Statement GltfScene::film() const {
    constexpr float kLongerSide = 640; // pixels
    const auto pixels = [](float x) { return std::max(1, int(std::lround(x))); };
    std::vector<Param> params;
    if (const float aspect = m_cameraFile ? m_cameraFile->importer().camera()->aspect : 0; aspect > 0) {
        const int width = pixels(kLongerSide * std::min(aspect, 1.f));
        const int height = pixels(kLongerSide / std::max(aspect, 1.f));
        params = {{"xresolution", ParamType::Int, {}, {}, {width}, {}},
                  {"yresolution", ParamType::Int, {}, {}, {height}, {}}};
    }
    return statement("image", std::move(params), {});
}

Statement GltfScene::camera(const V2i& resolution) {
    const float aspect = float(resolution.x) / float(resolution.y);
    const bool isPerspective = !m_cameraFile || m_cameraFile->importer().camera()->isPerspective;
    const float halfHeight = m_cameraFile ? m_cameraFile->importer().camera()->halfHeight
                                          : std::tan(radians(kDefaultHalfFov)) / std::min(aspect, 1.f);
    const float halfWidth = halfHeight * aspect;
    m_halfView = {halfWidth, halfHeight};
    if (!isPerspective)
        return statement(
            "orthographic",
            {floatParam("screenwindow", ParamType::Float, {-halfWidth, halfWidth, -halfHeight, halfHeight})},
            {});
    const float fov = 2 * std::atan(std::min(halfHeight, halfWidth)) * (180 / kPi); // along the shorter side
    return statement("perspective", {floatParam("fov", ParamType::Float, {fov})}, {});
}

void GltfScene::beginFrame(SceneDescription& description, const Shutter& shutter) {
    m_staticObjects = description.objects.size();
    m_staticInstances = {description.world.instances.size()};
    for (const ObjectDecl& object : description.objects)
        m_staticInstances.push_back(object.instances.size());
    for (const auto& file : m_files) {
        const bool givesCamera = m_givesCamera && m_cameraFile == file.get();
        file->addFrame(description, shutter, givesCamera ? &description.cameraToWorld : nullptr);
    }
    if (m_givesCamera && !m_cameraFile)
        description.cameraToWorld = viewOf(m_extremes, m_halfView);
}

void GltfScene::endFrame(SceneDescription& description) {
    description.frameShapes.clear();
    description.world.instances.resize(m_staticInstances[0]);
    description.objects.resize(m_staticObjects);
    for (size_t i = 0; i < m_staticObjects; ++i)
        description.objects[i].instances.resize(m_staticInstances[i + 1]);
}

} // namespace strobe
