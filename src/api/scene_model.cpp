#include "api/scene_model.h"

#include "core/util/error.h"
#include "loader/build/plugin_tables.h"
#include "loader/parser/parser.h"

namespace strobe {

namespace {

/// Returns a copy of a mesh, or null for null.
std::shared_ptr<TriangleMesh> copyOf(const std::shared_ptr<TriangleMesh>& mesh) {
    return mesh ? std::make_shared<TriangleMesh>(*mesh) : nullptr;
}

/// Returns a copy whose meshes are copies, too: a render changes them.
SceneDescription deepCopy(const SceneDescription& description) {
    SceneDescription copy = description;
    for (ShapeDecl& shape : copy.world.shapes)
        shape.prebuilt.mesh = copyOf(shape.prebuilt.mesh);
    for (ObjectDecl& object : copy.objects)
        for (ShapeDecl& shape : object.shapes)
            shape.prebuilt.mesh = copyOf(shape.prebuilt.mesh);
    return copy;
}

std::vector<float> timesOf(std::vector<float> times, size_t keys) {
    if (times.empty() && keys > 1)
        for (size_t i = 0; i < keys; ++i)
            times.push_back(float(i) / float(keys - 1));
    if (times.size() != keys && keys > 1)
        throw Error("there are " + std::to_string(keys) + " keys and " + std::to_string(times.size()) +
                    " times");
    for (size_t i = 1; i < times.size(); ++i)
        if (!(times[i] > times[i - 1]))
            throw Error("the times of keys must ascend");
    return times;
}

KeyedTransform transformOf(const Placement& placement) {
    if (placement.matrices.empty())
        throw Error("a placement has at least one matrix");
    if (placement.matrices.size() == 1)
        return KeyedTransform(placement.matrices.front());
    return {timesOf(placement.times, placement.matrices.size()), placement.matrices,
            MotionConvention::ObjectToWorld};
}

/// Returns the indices of the textures of a name, as in Param::ints.
std::vector<int> textureIndices(const std::string& name, const std::vector<TextureDecl>& textures) {
    std::vector<int> indices{-1, -1};
    std::vector<std::string> names;
    for (size_t i = 0; i < textures.size(); ++i) {
        names.push_back(textures[i].name);
        if (textures[i].name == name)
            indices[textures[i].isFloat ? 0 : 1] = int(i);
    }
    if (indices[0] < 0 && indices[1] < 0)
        throw Error(unknownName("texture", name, names));
    return indices;
}

/// Sets the type and the values of a parameter.
struct SetValue {
    Param& param;
    const std::vector<TextureDecl>& textures;

