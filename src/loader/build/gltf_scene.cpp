#include "loader/build/gltf_scene.h"

#include "loader/parser/current_transform.h"

namespace strobe {
namespace {

const ParamDef<FilePath> kFilename{"filename", {}, "glTF 2.0 file, .gltf or .glb"};
const ParamDef<std::string> kScene{"scene", "", "the scene of the file; default: its own choice"};
const ParamDef<std::string> kAnimation{
    "animation", "", "the animation that plays; default: the first, and those that move other things"};
const ParamDef<std::string> kCamera{"camera", "",
                                    "of a scene without Camera: the file's camera; default: its first"};
const ParamDef<bool> kLights{"lights", true, "take the file's lights (KHR_lights_punctual), too"};

Param numbers(const char* name, ParamType type, std::vector<float> values) {
    return {name, type, {}, std::move(values), {}, {}};
}

Statement statement(std::string name, std::vector<Param> params, const Location& where) {
    Statement out{std::move(name), ParamSet(where), where};
    for (Param& param : params)
        out.params.add(std::move(param));
    return out;
}

/// All of a path after another one.
TransformChain joined(TransformChain path, const TransformChain& then) {
    for (const KeyedTransform& t : then.chain())
        if (!(t.isStatic() && t.keys().front() == M44f()))
            path.append(t);
    return path;
}

constexpr Shutter kStart{0, 0};

} // namespace

/// One file in a description.
class GltfScene::File {
  public:
    File(SceneDescription& description, const GltfDecl& decl, TextureCache& textures, Diagnostics& messages)
        : m_decl(decl), m_importer(decl.document, decl.settings, textures, messages),
          m_firstMaterial(int(description.materials.size())) {
        for (const gltf::ImportedMaterial& material : m_importer.materials())
            addMaterial(description, material);
        const std::vector<TransformChain> rest = m_importer.motions(kStart);
        for (gltf::ImportedObject& object : m_importer.takeObjects())
            addObject(description, object, rest);
        m_firstLight = description.lights.size();
        for (const gltf::ImportedLight& light : m_importer.lights())
            description.lights.push_back({statementOf(light), placed(rest[light.node], kStart)});
    }

    const gltf::Importer& importer() const { return m_importer; }
    const GltfDecl& decl() const { return m_decl; }

    /// Emission that pictures cannot show is meant to light things; less is a display or a decoration.
    bool shines() const {
        const auto& materials = m_importer.materials();
        return !m_importer.lights().empty() ||
               std::any_of(materials.begin(), materials.end(), [](const gltf::ImportedMaterial& material) {
                   return maxComponent(material.emission) > 1;
               });
    }
    void listMovingLights(std::vector<size_t>& out) const {
        for (size_t i = 0; i < m_importer.lights().size(); ++i)
            if (moves(m_importer.lights()[i].moves))
                out.push_back(m_firstLight + i);
    }
    Box3f bounds() const {
        const Box3f& box = m_importer.bounds();
        const M44f toWorld = m_decl.toParent.at(0);
        Box3f out;
        for (int i = 0; i < 8 && !box.isEmpty(); ++i)
            out.extendBy(
                transformPoint(toWorld, {(i & 1 ? box.max : box.min).x, (i & 2 ? box.max : box.min).y,
                                         (i & 4 ? box.max : box.min).z}));
        return out;
    }

    /// Where everything is while the shutter is open; `cameraToWorld` may be null.
    void addFrame(SceneDescription& description, const Shutter& shutter,
                  KeyedTransform* cameraToWorld) const {
        const std::vector<TransformChain> motions = m_importer.motions(shutter);
        for (const Moving& moving : m_moving)
            home(description)
                .instances.push_back(
                    {moving.object, joined(motions[moving.node], m_decl.toParent), m_decl.where});
        for (gltf::ImportedDeformation& d : m_importer.deformations(motions, shutter))
            addShapes(
                description, d.name, shapesOf(d.name, d.shapes, true), joined(d.toScene, m_decl.toParent),
                m_decl.object < 0 ? description.frame.shapes : home(description).shapes, m_decl.object < 0);
        for (size_t i = 0; i < m_importer.lights().size(); ++i)
            if (const gltf::ImportedLight& light = m_importer.lights()[i]; moves(light.moves))
                description.lights[m_firstLight + i].toWorld = placed(motions[light.node], shutter);
        if (cameraToWorld) {
            // glTF's cameras look along -z with +x to the right.
            const M44f turn(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1);
            *cameraToWorld = placed(
                joined(TransformChain(KeyedTransform(turn)), motions[m_importer.camera()->node]), shutter);
        }
    }

  private:
    /// A node that shows an object and may move.
    struct Moving {
        int object;
        size_t node;
    };
    bool moves(bool inFile) const { return inFile || !m_decl.toParent.isStatic(); }
    KeyedTransform placed(const TransformChain& toScene, const Shutter& shutter) const {
        return m_importer.flattened(joined(toScene, m_decl.toParent), shutter);
    }
    ObjectDecl& home(SceneDescription& description) const {
        return m_decl.object < 0 ? description.world : description.objects[size_t(m_decl.object)];
    }

