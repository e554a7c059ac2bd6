#include "loader/build/shape_store.h"

#include "core/util/parallel.h"

namespace strobe {
namespace {

/// Applies a static transform to the vertices. Returns true if it reverses the mesh's orientation.
bool bake(TriangleMesh& mesh, const M44f& m) {
    if (m == M44f())
        return false;
    const M44f inverse = m.inverse();
    for (auto& key : mesh.positions)
        for (V3f& p : key)
            p = transformPoint(m, p);
    for (auto& key : mesh.normals)
        for (V3f& n : key)
            n = transformNormal(inverse, n);
    for (V3f& t : mesh.tangents)
        t = transformVector(m, t);
    // A mirroring transform reverses the winding; transformed vertex normals keep their side.
    const bool mirrors = determinant3(m) < 0;
    using Side = TriangleMesh::Side;
    if (mirrors && mesh.culledSide != Side::None)
        mesh.culledSide = mesh.culledSide == Side::Back ? Side::Front : Side::Back;
    return mirrors && mesh.normals.empty();
}

} // namespace

void ShapeStore::create(std::vector<ShapeDecl>& decls, Diagnostics& diagnostics) {
    struct Result {
        Shape shape;
        Diagnostics diagnostics = Diagnostics::recorder();
        std::exception_ptr error;
    };
    std::vector<ShapeDecl*> missing;
    for (ShapeDecl& decl : decls)
        if (!m_entries.contains(&decl))
            missing.push_back(&decl);
    std::vector<Result> results(missing.size());
    parallelFor(missing.size(), [&](size_t i) {
        try {
            results[i].shape = m_create(*missing[i], results[i].diagnostics);
        } catch (...) {
            results[i].error = std::current_exception();
        }
    });
    for (size_t i = 0; i < missing.size(); ++i) {
        results[i].diagnostics.replayTo(diagnostics);
        if (results[i].error)
            std::rethrow_exception(results[i].error);
        m_entries[missing[i]] = {std::move(results[i].shape)};
    }
}

ShapeStore::Entry& ShapeStore::take(const ShapeDecl& decl) {
    Entry& entry = m_entries.at(&decl);
    if (m_keep && !decl.isPerFrame)
        return entry;
    m_taken = std::move(entry);
    m_entries.erase(&decl);
    return m_taken;
}

PlacedShape ShapeStore::inParentSpace(const ShapeDecl& decl, float time) {
    const M44f m = decl.toParent.at(time);
    Entry& stored = take(decl);
    if (!stored.shape.mesh)
        return {stored.shape, m, nullptr, decl.reverseOrientation};
    Entry baked = stored;
    if (!baked.isBaked) {
        // An animated transform differs in other frames, so that the stored mesh stays in object space.
        const bool bakeInPlace = !m_keep || decl.isPerFrame || decl.toParent.isStatic();
        if (!bakeInPlace)
            baked.shape.mesh = std::make_shared<TriangleMesh>(*baked.shape.mesh);
        baked.isMirrored = bake(*baked.shape.mesh, m);
        baked.isBaked = true;
        if (bakeInPlace)
            stored = baked;
    }
    return {baked.shape, M44f(), nullptr, decl.reverseOrientation != baked.isMirrored};
}

} // namespace strobe
