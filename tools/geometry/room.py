"""The parts of a living room. Units are meters, z is up; the room is 0 <= x <= 5, 0 <= y <= 4.4, 0 <= z <= 2.6.

Furniture is built around its own origin on the floor; the scene file places it. Walls and the parts on them are in place.
"""

import numpy as np

from solids import box, lathe, merge, move, rod, sheet, turn

SIZE = (5.0, 4.4, 2.6)
WALL = 0.25  # thickness of the walls
WINDOW = ((2.15, 3.65), (0.85, 2.15))  # bounds in y and z of the window in the left wall, x = 0
SUN_WINDOW = ((0.75, 1.85), (0.95, 2.2))  # of the window in the right wall, x = 5, which the camera does not see


def _side_wall(x0, x1, window):
    """Returns the wall x0 x1 with an opening."""
    (y0, y1), (z0, z1) = window
    top = SIZE[2] + WALL
    ends = ((-WALL, y0, -WALL, top), (y1, SIZE[1] + WALL, -WALL, top), (y0, y1, -WALL, z0), (y0, y1, z1, top))
    return merge(*[box((x0, a, c), (x1, b, d), steps=0) for a, b, c, d in ends])


def walls():
    """Returns all walls except the back wall. They reach beyond the floor and the ceiling."""
    front = box((-WALL, -WALL, -WALL), (SIZE[0] + WALL, 0, SIZE[2] + WALL), steps=0)
    return merge(front, _side_wall(-WALL, 0, WINDOW), _side_wall(SIZE[0], SIZE[0] + WALL, SUN_WINDOW))


def _frame(x0, x1, window, width=0.055, bars=(1, 1)):
    """Returns a window frame in the opening `window` between x0 and x1, with `bars` upright and level bars."""
    (y0, y1), (z0, z1) = window
    parts = [box((x0, y0, z), (x1, y1, z + width)) for z in (z0, z1 - width)]
    parts += [box((x0, y, z0), (x1, y + width, z1)) for y in (y0, y1 - width)]
    thin = width * 0.6
    for k in range(bars[0]):
        y = y0 + (y1 - y0) * (k + 1) / (bars[0] + 1)
        parts.append(box((x0 + 0.01, y - thin / 2, z0), (x1 - 0.01, y + thin / 2, z1)))
    for k in range(bars[1]):
        z = z0 + (z1 - z0) * (k + 1) / (bars[1] + 1)
        parts.append(box((x0 + 0.01, y0, z - thin / 2), (x1 - 0.01, y1, z + thin / 2)))
    return merge(*parts)


def trim():
    """Returns window frames, window sill, baseboards and a ceiling molding."""
    (y0, y1), (z0, _) = WINDOW
    w, d, h = SIZE
    parts = [_frame(-0.16, -0.10, WINDOW, bars=(1, 1)), _frame(w + 0.10, w + 0.16, SUN_WINDOW, bars=(1, 2)),
             box((-0.10, y0 - 0.06, z0 - 0.02), (0.07, y1 + 0.06, z0 + 0.015), 0.008)]
    for lo, hi, thick in ((0, 0.09, 0.016), (h - 0.05, h, 0.05)):
        parts += [box((0, 0, lo), (thick, d, hi)), box((w - thick, 0, lo), (w, d, hi)),
                  box((0, d - thick, lo), (w, d, hi)), box((0, 0, lo), (w, thick, hi))]
    return merge(*parts)


def curtain(width=0.42, height=1.98, folds=5):
    """Returns a curtain that hangs in folds along y, from z = 0 up, with its outside toward +x."""
    s = np.linspace(0, 1, folds * 14 + 1)[None, :]
    t = np.linspace(0, 1, 13)[:, None]
    phase = 2 * np.pi * folds * s + 0.5 * np.sin(5 * s + 2 * t)
    depth = (0.03 + 0.012 * (1 - t)) * (1 + 0.25 * np.sin(9 * s + 1))
    points = np.stack([depth * np.cos(phase), width * s + 0.012 * np.sin(2 * phase) + 0 * t, height * t + 0 * s], -1)
    return sheet(points)