    void addMaterial(SceneDescription& description, const gltf::ImportedMaterial& material) {
        m_areaLights.push_back(-1);
        if (!isBlack(material.emission)) {
            m_areaLights.back() = int(description.areaLights.size());
            const Rgb& e = material.emission;
            Statement light = statement("diffuse",
                                        {numbers("L", ParamType::Rgb, {e.x, e.y, e.z}),
                                         {"twosided", ParamType::Bool, {}, {}, {material.doubleSided}, {}}},
                                        m_decl.where);
            if (material.emissionTexture) {
                const int index = int(description.textures.size());
                description.textures.push_back({material.name, false, {}, {}, material.emissionTexture});
                light.params.add({"texture", ParamType::Texture, {}, {}, {index, index}, {material.name}});
            }
            description.areaLights.push_back({std::move(light)});
        }
        description.materials.push_back(
            {material.name, {"metallicroughness", ParamSet(), m_decl.where}, material.material});
    }

    std::vector<ShapeDecl> shapesOf(const std::string& name, const std::vector<gltf::ImportedShape>& shapes,
                                    bool isPassing) const {
        std::vector<ShapeDecl> out;
        for (const gltf::ImportedShape& shape : shapes)
            out.push_back({statement("gltf", {}, m_decl.where),
                           {},
                           m_firstMaterial + shape.material,
                           m_areaLights[size_t(shape.material)],
                           false,
                           name,
                           {shape.mesh, nullptr},
                           isPassing});
        return out;
    }

    /// What stands in one place goes into `alone`, if it may: there it is not an instance, if it rests.
    void addShapes(SceneDescription& description, const std::string& name, std::vector<ShapeDecl> shapes,
                   const TransformChain& path, std::vector<ShapeDecl>& alone, bool mayBeAlone) const {
        if (mayBeAlone && path.chain().size() <= 1) {
            for (ShapeDecl& shape : shapes) {
                if (!path.chain().empty())
                    shape.toParent = path.chain().front();
                alone.push_back(std::move(shape));
            }
            return;
        }
        home(description).instances.push_back({int(description.objects.size()), path, m_decl.where});
        description.objects.push_back({name, m_decl.where, std::move(shapes), {}});
    }

    void addObject(SceneDescription& description, const gltf::ImportedObject& object,
                   const std::vector<TransformChain>& rest) {
        const auto pathOf = [&](size_t node) { return joined(rest[node], m_decl.toParent); };
        std::vector<ShapeDecl> shapes = shapesOf(object.name, object.shapes, false);
        if (object.places.size() == 1 && !object.places[0].moves)
            return addShapes(description, object.name, std::move(shapes), pathOf(object.places[0].node),
                             home(description).shapes, true);
        const int index = int(description.objects.size());
        for (const gltf::ImportedObject::Place& place : object.places)
            if (place.moves)
                m_moving.push_back({index, place.node});
            else
                home(description).instances.push_back({index, pathOf(place.node), m_decl.where});
        description.objects.push_back({object.name, m_decl.where, std::move(shapes), {}});
    }

