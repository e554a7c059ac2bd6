#include "lattice/lattice_soa.h"

#include "lattice/lattice_division.h"

namespace strobe {

namespace {

STROBE_TARGET_CLONES bool divideTriangleSoA(LatticeHitSoA& hits, float blockSizeInPixels, bool sharesSmall) {
    const int n = hits.count;
    int32_t anySmall = 0;
    STROBE_IVDEP
    for (int k = 0; k < n; ++k) {
        hits.blockSize[k] = blockSizeInPixels * (hits.cone.width[k] + hits.hit.t[k] * hits.cone.spread[k]);
        const DividedTriangle r = divideTriangle(hits.a.at(k), hits.b.at(k), hits.d.at(k), hits.hit.u[k],
                                                 hits.hit.v[k], hits.blockSize[k]);
        const bool isSmall = sharesSmall & r.isSmall;
        hits.isFront[k] = r.facing < 0;
        hits.kind[k] = isSmall ? LatticeCell::Vertices : r.isUpper ? LatticeCell::Upper : LatticeCell::Lower;
        hits.i[k] = isSmall ? 0 : r.position.i;
        hits.j[k] = isSmall ? 0 : r.position.j;
        hits.nu[k] = isSmall ? 0 : r.position.nu;
        hits.nv[k] = isSmall ? 0 : r.position.nv;
        const float u = std::max(hits.hit.u[k], 0.f), v = std::max(hits.hit.v[k], 0.f);
        const float x = isSmall ? u : r.isUpper ? 1 - r.position.y : r.position.x;
        const float y = isSmall ? v : r.isUpper ? 1 - r.position.x : r.position.y;
        hits.coords.x[k] = x;
        hits.coords.y[k] = y;
        hits.coords.z[k] = firstWeight(x, y);
        hits.normal2[k] = r.normal2;
        anySmall |= isSmall;
    }
    return anySmall;
}

STROBE_TARGET_CLONES void computeCellKeys(LatticeHitSoA& hits) {
    const int n = hits.count;
    STROBE_IVDEP
    for (int k = 0; k < n; ++k) {
        const uint64_t item = latticeKeyItem(0, kCellKey + uint64_t(uint32_t(hits.kind[k])), hits.isFront[k]);
        hits.key[k] = mix64(appendFastHash<1>(hits.keySum[k], item, latticeFloatBits(hits.i[k], hits.j[k]),
                                              latticeFloatBits(hits.nu[k], hits.nv[k])));
    }
}

/// Computes point number k of the first n cells.
STROBE_TARGET_CLONES void computeCellPoints(const TriangleCellSoA& cells, int n, int k,
                                            TriangleCellSoA::Points& points) {
    const float isFirst = k == 0, isSecond = k == 1, isThird = k == 2;
    STROBE_IVDEP
    for (int c = 0; c < n; ++c) {
        const float upper = float(cells.isUpper[c]) * isFirst, nu = cells.nu[c], nv = cells.nv[c];
        const float x = (cells.i[c] + isSecond + upper) / nu, y = (cells.j[c] + isThird + upper) / nv;
        // Where nu and nv differ, a cell may reach beyond the triangle's third edge. Its points there are
        // moved along the axis with fewer cells onto the edge, where they are points of the finer division.
        const float limit = x + y > 1 ? 1.f : kInfinity;
        const float u = nu < nv ? std::min(x, limit - y) : x, v = nu < nv ? y : std::min(y, limit - x);
        const int thirdCorner = v == 1 ? 2 : -1, firstCorner = u == 0 ? 0 : -1;
        points.u[c] = u;
        points.v[c] = v;
        points.corner[c] = u == 1 ? 1 : v == 0 ? firstCorner : thirdCorner;
        points.keySum[c] = appendFastHash<1>(
            cells.keySum[c], latticeKeyItem(0, kSurfaceKey, cells.isFront[c]), latticeFloatBits(u, v));
    }
}

STROBE_TARGET_CLONES void computePointKeys(const TriangleCellSoA::Points& points, const uint32_t* firstBin,
                                           int n, uint64_t* keys) {
    STROBE_IVDEP
    for (int c = 0; c < n; ++c)
        keys[c] = mix64(appendFastHash<3>(points.keySum[c], firstBin[c]));
}

STROBE_TARGET_CLONES void findTimeBinSoA(const float* time, int n, int bins, uint32_t* bin) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        bin[i] = uint32_t(std::min(int(time[i] * float(bins)), bins - 1));
}

} // namespace

