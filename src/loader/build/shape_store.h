// The shapes of a description: created once each, in parallel, and reused by the frames of a sequence.
#pragma once

#include "core/interfaces/geometry.h"
#include "core/util/diagnostics.h"
#include "loader/parser/description.h"

#include <functional>
#include <unordered_map>

namespace strobe {

/// The shapes of a description, by declaration. The vertices of returned shapes must not change: frames share
/// them.
class ShapeStore {
  public:
    /// Creates a shape from its declaration; returns an empty Shape if the declaration is skipped. Called by
    /// several threads at once.
    using Create = std::function<Shape(ShapeDecl&, Diagnostics&)>;
    /// `keep`: keep shapes for later frames. If false, and for declarations of a single frame
    /// (ShapeDecl::isPerFrame), each shape can be retrieved once.
    ShapeStore(Create create, bool keep) : m_create(std::move(create)), m_keep(keep) {}

    /// Creates the shapes of `decls` that are not stored yet, in parallel. Must precede their retrieval.
    /// Warnings appear, and the first error is thrown, as if the shapes were created in order.
    void create(std::vector<ShapeDecl>& decls, Diagnostics& diagnostics);
    /// Returns the shape in object space.
    Shape inObjectSpace(const ShapeDecl& decl) { return take(decl).shape; }
    /// Returns the shape in the space of its parent, with the transform at scene time `time`. The vertices of
    /// a mesh are transformed; a quadric keeps the transform as PlacedShape::toParent.
    PlacedShape inParentSpace(const ShapeDecl& decl, float time);

  private:
    struct Entry {
        Shape shape;
        bool isBaked = false;    ///< the vertices of the mesh are in the parent's space
        bool isMirrored = false; ///< baking reversed the orientation
    };
    /// Returns the entry of `decl`. An entry that is not kept moves to m_taken.
    Entry& take(const ShapeDecl& decl);

    Create m_create;
    bool m_keep;
    Entry m_taken; ///< the last entry that was removed from m_entries
    std::unordered_map<const ShapeDecl*, Entry> m_entries;
};

} // namespace strobe
