// Places shapes: bakes what rests, makes instances of what moves or repeats, fits motion to the shutter.
#pragma once

#include "core/render/integrator.h"
#include "loader/build/plugin_tables.h"
#include "loader/parser/description.h"

#include <unordered_map>

namespace strobe {

struct BuiltGeometry {
    std::vector<Group> groups; ///< [0]: the world's own
    std::vector<Instance> instances;
    std::vector<std::shared_ptr<const Light>> areaLights; ///< Geometry::light counts from `firstLight`
};

/// The shapes of a description; if `keep`, kept for the frames to come; else a shape may be asked for once.
/// What is given out is not to be changed.
class ShapeStore {
  public:
    /// Makes a shape from its declaration; an empty Shape where it is skipped. Called by several threads.
    using Make = std::function<Shape(ShapeDecl&, Diagnostics&)>;
    ShapeStore(Make make, bool keep) : m_make(std::move(make)), m_keep(keep) {}

    /// Makes those of the shapes that are not there yet, side by side: before they are asked for. Warnings,
    /// and the one error thrown, are those of making them in order.
    void make(std::vector<ShapeDecl>& decls, Diagnostics& messages);
    /// In its object space.
    Shape moving(const ShapeDecl& decl) { return take(decl).shape; }
    /// At rest where its transform is at scene time `time`: a mesh's vertices are there.
    PlacedShape resting(const ShapeDecl& decl, float time);

  private:
    struct Entry {
        Shape shape;
        bool isBaked = false;    ///< the mesh's vertices are where a still transform puts them
        bool isMirrored = false; ///< and that turned its orientation round
    };
    Entry& take(const ShapeDecl& decl);

    Make m_make;
    bool m_keep;
    Entry m_passing; ///< the entry last taken from a store that does not keep
    std::unordered_map<const ShapeDecl*, Entry> m_entries;
};

/// Makes the area light of a declaration on a placed shape.
using MakeAreaLight = std::function<std::shared_ptr<const Light>(const AreaLightDecl&, const PlacedShape&)>;

/// The geometry of a frame. `description` is only read.
BuiltGeometry buildGeometry(SceneDescription& description, const Camera& camera, const Shutter& shutter,
                            int firstLight, ShapeStore& shapes, const MakeAreaLight& makeAreaLight,
                            Diagnostics& messages);

} // namespace strobe