void findTimeBins(const float* time, int n, int bins, uint32_t* bin) { findTimeBinSoA(time, n, bins, bin); }

void TriangleCellSoA::push_back(const LatticeHitSoA& hits, int h) {
    hit[count] = h;
    i[count] = hits.i[h];
    j[count] = hits.j[h];
    nu[count] = hits.nu[h];
    nv[count] = hits.nv[h];
    isUpper[count] = hits.kind[h] == LatticeCell::Upper;
    isFront[count] = hits.isFront[h];
    keySum[count] = hits.keySum[h];
    for (Points& p : points)
        p.prim[count] = hits.hit.prim[h];
    ++count;
}

void TriangleCellSoA::computePoints(int pointsPerCell) {
    // 16 cells take about as long as one. The results beyond `count` are not used.
    constexpr int kTogether = 16;
    static_assert(kSoAWidth % kTogether == 0);
    for (int k = 0; k < pointsPerCell; ++k)
        computeCellPoints(*this, (count + kTogether - 1) / kTogether * kTogether, k, points[k]);
}

void TriangleCellSoA::computeKeys(int k, const uint32_t* firstBin, uint64_t* keys) const {
    computePointKeys(points[k], firstBin, count, keys);
}

void LatticeHitSoA::push_back(const Hit& newHit, const V3f& direction, float newTime,
                              const RayCone& pixelCone) {
    hit.set(count, newHit);
    d.set(count, direction);
    time[count] = newTime;
    cone.set(count, pixelCone);
    ++count;
}

bool LatticeHitSoA::divideTriangles(float blockSizeInPixels, bool sharesSmall) {
    return divideTriangleSoA(*this, blockSizeInPixels, sharesSmall);
}

void LatticeHitSoA::computeKeys() { computeCellKeys(*this); }

void LatticeHitSoA::divideQuadric(int h) {
    const V3f dpdu = a.at(h), dpdv = b.at(h), direction = d.at(h);
    const float size = blockSize[h];
    const float u2 = projectedLength2(dpdu, direction), v2 = projectedLength2(dpdv, direction);
    const float sine2 = clampedSine2(u2, v2, sqr(dot(cross(dpdu, dpdv), direction)));
    const float perBlock2 = 1 / sqr(size), uInBlocks = length(dpdu) / size, vInBlocks = length(dpdv) / size;
    // The projected lengths hold at the hit only: an edge-on surface turns towards the viewer within the
    // cell. So the division also bounds how far the sides of a cell bow, and how far two opposite sides turn
    // apart: by half a block each. u and v go around the quadric at most once.
    constexpr float kFullTurn = 2 * kPi;
    const int divisionV =
        std::max(divisionFor(sqr(v2 * perBlock2) * sine2), divisionAbove(kFullTurn * vInBlocks));
    const float apart = 2 * kFullTurn * std::ldexp(vInBlocks, -divisionV);
    const int divisionU = std::max({divisionFor(sqr(u2 * perBlock2) * sine2),
                                    divisionAbove(kFullTurn * uInBlocks), divisionAbove(sqr(apart))});
    const GridPosition p = gridPosition(hit.u[h], hit.v[h], segmentCount(divisionU), segmentCount(divisionV));
    isFront[h] = seesQuadricFront[h];
    kind[h] = LatticeCell::Rectangle;
    i[h] = p.i;
    j[h] = p.j;
    nu[h] = p.nu;
    nv[h] = p.nv;
    coords.set(h, {p.x, p.y, 0});
}

} // namespace strobe
