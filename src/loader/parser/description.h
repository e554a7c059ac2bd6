// What a scene file says, before anything is built: plain data, in the order of the text.
#pragma once

#include "core/interfaces/material.h"
#include "core/interfaces/shape.h"
#include "core/math/transform.h"
#include "core/params/params.h"
#include "core/params/plugin.h"
#include "gltf/import.h"

#include <map>
#include <optional>

namespace strobe {

/// A directive with a plugin's name and its parameters.
struct Statement {
    std::string name;
    ParamSet params;
    Location where; ///< of the directive word
};

/// A glTF file that is part of the scene, read but not yet built: what it becomes depends on the shutter.
struct GltfDecl {
    std::shared_ptr<const gltf::Document> document;
    gltf::Settings settings;
    KeyedTransform toParent; ///< to world, or to its object's space
    int object = -1;         ///< index into SceneDescription::objects; -1: the world
    Location where;
};

struct TextureDecl {
    std::string name;
    bool isFloat = false; ///< else rgb
    Statement texture;    ///< refers only to textures declared before it
    KeyedTransform toWorld;
    std::shared_ptr<const Texture> made{}; ///< in place of the statement, when it is there
};

struct MaterialDecl {
    std::string name; ///< empty unless made by MakeNamedMaterial
    Statement material;
    std::shared_ptr<const Material> made{}; ///< in place of the statement, when it is there
};

struct AreaLightDecl {
    Statement light;
    int group = 0; ///< see groupOf
};

struct ShapeDecl {
    Statement shape;
    KeyedTransform toParent; ///< to world, or to its object's space
    int material = 0;        ///< index into SceneDescription::materials
    int areaLight = -1;      ///< index into SceneDescription::areaLights, or none
    bool reverseOrientation = false;
    std::string name{};     ///< empty: see ObjectNames
    Shape made{};           ///< in place of the statement, when it is there
    bool isPassing = false; ///< there for one frame alone
};

struct InstanceDecl {
    int object = 0; ///< index into SceneDescription::objects
    TransformChain toParent;
    Location where;
    std::string name{}; ///< empty: that of its object, and a number
};

/// ObjectBegin … ObjectEnd, and the world itself.
struct ObjectDecl {
    std::string name;
    Location where;
    std::vector<ShapeDecl> shapes;
    std::vector<InstanceDecl> instances;
};

struct LightDecl {
    Statement light;
    KeyedTransform toWorld;
    int group = 0; ///< see groupOf
};

struct SceneDescription {
    Conventions conventions = Conventions::PbrtV4;
    bool strictParameters = true; ///< .scene: an unread parameter is an error; .pbrt: a warning
    std::vector<float> keyTimes{0, 1};

    std::vector<std::shared_ptr<const Source>> sources; ///< all texts that it was read from, in order

    // Absent directives keep the default plugin with no parameters (the builder knows which).
    std::optional<Statement> camera, film, sampler, filter;
    std::optional<Statement>
        shading; ///< SurfaceIntegrator / Integrator naming a way to shade: directlighting, path
    std::optional<Statement> integrator; ///< Integrator naming a way to share: supersample, msaa, …
    KeyedTransform cameraToWorld;

    std::vector<TextureDecl> textures;
    std::vector<MaterialDecl> materials; ///< [0] is the default material
    std::vector<AreaLightDecl> areaLights;
    std::vector<LightDecl> lights;
    std::vector<ObjectDecl> objects;
    ObjectDecl world;
    ObjectDecl frame; ///< more of the world: what is there for one frame alone; shapes only
    std::vector<GltfDecl> gltfs;
};

} // namespace strobe
