// Scenes that a program loads or builds.
#pragma once

#include "core/interfaces/shape.h"
#include "core/math/api.h"
#include "core/math/transform.h"

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace STROBE_API strobe {

struct PluginLibrary;
struct SceneDescription;

/// Libraries of plugins outside of strobe, which stay loaded until the process ends; null: none.
using PluginsPtr = std::shared_ptr<const std::vector<PluginLibrary>>;
/// Loads libraries made with STROBE_PLUGIN_LIBRARY (strobe/plugin.h). Throws Error if one cannot be loaded.
PluginsPtr loadPlugins(const std::vector<std::filesystem::path>& files);

/// The name of a texture of the scene, as the value of a parameter.
struct TextureName {
    std::string name;
};

/// A parameter of a plugin: `{"fov", 40.0}` is `"float fov" 40` in a scene file. Names, types and defaults:
/// docs/reference.md.
struct PluginParam {
    using Value =
        std::variant<bool, int, float, std::string, V2f, V3f, Rgb, TextureName, std::vector<int>,
                     std::vector<float>, std::vector<V2f>, std::vector<V3f>, std::vector<std::string>>;
    std::string name;
    Value value;

    PluginParam(std::string n, Value v) : name(std::move(n)), value(std::move(v)) {}
    PluginParam(std::string n, bool v) : PluginParam(std::move(n), Value(v)) {}
    PluginParam(std::string n, int v) : PluginParam(std::move(n), Value(v)) {}
    PluginParam(std::string n, double v) : PluginParam(std::move(n), Value(float(v))) {}
    PluginParam(std::string n, const char* v) : PluginParam(std::move(n), Value(std::string(v))) {}
};
using PluginParams = std::vector<PluginParam>;

/// Transformations to world space at times of the scene; constant before the first and after the last.
/// Vectors are rows: M44f has its translation in the last row.
struct Placement {
    std::vector<M44f> matrices{M44f()};
    std::vector<float> times{}; ///< ascending; empty: evenly from 0 to 1

    Placement() = default;
    Placement(const M44f& matrix) : matrices{matrix} {} // NOLINT: implicit
    Placement(std::vector<M44f> keys, std::vector<float> t = {})
        : matrices(std::move(keys)), times(std::move(t)) {}
};

/// The material, the placement, the emission and the name of a shape.
struct ShapeSettings {
    int material = 0; ///< of SceneModel::addMaterial; 0: the default, a gray matte
    Placement placement{};
    std::optional<PluginParams>
        emission{};     ///< parameters of the area light "diffuse"; none: it does not emit
    std::string name{}; ///< in object ids and Cryptomatte
};

/// The content of a scene, from files, from the program, or both. Scene times are those of the shutter: 0 to
/// 1 unless the camera says otherwise. Copies are independent. Errors are those of scene files, without a
/// location for what a program has added.
class SceneModel {
  public:
    /// Makes an empty scene. `plugins`: may be used besides those of strobe.
    explicit SceneModel(PluginsPtr plugins = {});
    /// Reads files of the scene language, of pbrt or glTF, as if they were one. `onWarning` receives texts.
    /// Throws Error.
    static SceneModel load(const std::vector<std::filesystem::path>& files, PluginsPtr plugins = {},
                           const std::function<void(const std::string&)>& onWarning = {});
    SceneModel(const SceneModel& other);
    SceneModel(SceneModel&& other) noexcept;
    SceneModel& operator=(SceneModel other);
    ~SceneModel();

    // Replace what the scene has. Names are those of plugins.
    void setCamera(const std::string& name, const PluginParams& params, const Placement& toWorld);
    void setSampler(const std::string& name, const PluginParams& params = {});
    void setFilter(const std::string& name, const PluginParams& params = {});
    void setShading(const std::string& name, const PluginParams& params = {});
    void setIntegrator(const std::string& name, const PluginParams& params = {});

    /// Adds a texture of colors, or of numbers if `isFloat`, which materials refer to by TextureName.
    void addTexture(const std::string& textureName, bool isFloat, const std::string& name,
                    const PluginParams& params, const Placement& toWorld = {});
    /// Returns the index for ShapeSettings::material.
    int addMaterial(const std::string& name, const PluginParams& params = {});
    void addLight(const std::string& name, const PluginParams& params, const Placement& toWorld = {});
    /// Adds a shape plugin.
    void addShape(const std::string& name, const PluginParams& params, const ShapeSettings& settings = {});
    /// Adds a mesh. Throws Error if its arrays do not fit together or have numbers that are not finite.
    void addMesh(TriangleMesh mesh, const ShapeSettings& settings = {});

    /// Returns the content, for renderPicture.
    SceneDescription release() &&;
    const PluginsPtr& plugins() const { return m_plugins; }

  private:
    void checkMaterial(int material) const;

    std::unique_ptr<SceneDescription> m_description;
    PluginsPtr m_plugins; ///< not null
};

/// Returns the transformation from the space of a camera at `eye`, which looks at `target`, to world space.
M44f lookAt(const V3f& eye, const V3f& target, const V3f& up);

} // namespace strobe
