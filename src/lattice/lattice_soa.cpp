#include "lattice/lattice_soa.h"

#include "core/math/hash.h"
#include "lattice/lattice_division.h"

namespace strobe {

namespace {

STROBE_TARGET_CLONES bool divideTriangleSoA(LatticeSoA& l, float blockSize, bool sharesSmall) {
    const int n = l.count;
    int32_t anySmall = 0;
    STROBE_IVDEP
    for (int k = 0; k < n; ++k) {
        l.block[k] = blockSize * (l.width[k] + l.hit.t[k] * l.spread[k]);
        const DividedTriangle r =
            divideTriangle(l.a.at(k), l.b.at(k), l.d.at(k), l.hit.u[k], l.hit.v[k], l.block[k]);
        const bool small = sharesSmall & r.small;
        l.positive[k] = r.facing < 0;
        l.kind[k] = small ? LatticeCell::Vertices : r.upper ? LatticeCell::Upper : LatticeCell::Lower;
        l.i[k] = small ? 0 : r.at.i, l.j[k] = small ? 0 : r.at.j;
        l.nu[k] = small ? 0 : r.at.nu, l.nv[k] = small ? 0 : r.at.nv;
        const float u = std::max(l.hit.u[k], 0.f), v = std::max(l.hit.v[k], 0.f);
        const float x = small ? u : r.upper ? 1 - r.at.y : r.at.x;
        const float y = small ? v : r.upper ? 1 - r.at.x : r.at.y;
        l.place.x[k] = x, l.place.y[k] = y, l.place.z[k] = firstWeight(x, y);
        l.normal2[k] = r.normal2;
        anySmall |= small;
    }
    return anySmall;
}

STROBE_TARGET_CLONES void mixKeySoA(LatticeSoA& l) {
    const int n = l.count;
    STROBE_IVDEP
    for (int k = 0; k < n; ++k) {
        const uint64_t item = latticeItem(0, kCellKey + uint64_t(uint32_t(l.kind[k])), l.positive[k]);
        l.key[k] = mix64(quickSum<1>(l.keySum[k], item, latticeFloatBits(l.i[k], l.j[k]),
                                     latticeFloatBits(l.nu[k], l.nv[k])));
    }
}

STROBE_TARGET_CLONES void findPoints(const TrianglePointSoA& l, int n, int k, TrianglePointSoA::Points& p) {
    // The first point of an upper cell is the corner across from that of a lower one.
    const float ofUpper = k == 0, alongU = k == 1, alongV = k == 2;
    STROBE_IVDEP
    for (int c = 0; c < n; ++c) {
        const float upper = float(l.isUpper[c]) * ofUpper, nu = l.nu[c], nv = l.nv[c];
        const float x = (l.i[c] + alongU + upper) / nu, y = (l.j[c] + alongV + upper) / nv;
        // Beyond the third edge, where divisions differ, the finer one's points on it stand in.
        const float most = x + y > 1 ? 1.f : kInfinity;
        const float u = nu < nv ? std::min(x, most - y) : x, v = nu < nv ? y : std::min(y, most - x);
        const int onV = v == 1 ? 2 : -1, onU = u == 0 ? 0 : -1;
        p.u[c] = u, p.v[c] = v;
        p.corner[c] = u == 1 ? 1 : v == 0 ? onU : onV;
        p.keySum[c] =
            quickSum<1>(l.keySum[c], latticeItem(0, kSurfaceKey, l.positive[c]), latticeFloatBits(u, v));
    }
}

STROBE_TARGET_CLONES void mixPointKeys(const TrianglePointSoA::Points& points, const uint32_t* firstBin,
                                       int n, uint64_t* keys) {
    STROBE_IVDEP
    for (int c = 0; c < n; ++c)
        keys[c] = mix64(quickSum<3>(points.keySum[c], firstBin[c]));
}

STROBE_TARGET_CLONES void findBins(const float* time, int n, int bins, uint32_t* bin) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        bin[i] = uint32_t(std::min(int(time[i] * float(bins)), bins - 1));
}

} // namespace

void findTimeBins(const float* time, int n, int bins, uint32_t* bin) { findBins(time, n, bins, bin); }

void TrianglePointSoA::mixKeys(int k, const uint32_t* firstBin, uint64_t* keys) const {
    mixPointKeys(points[k], firstBin, count, keys);
}

void TrianglePointSoA::push(const LatticeSoA& from, int at) {
    lane[count] = at;
    i[count] = from.i[at], j[count] = from.j[at], nu[count] = from.nu[at], nv[count] = from.nv[at];
    isUpper[count] = from.kind[at] == LatticeCell::Upper, positive[count] = from.positive[at];
    keySum[count] = from.keySum[at];
    for (Points& p : points)
        p.prim[count] = from.hit.prim[at];
    ++count;
}

void TrianglePointSoA::find(int each) {
    // The processor takes this many about as fast as one. What lies beyond `count` does not matter.
    constexpr int kTogether = 16;
    static_assert(kSoAWidth % kTogether == 0);
    for (int k = 0; k < each; ++k)
        findPoints(*this, (count + kTogether - 1) / kTogether * kTogether, k, points[k]);
}

void LatticeSoA::add(const Hit& one, const V3f& direction, float at, const RayCone& pixel) {
    hit.set(count, one), d.set(count, direction), time[count] = at;
    width[count] = pixel.width, spread[count] = pixel.spread;
    ++count;
}

bool LatticeSoA::divideTriangles(float blockSize, bool sharesSmall) {
    return divideTriangleSoA(*this, blockSize, sharesSmall);
}
void LatticeSoA::mixKeys() { mixKeySoA(*this); }

void LatticeSoA::divideQuadric(int lane, bool isPositive) {
    const V3f du = a.at(lane), dv = b.at(lane), dir = d.at(lane);
    const float size = block[lane], a2 = seenLength2(du, dir), b2 = seenLength2(dv, dir);
    const float sine2 = sine2Of(a2, b2, sqr(dot(cross(du, dv), dir))), perBlock2 = 1 / sqr(size);
    const float alongU = length(du) / size, alongV = length(dv) / size;
    // What is seen edge-on here turns to face us further along: neither side of a cell bows by more than half
    // a block, nor do the ends of one turn apart by more. Both numbers go at most once around.
    constexpr float kTurn = 2 * kPi;
    const int divideV = std::max(divisionFor(sqr(b2 * perBlock2) * sine2), divisionAbove(kTurn * alongV));
    const float apart = 2 * kTurn * std::ldexp(alongV, -divideV);
    const int divideU = std::max(
        {divisionFor(sqr(a2 * perBlock2) * sine2), divisionAbove(kTurn * alongU), divisionAbove(sqr(apart))});
    const Divided r = divide(hit.u[lane], hit.v[lane], divideU, divideV);
    positive[lane] = isPositive;
    kind[lane] = LatticeCell::Rectangle;
    i[lane] = r.i, j[lane] = r.j, nu[lane] = r.nu, nv[lane] = r.nv;
    place.set(lane, {r.x, r.y, 0});
}

} // namespace strobe