def curtain_rod():
    """Returns the rod of the curtains, with knobs."""
    (y0, y1), (_, z1) = WINDOW
    knob = lathe([(0.0, -0.03), (0.02, -0.024), (0.03, 0), (0.02, 0.024), (0, 0.03)], 24)
    ends = (y0 - 0.5, y1 + 0.4)
    return merge(rod((0.09, ends[0], z1 + 0.13), (0.09, ends[1], z1 + 0.13), 0.012),
                 *[move(knob, (0.09, y, z1 + 0.13)) for y in ends],
                 *[rod((0, y, z1 + 0.13), (0.09, y, z1 + 0.13), 0.008) for y in (y0 - 0.35, y1 + 0.3)])


def seat(width, cushions):
    """Returns a sofa of this inner width with `cushions` places, centered in x; it faces -y, and its back is at y = 0.9."""
    half, side = width / 2, 0.17
    parts = [box((-half, 0.05, 0.12), (half, 0.9, 0.3), 0.03, 2),
             box((-half, 0.68, 0.25), (half, 0.9, 0.82), 0.07, 4)]
    for x in (-half - side, half):
        parts.append(box((x, 0.02, 0.12), (x + side, 0.9, 0.6), 0.07, 4))
    step = width / cushions
    for k in range(cushions):
        x = -half + k * step
        parts.append(box((x + 0.006, 0.0, 0.3), (x + step - 0.006, 0.66, 0.45), 0.05, 4))
        back = box((x + 0.012, -0.09, 0.0), (x + step - 0.012, 0.09, 0.42), 0.08, 4)
        parts.append(move(turn(back, -12, 0), (0, 0.58, 0.46)))
    return merge(*parts)


def seat_legs(width):
    """Returns the four legs of a sofa."""
    leg = lathe([(0, 0), (0.014, 0), (0.026, 0.125), (0, 0.125)], 20)
    return merge(*[move(leg, (x, y, 0)) for x in (-width / 2 - 0.08, width / 2 + 0.08) for y in (0.1, 0.82)])


def pillow(size=0.42):
    """Returns a pillow in the plane y = 0, centered at the origin."""
    n = 17
    line = np.sin(np.linspace(-np.pi / 2, np.pi / 2, n))
    u, v = np.meshgrid(line, line)
    swell = 0.085 * np.sqrt(np.maximum((1 - u ** 2) * (1 - v ** 2), 0)) ** 0.8
    pinch = 1 - 0.07 * (1 - np.abs(u * v)) * np.maximum(np.abs(u), np.abs(v))
    x, z = u * pinch * size / 2, v * pinch * size / 2
    return merge(sheet(np.stack([x, -swell, z], -1)), sheet(np.stack([-x, swell, z], -1)))


def table():
    """Returns a low table with an oval top of 1.15 m by 0.64 m and four slanted legs; its top is at z = 0.42."""
    top = lathe([(0, 0.39), (0.54, 0.39), (0.566, 0.395), (0.575, 0.405), (0.566, 0.415), (0.54, 0.42), (0, 0.42)], 96)
    scale = np.array([1, 0.56, 1])
    normals = top[1] / scale
    top = top[0] * scale, normals / np.linalg.norm(normals, axis=1)[:, None], top[2]
    leg = move(lathe([(0, 0), (0.013, 0), (0.022, 0.42), (0, 0.42)], 24), (0, 0, -0.42))
    parts = [top, box((-0.36, -0.03, 0.35), (0.36, 0.03, 0.392)), box((-0.03, -0.19, 0.35), (0.03, 0.19, 0.392))]
    for x in (-1, 1):
        for y in (-1, 1):
            parts.append(move(turn(turn(leg, -x * 9, 1), y * 7, 0), (x * 0.33, y * 0.17, 0.405)))
    return merge(*parts)


def glass_drop(radius=0.04, height=0.15):
    """Returns a solid in the shape of a drop that stands on a small disk, closed for materials that refract."""
    t = np.linspace(0, np.pi, 41)[1:-1]
    rim = np.stack([radius * 1.3 * np.sin(t) * np.sin(t / 2 + np.pi / 2) ** 0.7, height * (1 - np.cos(t)) / 2], 1)
    rim = rim[rim[:, 1] > 0.02 * height]
    return lathe(np.concatenate([[(0, rim[0, 1])], rim, [(0, height)]]), 48, 50)


def bowl():
    """Returns a shallow bowl."""
    t = np.linspace(0, 1, 13)
    outer = np.stack([0.055 + 0.105 * t ** 0.8, 0.012 + 0.062 * t ** 1.8], 1)
    inner = np.stack([0.155 * t[::-1] ** 0.8, 0.020 + 0.055 * t[::-1] ** 1.8], 1)
    return lathe(np.concatenate([[(0, 0), (0.055, 0)], outer, inner]), 64, 60)