    Statement statementOf(const gltf::ImportedLight& light) const {
        const Rgb& c = light.intensity;
        const auto color = [&](const char* name) { return numbers(name, ParamType::Rgb, {c.x, c.y, c.z}); };
        const Param aim = numbers("to", ParamType::Vector3, {0, 0, -1});
        const auto degrees = [](const char* name, float radians) {
            return numbers(name, ParamType::Float, {radians * (180 / kPi)});
        };
        switch (light.kind) {
        case gltf::ImportedLight::Directional:
            return statement("distant", {color("L"), aim}, m_decl.where);
        case gltf::ImportedLight::Spot:
            return statement("spot",
                             {color("I"),
                              aim,
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
    std::vector<int> m_areaLights; ///< by material of the file; -1: does not shine
    std::vector<Moving> m_moving;
};

namespace {

/// A white sky and a warm sun, for what comes without light.
void addDaylight(SceneDescription& description) {
    description.lights.push_back(
        {statement("infinite", {numbers("L", ParamType::Rgb, {.6f, .65f, .7f})}, {}), KeyedTransform()});
    description.lights.push_back({statement("distant",
                                            {numbers("L", ParamType::Rgb, {2.4f, 2.2f, 2.f}),
                                             numbers("from", ParamType::Vector3, {-.6f, 1, .8f}),
                                             numbers("to", ParamType::Vector3, {0, 0, 0})},
                                            {}),
                                  KeyedTransform()});
}

/// Sees all of a box from the front, a little from the right and from above (glTF's front is +z).
KeyedTransform viewOf(const Box3f& bounds, float halfAngle) {
    const V3f center = bounds.isEmpty() ? V3f(0) : (bounds.min + bounds.max) * .5f;
    const float size = bounds.isEmpty() ? 0 : length(bounds.size()), radius = size > 0 ? size / 2 : 1;
    const V3f eye = center + normalize(V3f(.5f, .4f, 1)) * (radius / std::sin(halfAngle));
    const M44d toCamera = lookAt({eye.x, eye.y, eye.z, center.x, center.y, center.z, 0, 1, 0}, {});
    const M44d turn = scaling(-1, 1, 1, {}); // lookAt is left-handed, glTF right-handed
    return KeyedTransform(M44f(turn * toCamera.inverse()));
}

constexpr float kDefaultHalfFov = 20; // degrees

} // namespace

Plugin<Shape> gltfPlugin() {
    return {"gltf",
            "a glTF 2.0 file with its own materials and motion: docs/gltf.md",
            {kFilename, kScene, kAnimation, kCamera, kLights},
            [](const ParamSet& params, const BuildContext&) -> Shape {
                throw Error(params.where(), "Shape \"gltf\" cannot be made by itself");
            }};
}

GltfDecl readGltf(const ParamSet& params, bool strict, Diagnostics& messages) {
    const Location where = params.whereIs(kFilename);
    GltfDecl decl = readGltf(params.require(kFilename).path, where, where ? where.source->policy : nullptr);
    decl.settings = {params.get(kScene), params.get(kAnimation), params.get(kCamera), params.get(kLights)};
    params.reportUnused(gltfPlugin().params, strict, messages);
    return decl;
}

GltfDecl readGltf(const std::filesystem::path& path, const Location& where,
                  std::shared_ptr<const ResourcePolicy> guard) {
    return {gltf::open(path, where, std::move(guard)), {}, {}, -1, where};
}

GltfScene::GltfScene(SceneDescription& description, TextureCache& textures, Diagnostics& messages) {
    bool lit = !description.lights.empty() || !description.areaLights.empty();
    for (const GltfDecl& decl : description.gltfs) {
        m_files.push_back(std::make_unique<File>(description, decl, textures, messages));
        const File& file = *m_files.back();
        lit |= file.shines();
        file.listMovingLights(m_movingLights);
        m_bounds.extendBy(file.bounds());
        if (!m_cameraFile && file.importer().camera() && decl.object < 0)
            m_cameraFile = &file;
    }
    if (!m_files.empty() && !lit)
        addDaylight(description);
    m_givesCamera = !m_files.empty() && !description.camera;
}

GltfScene::~GltfScene() = default;

Statement GltfScene::film() const {
    constexpr float kLonger = 640;
    const auto pixels = [](float x) { return std::max(1, int(std::lround(x))); };
    std::vector<Param> params;
    if (const float aspect = m_cameraFile ? m_cameraFile->importer().camera()->aspect : 0; aspect > 0) {
        const int width = pixels(kLonger * std::min(aspect, 1.f)),
                  height = pixels(kLonger / std::max(aspect, 1.f));
        params = {{"xresolution", ParamType::Int, {}, {}, {width}, {}},
                  {"yresolution", ParamType::Int, {}, {}, {height}, {}}};
    }
    return statement("image", std::move(params), {});
}

Statement GltfScene::camera(const V2i& resolution) const {
    const float aspect = float(resolution.x) / float(resolution.y);
    const bool isPerspective = !m_cameraFile || m_cameraFile->importer().camera()->isPerspective;
    const float high = m_cameraFile ? m_cameraFile->importer().camera()->halfHeight
                                    : std::tan(radians(kDefaultHalfFov)) / std::min(aspect, 1.f);
    const float wide = high * aspect;
    if (!isPerspective)
        return statement("orthographic",
                         {numbers("screenwindow", ParamType::Float, {-wide, wide, -high, high})}, {});
    const float fov = 2 * std::atan(std::min(high, wide)) * (180 / kPi); // along the shorter side
    return statement("perspective", {numbers("fov", ParamType::Float, {fov})}, {});
}

void GltfScene::beginFrame(SceneDescription& description, const Shutter& shutter) {
    m_stillObjects = description.objects.size();
    m_stillInstances = {description.world.instances.size()};
    for (const ObjectDecl& object : description.objects)
        m_stillInstances.push_back(object.instances.size());
    for (const auto& file : m_files) {
        const bool givesCamera = m_givesCamera && m_cameraFile == file.get();
        file->addFrame(description, shutter, givesCamera ? &description.cameraToWorld : nullptr);
    }
    if (m_givesCamera && !m_cameraFile)
        description.cameraToWorld = viewOf(m_bounds, radians(kDefaultHalfFov));
}

void GltfScene::endFrame(SceneDescription& description) {
    description.frame.shapes.clear();
    description.world.instances.resize(m_stillInstances[0]);
    description.objects.resize(m_stillObjects);
    for (size_t i = 0; i < m_stillObjects; ++i)
        description.objects[i].instances.resize(m_stillInstances[i + 1]);
}

} // namespace strobe