    void set(ParamType type, std::vector<float> floats) const {
        param.type = type;
        param.floats = std::move(floats);
    }
    void set(ParamType type, std::vector<int> ints) const {
        param.type = type;
        param.ints = std::move(ints);
    }
    void operator()(bool value) const { set(ParamType::Bool, std::vector<int>{value ? 1 : 0}); }
    void operator()(int value) const { set(ParamType::Int, std::vector<int>{value}); }
    void operator()(float value) const { set(ParamType::Float, std::vector<float>{value}); }
    void operator()(const std::string& value) const { (*this)(std::vector<std::string>{value}); }
    void operator()(const V2f& value) const { (*this)(std::vector<V2f>{value}); }
    void operator()(const V3f& value) const { (*this)(std::vector<V3f>{value}); }
    void operator()(const Rgb& value) const {
        set(ParamType::Rgb, std::vector<float>{value.x, value.y, value.z});
    }
    void operator()(const TextureName& value) const {
        set(ParamType::Texture, textureIndices(value.name, textures));
        param.strings = {value.name};
    }
    void operator()(const std::vector<int>& values) const { set(ParamType::Int, values); }
    void operator()(const std::vector<float>& values) const { set(ParamType::Float, values); }
    void operator()(const std::vector<V2f>& values) const {
        std::vector<float> floats;
        for (const V2f& v : values)
            floats.insert(floats.end(), {v.x, v.y});
        set(ParamType::Point2, std::move(floats));
    }
    void operator()(const std::vector<V3f>& values) const {
        std::vector<float> floats;
        for (const V3f& v : values)
            floats.insert(floats.end(), {v.x, v.y, v.z});
        set(ParamType::Vector3, std::move(floats));
    }
    void operator()(const std::vector<std::string>& values) const {
        param.type = ParamType::String;
        param.strings = values;
    }
};

Statement statementOf(const std::string& name, const PluginParams& params,
                      const std::vector<TextureDecl>& textures) {
    Statement statement{name, {}, {}};
    for (const PluginParam& from : params) {
        Param param{
            .name = from.name, .type = ParamType::Int, .where = {}, .floats = {}, .ints = {}, .strings = {}};
        std::visit(SetValue{param, textures}, from.value);
        statement.params.add(std::move(param));
    }
    return statement;
}

bool isFinite(const std::vector<std::vector<V3f>>& keys) {
    for (const auto& points : keys)
        for (const V3f& p : points)
            if (!std::isfinite(p.x + p.y + p.z))
                return false;
    return true;
}

void require(bool condition, const char* message) {
    if (!condition)
        throw Error(std::string("a mesh ") + message);
}

void checkMesh(const TriangleMesh& mesh) {
    const size_t vertices = mesh.vertexCount();
    require(vertices > 0 && !mesh.indices.empty() && mesh.indices.size() % 3 == 0,
            "has positions, and three indices per triangle");
    for (const auto& positions : mesh.positions)
        require(positions.size() == vertices, "has as many positions at each key");
    require(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size(),
            "has normals at each key, or none");
    for (const auto& normals : mesh.normals)
        require(normals.size() == vertices, "has as many normals as positions, or none");
    require(mesh.uvs.empty() || mesh.uvs.size() == vertices, "has as many uvs as positions, or none");
    require(mesh.tangents.empty() || mesh.tangents.size() == vertices,
            "has as many tangents as positions, or none");
    for (const uint32_t index : mesh.indices)
        require(index < vertices, "has indices of its positions");
    require(isFinite(mesh.positions) && isFinite(mesh.normals), "has finite positions and normals");
}

std::set<std::string> integratorNames(const PluginLibraries& libraries) {
    std::set<std::string> names;
    for (const auto& row : pluginTables(libraries).integrators)
        names.insert(row.name);
    return names;
}

} // namespace

PluginsPtr loadPlugins(const std::vector<std::filesystem::path>& files) {
    Diagnostics diagnostics;
    auto libraries = std::make_shared<const PluginLibraries>(loadPluginLibraries(files, {}, diagnostics));
    pluginTables(*libraries); // throws if names are taken
    return libraries;
}

SceneModel::SceneModel(PluginsPtr plugins)
    : m_description(std::make_unique<SceneDescription>()),
      m_plugins(plugins ? std::move(plugins) : std::make_shared<const PluginLibraries>()) {
    m_description->materials.push_back({"", {"matte", {}, {}}});
}

SceneModel SceneModel::load(const std::vector<std::filesystem::path>& files, PluginsPtr plugins,
                            const std::function<void(const std::string&)>& onWarning) {
    SceneModel scene(std::move(plugins));
    Diagnostics diagnostics(onWarning ? onWarning : [](const std::string&) {});
    *scene.m_description = parseFiles(files, integratorNames(*scene.m_plugins), diagnostics);
    return scene;
}

SceneModel::SceneModel(const SceneModel& other)
    : m_description(std::make_unique<SceneDescription>(deepCopy(*other.m_description))),
      m_plugins(other.m_plugins) {}
SceneModel::SceneModel(SceneModel&& other) noexcept = default;
SceneModel& SceneModel::operator=(SceneModel other) {
    m_description = std::move(other.m_description);
    m_plugins = std::move(other.m_plugins);
    return *this;
}
SceneModel::~SceneModel() = default;

SceneDescription SceneModel::release() && { return std::move(*m_description); }

void SceneModel::setCamera(const std::string& name, const PluginParams& params, const Placement& toWorld) {
    m_description->camera = statementOf(name, params, m_description->textures);
    m_description->cameraToWorld = transformOf(toWorld);
}
void SceneModel::setSampler(const std::string& name, const PluginParams& params) {
    m_description->sampler = statementOf(name, params, m_description->textures);
}
void SceneModel::setFilter(const std::string& name, const PluginParams& params) {
    m_description->filter = statementOf(name, params, m_description->textures);
}
void SceneModel::setShading(const std::string& name, const PluginParams& params) {
    m_description->shading = statementOf(name, params, m_description->textures);
}
void SceneModel::setIntegrator(const std::string& name, const PluginParams& params) {
    m_description->integrator = statementOf(name, params, m_description->textures);
}

void SceneModel::addTexture(const std::string& textureName, bool isFloat, const std::string& name,
                            const PluginParams& params, const Placement& toWorld) {
    m_description->textures.push_back(
        {textureName, isFloat, statementOf(name, params, m_description->textures), transformOf(toWorld)});
}

int SceneModel::addMaterial(const std::string& name, const PluginParams& params) {
    m_description->materials.push_back({"", statementOf(name, params, m_description->textures)});
    return int(m_description->materials.size()) - 1;
}

void SceneModel::addLight(const std::string& name, const PluginParams& params, const Placement& toWorld) {
    m_description->lights.push_back(
        {statementOf(name, params, m_description->textures), transformOf(toWorld)});
}

void SceneModel::checkMaterial(int material) const {
    if (material < 0 || material >= int(m_description->materials.size()))
        throw Error("there is no material " + std::to_string(material));
}

void SceneModel::addShape(const std::string& name, const PluginParams& params,
                          const ShapeSettings& settings) {
    checkMaterial(settings.material);
    ShapeDecl shape;
    shape.shape = statementOf(name, params, m_description->textures);
    shape.toParent = transformOf(settings.placement);
    shape.material = settings.material;
    shape.name = settings.name;
    if (settings.emission) {
        shape.areaLight = int(m_description->areaLights.size());
        m_description->areaLights.push_back(
            {statementOf("diffuse", *settings.emission, m_description->textures)});
    }
    m_description->world.shapes.push_back(std::move(shape));
}

void SceneModel::addMesh(TriangleMesh mesh, const ShapeSettings& settings) {
    checkMesh(mesh);
    mesh.keyTimes =
        mesh.deforms() ? timesOf(std::move(mesh.keyTimes), mesh.positions.size()) : std::vector<float>();
    addShape("trianglemesh", {}, settings);
    m_description->world.shapes.back().prebuilt = {std::make_shared<TriangleMesh>(std::move(mesh)), nullptr};
}

M44f lookAt(const V3f& eye, const V3f& target, const V3f& up) {
    const V3f z = normalize(target - eye), x = normalize(cross(normalize(up), z)), y = cross(z, x);
    if (!(length2(z) > 0 && length2(x) > 0))
        throw Error("lookAt: the eye is the target, or the up vector is parallel to the direction");
    return {x.x, x.y, x.z, 0, y.x, y.y, y.z, 0, z.x, z.y, z.z, 0, eye.x, eye.y, eye.z, 1};
}

} // namespace strobe
