// SceneDescription: the content of scene files before plugins are created, as plain data in the order of the
// text.
#pragma once

#include "core/interfaces/material.h"
#include "core/interfaces/shape.h"
#include "core/math/api.h"
#include "core/math/transform.h"
#include "core/params/params.h"
#include "core/params/plugin.h"
#include "gltf/import.h"

#include <map>
#include <optional>

namespace STROBE_API strobe {

/// A directive with the name of a plugin and its parameters.
struct Statement {
    std::string name;
    ParamSet params;
    Location where; ///< of the directive
};

/// A glTF file of the scene. It is read but not built, since its content depends on the shutter.
struct GltfDecl {
    std::shared_ptr<const gltf::Document> document;
    gltf::Settings settings;
    KeyedTransform toParent; ///< to world, or to the space of its object
    int object = -1;         ///< index into SceneDescription::objects; -1: the world
    Location where;
};

// Declarations of textures, materials and shapes that glTF files add hold the finished plugin in `prebuilt`;
// the statement is unused then.

struct TextureDecl {
    std::string name;
    bool isFloat = false; ///< else rgb
    Statement texture;    ///< refers only to textures declared before it
    KeyedTransform toWorld;
    std::shared_ptr<const Texture> prebuilt{};
};

struct MaterialDecl {
    std::string name; ///< empty unless declared by MakeNamedMaterial
    Statement material;
    std::shared_ptr<const Material> prebuilt{};
};

/// A homogeneous medium: coefficients per unit length of world space, the scattering coefficient reduced by
/// the phase function.
struct MediumDecl {
    Rgb absorption{0}, scattering{0};
};

struct AreaLightDecl {
    Statement light;
    int group = 0; ///< index of the light group; see lightGroupIndex
};

struct ShapeDecl {
    Statement shape;
    KeyedTransform toParent; ///< to world, or to the space of its object
    int material = 0;        ///< index into SceneDescription::materials
    int areaLight = -1;      ///< index into SceneDescription::areaLights; -1: none
    bool reverseOrientation = false;
    std::string name{}; ///< empty: see ObjectNames
    Shape prebuilt{};
    bool isPerFrame = false;                   ///< exists for one frame of a sequence
    int insideMedium = -1, outsideMedium = -1; ///< indices into SceneDescription::media; -1: vacuum
};

struct InstanceDecl {
    int object = 0; ///< index into SceneDescription::objects
    TransformChain toParent;
    Location where;
    std::string name{}; ///< empty: the name of its object and a number
};

/// The content between ObjectBegin and ObjectEnd, or the content of the world.
struct ObjectDecl {
    std::string name;
    Location where;
    std::vector<ShapeDecl> shapes;
    std::vector<InstanceDecl> instances;
};

struct LightDecl {
    Statement light;
    KeyedTransform toWorld;
    int group = 0; ///< index of the light group; see lightGroupIndex
};

struct SceneDescription {
    Conventions conventions = Conventions::PbrtV4;
    int pbrtVersion = 4;          ///< of a .pbrt file; 4 for .scene files with the conventions of v4
    bool strictParameters = true; ///< unread parameters are errors (.scene), else warnings (.pbrt)
    std::vector<float> keyTimes{0, 1};

    std::vector<std::shared_ptr<const Source>> sources; ///< all texts of the scene, in order
    std::map<std::string, std::string> values; ///< that the texts name as $NAME, or declare by Default

    // Absent directives: the builder uses its default plugin without parameters.
    std::optional<Statement> camera, film, sampler, filter;
    std::optional<Statement> shading; ///< Integrator or SurfaceIntegrator with the name of a shader: path, …
    std::optional<Statement> integrator; ///< Integrator with the name of a sharing integrator: supersample, …
    KeyedTransform cameraToWorld;

    std::vector<TextureDecl> textures;
    std::vector<MaterialDecl> materials; ///< [0] is the default material
    std::vector<MediumDecl> media;
    std::vector<AreaLightDecl> areaLights;
    std::vector<LightDecl> lights;
    std::vector<ObjectDecl> objects;
    ObjectDecl world;
    std::vector<ShapeDecl> frameShapes; ///< shapes of the world that exist for the current frame only
    std::vector<GltfDecl> gltfs;
};

} // namespace strobe
