// Cells of several sizes, their neighbors, and local linear fits of their light.
#pragma once

#include "core/util/index_table.h"
#include "sharing/light_cells.h"

#include <span>

namespace strobe {

/// The number of sizes of fits: each is twice as large as the one before.
inline constexpr int kFitScales = 2;

/// The light of all parts and both halves as linear functions of the position and the normal on a surface.
struct LightFit {
    /// The value at the node, and the derivatives by two tangents of the position (per radius of the fit) and
    /// of the normal.
    static constexpr int kTerms = 5;
    static constexpr int kChannels = 3 * kHalves * kParts; ///< RGB by half by part
    float terms[kTerms][kChannels];
};

/// A cell of any size with the mean position, the mean normal and the light of all its samples.
struct CellNode {
    V3f p{0}, n{0};                        ///< world space at shutter fraction 0; n is a unit vector
    float count[kHalves] = {};             ///< samples
    float light[LightFit::kChannels] = {}; ///< mean, in the order of LightFit
    uint32_t cube = 0;                     ///< index of its cube
    uint32_t parent = 0;                   ///< index of the node in the cube of twice the size
    bool isFitted = false;
};

/// The recorded cells, and the larger cells that contain them.
class CellPyramid {
  public:
    /// `cells`: by ascending id, so that sums of floats do not depend on the order of rendering.
    explicit CellPyramid(std::span<const CellSums> cells);

    /// The estimates of the light at a recorded cell from each half: the mean of its samples, then the fits
    /// by scale.
    struct Estimates {
        float light[1 + kFitScales][LightFit::kChannels]; ///< in the order of LightFit
        /// `estimate`: 0 for the mean, then the fits by scale.
        Rgb at(int estimate, LightPart part, int half) const {
            const float* rgb = &light[estimate][3 * (kHalves * int(part) + half)];
            return {rgb[0], rgb[1], rgb[2]};
        }
    };
    /// Returns the width of the region of a fit in edges of recorded cells.
    static float fitWidth(int scale) { return 2 * kFitRadius * float(2 << scale); }
    /// Returns the estimates of a recorded cell, by its index.
    const Estimates& estimates(uint32_t cell) const { return m_estimates[cell]; }

  private:
    static constexpr uint32_t kAbsent = ~0u;
    static constexpr int kFaces = CellId::kFaces;
    /// Fits use the nodes within kReach cells. These are found below the cubes that are 2^kGenerations times
    /// as large.
    static constexpr int kReach = 2, kGenerations = 2;
    static constexpr float kFitRadius = 2; ///< of a fit, in edges of its cells
    /// All nodes of one cube: they differ in CellId::face.
    struct Cube {
        CellId id; ///< face 0
        uint32_t nodes[kFaces];
        uint32_t parent = kAbsent;
        uint32_t children[8];
    };

    void addWithAncestors(const CellSums& sums);
    uint32_t findOrAddCube(CellId id);
    uint32_t findOrAddNode(uint32_t cube, int face);
    uint32_t parentOf(uint32_t cube);
    void linkCubes();
    void finishMeans();
    LightFit fitNode(const CellNode& node) const;
    Estimates estimate(uint32_t node, const std::vector<LightFit>& fits) const;
    template <class Work>
    void forNeighbors(const CellId& id, const Work& work) const;
    template <class Work>
    void forDescendants(const Cube& cube, const CellId& center, int generations, const Work& work) const;

    std::vector<CellNode> m_nodes;
    std::vector<Cube> m_cubes;
    IndexTable m_cubeIndices;           ///< by CellId::hash
    std::vector<uint32_t> m_recorded;   ///< nodes of the recorded cells
    std::vector<Estimates> m_estimates; ///< of the recorded cells
};

} // namespace strobe
