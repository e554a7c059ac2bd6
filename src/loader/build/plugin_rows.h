// The plugins that a library outside of strobe adds.
#pragma once

#include "core/interfaces/camera.h"
#include "core/interfaces/filter.h"
#include "core/interfaces/light.h"
#include "core/interfaces/material.h"
#include "core/interfaces/sampler.h"
#include "core/interfaces/shape.h"
#include "core/interfaces/texture.h"
#include "core/render/integrator.h"
#include "core/render/shader.h"

namespace strobe {

using CameraPlugin = Plugin<std::shared_ptr<const Camera>, const CameraArgs&>;
using FilterPlugin = Plugin<std::shared_ptr<const Filter>>;
using LightPlugin = Plugin<std::shared_ptr<Light>, const LightArgs&>;
using AreaLightPlugin = Plugin<std::shared_ptr<Light>, const AreaLightArgs&>;
using MaterialPlugin = Plugin<std::shared_ptr<const Material>>;
using SamplerPlugin = Plugin<SamplerSetup, int>;
using ShapePlugin = Plugin<Shape>;
using TexturePlugin = Plugin<TexturePtr, const TextureArgs&>;

/// Rows of plugin tables, by kind.
struct PluginRows {
    std::vector<ShapePlugin> shapes;
    std::vector<MaterialPlugin> materials;
    std::vector<TexturePlugin> textures;
    std::vector<LightPlugin> lights;
    std::vector<AreaLightPlugin> areaLights;
    std::vector<CameraPlugin> cameras;
    std::vector<SamplerPlugin> samplers;
    std::vector<FilterPlugin> filters;
    std::vector<ShaderPlugin> shaders;
    std::vector<IntegratorPlugin> integrators;

    void add(ShapePlugin row) { shapes.push_back(std::move(row)); }
    void add(MaterialPlugin row) { materials.push_back(std::move(row)); }
    void add(TexturePlugin row) { textures.push_back(std::move(row)); }
    void add(LightPlugin row) { lights.push_back(std::move(row)); }
    void add(AreaLightPlugin row) { areaLights.push_back(std::move(row)); }
    void add(CameraPlugin row) { cameras.push_back(std::move(row)); }
    void add(SamplerPlugin row) { samplers.push_back(std::move(row)); }
    void add(FilterPlugin row) { filters.push_back(std::move(row)); }
    void add(ShaderPlugin row) { shaders.push_back(std::move(row)); }
    void add(IntegratorPlugin row) { integrators.push_back(std::move(row)); }

    /// Calls f(kind, rows, rowsOfOther) for the rows of each kind here and in `other`, with the kind's noun.
    template <class Other, class F>
    void forEachKind(Other& other, const F& f) {
        forEachKind(*this, other, f);
    }
    template <class Other, class F>
    void forEachKind(Other& other, const F& f) const {
        forEachKind(*this, other, f);
    }

  private:
    template <class Self, class Other, class F>
    static void forEachKind(Self& self, Other& other, const F& f) {
        f("shape", self.shapes, other.shapes);
        f("material", self.materials, other.materials);
        f("texture", self.textures, other.textures);
        f("light", self.lights, other.lights);
        f("area light", self.areaLights, other.areaLights);
        f("camera", self.cameras, other.cameras);
        f("sampler", self.samplers, other.samplers);
        f("pixel filter", self.filters, other.filters);
        f("shading integrator", self.shaders, other.shaders);
        f("integrator", self.integrators, other.integrators);
    }
};

} // namespace strobe
