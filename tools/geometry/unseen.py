"""The parts of the scenes in scenes/unseen. Units are meters, z is up."""

import numpy as np

from images import directions
from implicit import ball, ellipsoid, limb, mesh, smooth_max, smooth_min, vertex_normals
from solids import box, lathe, merge, move, rod, sheet, turn


def _tube(points, radius, segments=5):
    """Returns a tube around a polyline that does not bend much."""
    points = np.asarray(points, float)
    along = np.gradient(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(along, (0.31, 0.17, 0.94))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(side, along)
    phi = np.linspace(0, 2 * np.pi, segments + 1)[None, :, None]
    return sheet(points[:, None] + radius * (side[:, None] * np.cos(phi) + up[:, None] * np.sin(phi)))


# The cellar.

def vault():
    """Returns the walls and the barrel vault of a cellar along y, with a rib every two meters."""
    y = np.linspace(-0.6, 12, 106)[None, :]
    phi = np.linspace(0, np.pi, 29)
    arc = np.stack([-np.cos(phi), np.sin(phi)], 1)
    profile = np.concatenate([[(-1, -0.5)], arc, [(1, -0.5)]])[:, None]
    rib = 0.14 * np.clip(6 * (np.cos(np.pi * y) - 0.86) + 0.5, 0, 1)
    x = profile[..., 0] * (2.2 - rib)
    z = 1.1 + np.where(profile[..., 1] < 0, -1.1 + 0 * y, profile[..., 1] * (2.2 - rib))
    return sheet(np.stack([x, y + 0 * x, z], -1))


def barrel():
    """Returns a barrel that lies along y, and its hoops."""
    z = np.linspace(-0.5, 0.5, 13)
    radius = 0.42 - 0.36 * z ** 2
    lids = [(0, -0.46), (radius[0] - 0.03, -0.46), (radius[0] - 0.03, -0.5)]
    body = lathe(lids + list(zip(radius, z)) + [(r, -h) for r, h in lids[::-1]], 40)
    hoops = [lathe([(0.42 - 0.36 * (h + d) ** 2 + 0.008, h + d) for d in (-0.025, 0.025)], 40) for h in (-0.44, -0.2, 0.2, 0.44)]
    return turn(body, -90, 0), turn(merge(*hoops), -90, 0)


def _string(k):
    """Returns the positions along the cable of the k-th string of lamps, which hangs between the ribs."""
    t = np.linspace(0, 1, 111)
    x = (-1.5, -0.55, 0.6, 1.55)[k] + 0.12 * np.sin(5 * t + 2 * k)
    span = t * 5.5 - np.floor(t * 5.5)
    return np.stack([x, 2.2 + 9.2 * t, (2.3, 2.72, 2.74, 2.25)[k] - 0.9 * span * (1 - span)], 1)


def lamps(strings):
    """Returns the lamps of some strings, eleven each, as one mesh."""
    bulb = lathe([(0.032 * np.sin(a), -0.032 * np.cos(a)) for a in np.linspace(0, np.pi, 4)], 6, 180)
    return merge(*[move(bulb, p - (0, 0, 0.045)) for k in strings for p in _string(k)[5::10]])


def bottle():
    """Returns a bottle of 0.3 m."""
    profile = [(0, 0), (0.034, 0), (0.037, 0.004), (0.037, 0.17), (0.034, 0.19), (0.018, 0.225), (0.0145, 0.24), (0.0145, 0.285),
               (0.0165, 0.286), (0.0165, 0.298), (0.0145, 0.3), (0, 0.3)]
    return lathe(profile, 40, 50)


# The doll's house.

def dollhouse_furniture():
    """Yields the name and the mesh of the furniture of each room."""
    bed = merge(box((-2.8, 0.75, 0.25), (-1.5, 1.85, 0.5), 0.05, 2), box((-2.9, 0.7, 0), (-2.8, 1.9, 0.95)),
                box((-2.7, 0.95, 0.5), (-2.4, 1.65, 0.62), 0.05, 2))
    bars = [box((x, y, 0.1), (x + 0.02, y + 0.02, 0.85), steps=0) for x in np.linspace(2.2, 2.88, 9) for y in (1.2, 1.83)]
    cot = merge(box((2.2, 1.2, 0.3), (2.9, 1.85, 0.42)), *bars, box((2.2, 1.2, 0.83), (2.9, 1.23, 0.87)),
                box((2.2, 1.82, 0.83), (2.9, 1.85, 0.87)))
    tub = lathe([(0, 0.1), (0.3, 0.1), (0.36, 0.5), (0.4, 0.52), (0.4, 0.55), (0.34, 0.54), (0.28, 0.16), (0, 0.15)], 32)
    tub = (tub[0] * (1.8, 1, 1) + (-0.1, 1.3, 0), tub[1], tub[2])
    upper = move(merge(bed, cot, tub), (0, 0, 2.1))
    steps = [box((-0.75 + 0.19 * i, 1.1, 0), (-0.56 + 0.19 * i, 1.95, 0.22 * (i + 1)), steps=0) for i in range(8)]
    chair = merge(box((0, 0, 0.4), (0.36, 0.36, 0.45)), box((0, 0.33, 0.45), (0.36, 0.36, 0.95)),
                  *[box((a, b, 0), (a + 0.03, b + 0.03, 0.4), steps=0) for a in (0, 0.33) for b in (0, 0.33)])
    chairs = [move(chair, (x, y, 0)) for x, y in ((-2.7, 1.2), (-1.6, 1.3))]
    table = merge(box((-2.2, 0.7, 0.7), (-1.4, 1.2, 0.74)), rod((-1.8, 0.95, 0), (-1.8, 0.95, 0.7), 0.05))
    kitchen = merge(box((1.1, 1.4, 0), (2.95, 1.98, 0.88)), box((1.1, 1.65, 1.4), (2.2, 1.98, 1.9)),
                    box((2.5, 1.3, 0.88), (2.95, 1.98, 1.8), 0.03, 2))
    yield "upper", upper
    yield "lower", merge(*steps, *chairs, table)
    yield "kitchen", kitchen


# The mirror hall.

def wheel(spokes=12):
    """Returns a wheel of radius 1.2 that turns about the y axis: its rim with the hub, and its flat spokes."""
    ring = [(1.12, -0.07), (1.2, -0.07), (1.2, 0.07), (1.12, 0.07), (1.12, -0.07)]
    hub = [(0, -0.16), (0.13, -0.16), (0.16, -0.12), (0.16, 0.12), (0.13, 0.16), (0, 0.16)]
    bar = box((-0.055, -0.015, 0.14), (0.055, 0.015, 1.14), 0.012)
    return turn(merge(lathe(ring, 72), lathe(hub, 40)), 90, 0), merge(*[turn(bar, 360 * i / spokes, 1) for i in range(spokes)])


# The meadow.

def _height(x, y):
    """Returns the height of the land: flat near the origin, hills beyond, mountains at the horizon."""
    r = np.hypot(x, y)
    hills = 9 * np.sin(x / 71 + 1) * np.sin(y / 97 + 0.4) + 5 * np.sin(x / 31 + y / 43)
    peaks = 240 * np.abs(np.sin(x / 610 + 0.5 + 0.4 * np.sin(y / 500))) + 70 * np.abs(np.sin(x / 190 + y / 330)) + 24 * np.sin(x / 83)
    hills, peaks = hills * np.clip((r - 25) / 250, 0, 1) ** 1.5, peaks * np.clip((r - 1200) / 1600, 0, 1) ** 1.5
    return hills + peaks - 9 * np.clip((r - 60) / 400, 0, 1)


def land():
    """Returns the land in front of the camera up to a distance of 4 km; its rows are dense near the camera."""
    y = np.concatenate([[-3, 0], np.geomspace(2, 4000, 84)])[:, None]
    x = np.linspace(-1.3, 1.3, 61)[None, :] * (y + 9)
    return sheet(np.stack([x, y + 0 * x, _height(x, y)], -1))


def fence():
    """Returns a picket fence of 60 m along y: pickets with pointed tops and two rails."""
    picket = box((-0.012, -0.04, 0.05), (0.012, 0.04, 0.95), steps=0)
    tip = (np.array([(s * 0.012, y, 0.95 + h) for s in (-1, 1) for y, h in ((-0.04, 0), (0.04, 0), (0, 0.08))], float),
           np.array([(s, 0, 0) for s in (-1, 1) for _ in range(3)], float),
           np.array([(0, 2, 1), (3, 4, 5), (1, 2, 5), (1, 5, 4), (2, 0, 3), (2, 3, 5)], np.int32))
    pickets = [move(merge(picket, tip), (0, y, 0)) for y in np.arange(1.2, 45, 0.19)]
    return merge(*pickets, *[box((0.012, 1, z), (0.04, 45, z + 0.07), steps=0) for z in (0.25, 0.7)])


def grass(blades=1500):
    """Returns bent blades of grass, each a strip of three triangles, denser near the camera."""
    k = np.arange(blades)
    u, v, w = [(k * g) % 1 for g in (0.8191725, 0.6710436, 0.5497005)]  # Roberts' R3 sequence
    x, y = -1.35 + 4.2 * u, 1.3 + 9 * v ** 1.6
    angle, tall = 40 * w + 3 * u, 0.2 + 0.4 * ((7 * w + 3 * v) % 1)
    lean = np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1) * tall[:, None]
    side = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], 1) * 0.011
    root, up = np.stack([x, y, _height(x, y) - 0.01], 1), np.stack([0 * x, 0 * x, tall], 1)
    middle = root + 0.12 * lean + 0.6 * up
    points = np.stack([root - side, root + side, middle - side, middle + side, root + 0.5 * lean + up], 1).reshape(-1, 3)
    triangles = (5 * k[:, None, None] + np.array([(0, 1, 3), (0, 3, 2), (2, 3, 4)])).reshape(-1, 3).astype(np.int32)
    return points, vertex_normals(points, triangles), triangles