def vase(height=0.3, belly=0.085):
    """Returns a vase with an open neck."""
    t = np.linspace(0, 1, 25)
    r = belly * (0.45 + 0.62 * np.sin(np.pi * np.minimum(t * 1.12, 1)) ** 1.2 * (1 - 0.25 * t) + 0.10 * t ** 8)
    outer = np.stack([r, height * t], 1)
    return lathe(np.concatenate([[(0, 0)], outer, [(r[-1] - 0.006, height), (r[-4] - 0.006, height * t[-4]), (0, height * 0.8)]]),
                 48, 40)


def lamp():
    """Returns a floor lamp, whose bowl is open to the top and hides the light inside; its rim is at z = 1.78."""
    t = np.linspace(0, 1, 11)
    outer = np.stack([0.02 + 0.17 * np.sin(t * np.pi / 2), 1.64 + 0.14 * t ** 1.5], 1)
    inner = np.stack([0.183 * np.sin(t[::-1] * np.pi / 2), 1.652 + 0.128 * t[::-1] ** 1.5], 1)
    foot = [(0, 0), (0.15, 0), (0.15, 0.014), (0.14, 0.022), (0.03, 0.03), (0.012, 0.06), (0.012, 1.62), (0.02, 1.64)]
    return lathe(np.concatenate([foot, outer[1:], inner]), 64, 40)


SHELF = (1.0, 0.3, 1.9)  # width, depth, height
LEVELS = (0.06, 0.44, 0.80, 1.16, 1.50)  # heights of the tops of the boards that carry books


def shelf():
    """Returns a bookcase without books; its front is at y = 0, and it is centered in x."""
    w, d, h = SHELF
    parts = [box((side * (w / 2 - 0.012) - 0.012, 0, 0), (side * (w / 2 - 0.012) + 0.012, d, h)) for side in (-1, 1)]
    parts += [box((-w / 2 + 0.02, 0.005, z - 0.024), (w / 2 - 0.02, d - 0.004, z)) for z in (*LEVELS, h)]
    return merge(*parts, box((-w / 2 + 0.02, d - 0.015, 0.03), (w / 2 - 0.02, d, h - 0.01)))


def books(color, colors=5):
    """Returns the books of one of the colors on the shelf."""
    parts, index = [], 0
    for level, z in enumerate(LEVELS):
        x, end = -SHELF[0] / 2 + 0.035, SHELF[0] / 2 - (0.06, 0.34, 0.12, 0.40, 0.2)[level]
        while x < end:
            chance = [(index * g + 0.37 * level) % 1 for g in (0.6180339887, 0.7548776662, 0.5698402910, 0.8191725134)]
            thick, height, depth = 0.018 + 0.032 * chance[0] ** 1.5, 0.20 + 0.075 * chance[1], 0.15 + 0.06 * chance[2]
            if int(chance[3] * colors) == color:
                parts.append(box((x, 0.03, z), (x + thick - 0.0015, 0.03 + depth, z + height), 0.004))
            x, index = x + thick, index + 1
    return merge(*parts)


def fan_blades():
    """Returns the hub and the four blades of a ceiling fan; the axis is z, and the blades are at z = 0."""
    hub = lathe([(0, -0.07), (0.05, -0.062), (0.09, -0.03), (0.1, 0.0), (0.09, 0.05), (0.03, 0.07), (0, 0.07)], 48)
    blade = turn(box((0.16, -0.065, -0.004), (0.62, 0.065, 0.004), 0.004), 12, 0)
    arm = box((0.06, -0.018, -0.006), (0.22, 0.018, 0.006))
    return merge(hub, *[turn(part, 90 * k + 20, 2) for k in range(4) for part in (blade, arm)])


def fan_mount():
    """Returns the rod and the canopy of the fan; the ceiling is at z = 0.3."""
    return lathe([(0, 0.05), (0.014, 0.05), (0.014, 0.24), (0.06, 0.26), (0.07, 0.3), (0, 0.3)], 40)


def picture_frame(width, height, bar=0.035):
    """Returns a frame around an opening in the xz plane, centered at the origin; its back is at y = 0."""
    w, h = width / 2, height / 2
    parts = [box((side * (w + bar / 2) - bar / 2, -0.03, -h - bar), (side * (w + bar / 2) + bar / 2, 0, h + bar), 0.006)
             for side in (-1, 1)]
    parts += [box((-w - bar / 2, -0.028, side * (h + bar / 2) - bar / 2), (w + bar / 2, 0, side * (h + bar / 2) + bar / 2), 0.006)
              for side in (-1, 1)]
    return merge(*parts)


