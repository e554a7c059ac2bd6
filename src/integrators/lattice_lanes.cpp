#include "integrators/lattice_lanes.h"

#include "core/hash.h"

namespace strobe {

namespace {

constexpr int kMaxDivide = 20;
/// Squared lengths, in blocks, below which an edge is not divided.
constexpr float kUndivided = 2;

/// The exponent of the power of two that cuts a length into parts as long as a block, to a factor of the root
/// of two; both are given squared. Half the binary logarithm of their ratio, rounded: read off the number's
/// exponent.
inline int divisionFor(float length2, float block2) {
    const float ratio = length2 / block2;
    const int floorLog2 = int(std::bit_cast<uint32_t>(ratio) >> 23) - 127;
    const int division = std::min((floorLog2 + 1) / 2, kMaxDivide);
    return ratio >= kUndivided ? division : 0;
}

/// The exponent of the least power of two whose square is above n2, or one.
inline int divisionAbove(float n2) { return divisionFor(2 * n2, 1); }

/// The squared length of `edge` as seen along the unit direction d, in scene units.
inline float seenLength2(const V3f& edge, const V3f& d) {
    return std::max(length2(edge) - sqr(dot(d, edge)), 0.f);
}

/// How much longer than a block's the sides of its parallelogram must be, squared, for it to have a block's
/// area as seen: the inverse sine of the angle between them, at most 2. The squared lengths as seen are a2
/// and b2, the squared area `area2`.
inline float slantOf(float a2, float b2, float area2) {
    const float slant = std::sqrt(a2 * b2 / area2);
    return a2 * b2 < 4 * area2 ? slant : 2;
}

/// A place in a mesh of divided u and v.
struct Divided {
    float i, j, nu, nv; ///< see LatticeCell
    float x, y;         ///< inside, in [0,1]
};

inline Divided divide(float u, float v, int divideU, int divideV) {
    Divided r;
    r.nu = std::bit_cast<float>(uint32_t(127 + divideU) << 23);
    r.nv = std::bit_cast<float>(uint32_t(127 + divideV) << 23);
    const float x = std::clamp(u, 0.f, 1.f) * r.nu, y = std::clamp(v, 0.f, 1.f) * r.nv;
    r.i = std::min(float(int(x)), r.nu - 1), r.j = std::min(float(int(y)), r.nv - 1);
    r.x = x - r.i, r.y = y - r.j;
    return r;
}

STROBE_LANES void divideTriangleLanes(LatticeLanes& l, float blockSize, bool sharesSmall) {
    const int n = l.count;
    STROBE_INDEPENDENT
    for (int k = 0; k < n; ++k) {
        const V3f a = l.a.at(k), b = l.b.at(k), d = l.d.at(k), normal = cross(a, b);
        l.block[k] = blockSize * (l.width[k] + l.hit.t[k] * l.spread[k]);
        const float facing = dot(normal, d), block2 = sqr(l.block[k]);
        const float a2 = seenLength2(a, d), b2 = seenLength2(b, d), c2 = seenLength2(b - a, d);
        const float sized2 = block2 * slantOf(a2, b2, sqr(facing));
        const Divided r = divide(l.hit.u[k], l.hit.v[k], divisionFor(a2, sized2), divisionFor(b2, sized2));
        const float rest = 1 - r.x - r.y;
        const bool upper = rest < 0;
        // Edge-on, a triangle is small whatever its area.
        const bool small = sharesSmall & (std::max(std::max(a2, b2), c2) < kUndivided * block2);
        l.positive[k] = facing < 0;
        l.kind[k] = small ? LatticeCell::Vertices : upper ? LatticeCell::Upper : LatticeCell::Lower;
        l.i[k] = small ? 0 : r.i, l.j[k] = small ? 0 : r.j;
        l.nu[k] = small ? 0 : r.nu, l.nv[k] = small ? 0 : r.nv;
        const float u = std::max(l.hit.u[k], 0.f), v = std::max(l.hit.v[k], 0.f);
        l.place.x[k] = small ? u : upper ? 1 - r.y : r.x;
        l.place.y[k] = small ? v : upper ? 1 - r.x : r.y;
        l.cellArea[k] = 2 * block2 / length(normal);
    }
}

STROBE_LANES void mixKeyLanes(LatticeLanes& l) {
    const int n = l.count;
    STROBE_INDEPENDENT
    for (int k = 0; k < n; ++k) {
        const uint64_t item = latticeItem(0, kCellKey + uint64_t(uint32_t(l.kind[k])), l.positive[k]);
        l.key[k] = mix64(quickSum<1>(l.keySum[k], item, latticeFloatBits(l.i[k], l.j[k]),
                                     latticeFloatBits(l.nu[k], l.nv[k])));
    }
}

STROBE_LANES void findPoints(const TrianglePointLanes& l, int n, int k, TrianglePointLanes::Points& p) {
    // The first point of an upper cell is the corner across from that of a lower one.
    const float ofUpper = k == 0, alongU = k == 1, alongV = k == 2;
    STROBE_INDEPENDENT
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

} // namespace

void TrianglePointLanes::push(const LatticeLanes& from, int at) {
    lane[count] = at;
    i[count] = from.i[at], j[count] = from.j[at], nu[count] = from.nu[at], nv[count] = from.nv[at];
    isUpper[count] = from.kind[at] == LatticeCell::Upper, positive[count] = from.positive[at];
    keySum[count] = from.keySum[at];
    for (Points& p : points)
        p.prim[count] = from.hit.prim[at];
    ++count;
}

void TrianglePointLanes::find() {
    // The processor takes this many about as fast as one. What lies beyond `count` does not matter.
    constexpr int kTogether = 16;
    static_assert(kLanes % kTogether == 0);
    for (int k = 0; k < 3; ++k)
        findPoints(*this, (count + kTogether - 1) / kTogether * kTogether, k, points[k]);
}

void LatticeLanes::add(const Hit& one, const V3f& direction, float at, const RayCone& pixel) {
    hit.set(count, one), d.set(count, direction), time[count] = at;
    width[count] = pixel.width, spread[count] = pixel.spread;
    ++count;
}

void LatticeLanes::divideTriangles(float blockSize, bool sharesSmall) {
    divideTriangleLanes(*this, blockSize, sharesSmall);
}
void LatticeLanes::mixKeys() { mixKeyLanes(*this); }

void LatticeLanes::divideQuadric(int lane, bool isPositive) {
    const V3f du = a.at(lane), dv = b.at(lane), dir = d.at(lane);
    const float size = block[lane], a2 = seenLength2(du, dir), b2 = seenLength2(dv, dir);
    const float sized2 = sqr(size) * slantOf(a2, b2, sqr(dot(cross(du, dv), dir)));
    const float alongU = length(du) / size, alongV = length(dv) / size;
    // What is seen edge-on here turns to face us further along: neither side of a cell bows by more than half
    // a block, nor do the ends of one turn apart by more. Both numbers go at most once around.
    constexpr float kTurn = 2 * kPi;
    const int divideV = std::max(divisionFor(b2, sized2), divisionAbove(kTurn * alongV));
    const float apart = 2 * kTurn * std::ldexp(alongV, -divideV);
    const int divideU =
        std::max({divisionFor(a2, sized2), divisionAbove(kTurn * alongU), divisionAbove(sqr(apart))});
    const Divided r = divide(hit.u[lane], hit.v[lane], divideU, divideV);
    positive[lane] = isPositive;
    kind[lane] = LatticeCell::Rectangle;
    i[lane] = r.i, j[lane] = r.j, nu[lane] = r.nu, nv[lane] = r.nv;
    place.set(lane, {r.x, r.y, 0});
}

} // namespace strobe