def tree():
    """Returns the trunk and the branches of the tree."""
    def field(p):
        d = limb(p, (0, 0, -0.1), (0.1, 0, 1.6), 0.17, 0.12)
        for tip in ((-0.7, 0.2, 2.9), (0.8, -0.2, 2.8), (0.15, 0.3, 3.3)):
            d = smooth_min(d, limb(p, (0.1, 0, 1.55), tip, 0.09, 0.02), 0.1)
        return d
    return mesh(field, (-1, -0.5, -0.2), (1.1, 0.6, 3.5), 0.06)


def sky(width=256):
    """Returns a latitude-longitude map of linear radiance with z up: a clear sky with thin clouds and a small sun."""
    d = directions(width)
    z = d[..., 2:]
    rgb = np.array([0.13, 0.27, 0.62]) + np.array([0.55, 0.47, 0.26]) * np.exp(-4 * np.abs(z))
    flat = d[..., :2] / (np.abs(z) + 0.15)
    waves = sum(np.sin(f * (flat @ (np.cos(7 * f), np.sin(7 * f))) + 11 * f) / f ** 0.8 for f in (1.1, 1.7, 2.9, 4.3, 6.7))
    rgb = rgb + 0.45 * np.clip(0.6 * waves[..., None] - 0.25, 0, 1) * np.clip(4 * z, 0, 1)
    sun = np.array([-0.62, 0.3, 0.72])
    cosine = d @ (sun / np.linalg.norm(sun))
    rgb = rgb + np.array([0.5, 0.4, 0.25]) * np.exp((cosine[..., None] - 1) / 0.02)
    rgb = rgb + np.array([5200.0, 4500, 3500]) * (cosine > np.cos(0.014))[..., None]
    return np.where(z > 0, rgb, np.array([0.07, 0.09, 0.05]))