def clock_case():
    """Returns the case of a wall clock: 0.3 m by 0.78 m, open in front of the pendulum; its back is at y = 0."""
    parts = [box((-0.15, -0.02, -0.39), (0.15, 0, 0.39)), box((-0.16, -0.12, 0.37), (0.16, 0, 0.4), 0.008),
             box((-0.16, -0.12, -0.4), (0.16, 0, -0.37), 0.008), box((-0.15, -0.1, 0.09), (0.15, 0, 0.38))]
    parts += [box((x, -0.1, -0.39), (x + 0.025, 0, 0.39)) for x in (-0.15, 0.125)]
    return merge(*parts)


def clock_hands():
    """Returns hands at ten past ten in the xz plane around the origin, with the outside toward -y, and the hour marks."""
    minute, hour = box((-0.003, -0.004, -0.015), (0.003, -0.002, 0.09), 0.001), box((-0.004, -0.002, -0.015), (0.004, 0, 0.06), 0.001)
    mark = box((-0.003, -0.001, 0.092), (0.003, 0.001, 0.108), 0.001)
    return merge(turn(minute, 60, 1), turn(hour, -55, 1), *[turn(mark, 30 * k, 1) for k in range(12)])


def pendulum():
    """Returns a pendulum that hangs from the origin, in the xz plane."""
    bob = turn(lathe([(0, -0.008), (0.03, -0.007), (0.042, 0), (0.03, 0.007), (0, 0.008)], 40), 90, 0)
    return merge(box((-0.003, -0.002, -0.33), (0.003, 0.002, 0), 0.001), move(bob, (0, 0, -0.33)))


def engine_body():
    """Returns the painted body of a toy engine that drives toward +x; its wheels stand on z = 0."""
    return merge(box((-0.15, -0.05, 0.035), (0.15, 0.05, 0.06), 0.006), box((-0.15, -0.055, 0.06), (-0.055, 0.055, 0.165), 0.008),
                 box((-0.165, -0.065, 0.165), (-0.04, 0.065, 0.178), 0.006))


def engine_boiler():
    """Returns the boiler and the chimney of the toy engine."""
    chimney = lathe([(0, 0), (0.014, 0), (0.014, 0.05), (0.022, 0.07), (0, 0.07)], 32)
    dome = lathe([(0, 0), (0.016, 0), (0.016, 0.015), (0.012, 0.026), (0, 0.03)], 32)
    return merge(rod((-0.06, 0, 0.1), (0.13, 0, 0.1), 0.042, 40), move(chimney, (0.095, 0, 0.13)), move(dome, (0.02, 0, 0.135)))


def wheels():
    """Returns the four wheels of a toy car."""
    return merge(*[rod((x, y - 0.008, 0.032), (x, y + 0.008, 0.032), 0.032, 32) for x in (-0.095, 0.085) for y in (-0.055, 0.055)])


def wagon():
    """Returns the body of an open toy wagon."""
    return merge(box((-0.12, -0.055, 0.035), (0.12, 0.055, 0.05), 0.004),
                 *[box((-0.12, y - 0.006, 0.045), (0.12, y + 0.006, 0.1), 0.004) for y in (-0.05, 0.05)],
                 *[box((x - 0.006, -0.055, 0.045), (x + 0.006, 0.055, 0.1), 0.004) for x in (-0.115, 0.115)])


def meshes():
    """Yields the file name and the mesh of each part."""
    parts = (walls, trim, curtain, curtain_rod, pillow, table, glass_drop, bowl, vase, lamp, shelf, fan_blades, fan_mount,
             clock_case, clock_hands, pendulum, engine_body, engine_boiler, wheels, wagon)
    for part in parts:
        yield f"room-{part.__name__.replace('_', '-')}.ply", part()
    yield "room-sofa.ply", seat(1.5, 2)
    yield "room-sofa-legs.ply", seat_legs(1.5)
    yield "room-armchair.ply", seat(0.62, 1)
    yield "room-armchair-legs.ply", seat_legs(0.62)
    yield "room-frame.ply", picture_frame(0.9, 0.6)
    for color in range(5):
        yield f"room-books-{color}.ply", books(color)