# The bowl.

def bowl():
    """Returns a flat-rimmed bowl of radius 2.6 and depth 1.5."""
    r = np.linspace(0, 2.6, 30)
    profile = list(zip(r, 1.5 * (r / 2.6) ** 2.4 - 1.5)) + [(2.75, 0.03), (3.0, 0.03), (3.0, -0.2)]
    return lathe(profile[::-1], 72, 50)


def die():
    """Returns a cube with round holes."""
    def field(p):
        d = smooth_max(np.abs(p).max(1) - 0.33, np.linalg.norm(p, axis=1) - 0.47, 0.05)
        for axis in range(3):
            q = np.delete(p, axis, 1)
            d = smooth_max(d, 0.15 - np.linalg.norm(q, axis=1), 0.02)
        return d
    return mesh(field, (-0.4, -0.4, -0.4), (0.4, 0.4, 0.4), 0.034)


def ring():
    """Returns a thin ring in the x-y plane."""
    a = np.linspace(0, 2 * np.pi, 17)
    return lathe([(0.42 + 0.07 * np.cos(t), 0.07 * np.sin(t)) for t in a], 56, 180)


def cloth(phase, n=72):
    """Returns a square cloth in which a wave travels."""
    u, v = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n))
    r = np.hypot(u + 0.2, v - 0.1)
    z = 0.17 * np.sin(5.5 * u + 2.5 * v - phase) + 0.07 * np.sin(11 * v - 3 * u - 1.7 * phase) - 0.16 * r ** 2
    return sheet(np.stack([0.85 * u * (1 - 0.06 * r ** 2), 0.85 * v * (1 - 0.06 * r ** 2), z], -1))


def cairn():
    """Returns three stones on top of each other."""
    def field(p):
        d = ellipsoid(p, (0, 0, 0.13), (0.3, 0.2, 0.13), 4)
        d = np.minimum(d, ellipsoid(p, (0.02, 0, 0.32), (0.2, 0.17, 0.09), -6))
        return np.minimum(d, ball(p, (0.03, 0.0, 0.47), 0.08))
    return mesh(field, (-0.4, -0.3, -0.05), (0.4, 0.3, 0.6), 0.026)


def meshes():
    """Yields the file name and the mesh of each part."""
    body, hoops = barrel()
    rim, spokes = wheel()
    parts = {"vault": vault(), "barrel": body, "hoops": hoops, "bottle": bottle(), "wheel": rim, "spokes": spokes, "land": land(),
             "fence": fence(), "grass": grass(), "tree": tree(), "bowl": bowl(), "die": die(), "ring": ring(), "cairn": cairn()}
    parts["lamps-outer"], parts["lamps-inner"] = lamps((0, 3)), lamps((1, 2))
    parts["cable"] = merge(*[_tube(_string(k), 0.006) for k in range(4)])
    parts.update({f"cloth-{k}": cloth(1.1 * k) for k in range(3)})
    parts.update({f"house-{name}": part for name, part in dollhouse_furniture()})
    for name, part in parts.items():
        yield f"unseen-{name}.ply", part
