"""The moving subject: a strider, a long-legged bird that runs along +x. z is up; it is about two units tall.

The deforming version rotates the limbs about their joints and moves each vertex by distance-weighted bones (linear blend
skinning), so that all keys have the same topology.
"""

import numpy as np

from implicit import chain, ellipsoid, limb, mesh, segment_distance, smooth_min, vertex_normals, ball

NECK = [(0.26, 0, 1.16), (0.46, 0, 1.30), (0.46, 0, 1.56), (0.56, 0, 1.76)]
LEGS = {  # hip, knee, ankle, ball of the foot
    "right": [(0.06, -0.12, 0.98), (0.34, -0.14, 0.76), (0.24, -0.14, 0.40), (0.46, -0.14, 0.09)],
    "left": [(-0.04, 0.12, 0.98), (0.04, 0.14, 0.64), (-0.36, 0.14, 0.54), (-0.56, 0.14, 0.24)],
}
TOES = {"right": (0.16, -0.04), "left": (0.02, -0.17)}  # direction of the toes: x, z
WINGS = {"right": [(0.08, -0.18, 1.16), (-0.20, -0.40, 1.30)], "left": [(0.08, 0.18, 1.16), (-0.20, 0.40, 1.30)]}
TAIL = [(-0.28, 0, 1.14), (-0.62, 0, 1.34)]


def _leg(p, side):
    """Returns the field of a leg."""
    hip, knee, ankle, foot = LEGS[side]
    d = limb(p, hip, knee, 0.15, 0.065)
    d = smooth_min(d, limb(p, knee, ankle, 0.062, 0.032), 0.05)
    d = smooth_min(d, ball(p, ankle, 0.045), 0.03)
    d = smooth_min(d, limb(p, ankle, foot, 0.032, 0.034), 0.03)
    dx, dz = TOES[side]
    for spread in (-0.09, 0.0, 0.09):
        tip = (foot[0] + dx * (1 if spread == 0 else 0.8), foot[1] + spread, foot[2] + dz)
        d = smooth_min(d, limb(p, foot, tip, 0.030, 0.020), 0.025)
    heel = (foot[0] - 0.45 * dx, foot[1], foot[2] + 0.6 * dz)
    return smooth_min(d, limb(p, foot, heel, 0.026, 0.018), 0.025)


def _feathers(p):
    """Returns the field of the wings and the tail."""
    d = np.full(len(p), 9.0)
    for side, (root, tip) in WINGS.items():
        sign = -1 if side == "right" else 1
        for i in range(4):
            end = (tip[0] - 0.11 * i + 0.12, tip[1] - sign * 0.06 * i, tip[2] - 0.08 * i)
            d = smooth_min(d, limb(p, (root[0] - 0.05 * i, root[1], root[2] - 0.02 * i), end, 0.065, 0.028), 0.03)
    for i in range(-2, 3):
        end = (TAIL[1][0] + 0.035 * i * i, 0.10 * i, TAIL[1][2] - 0.045 * abs(i))
        d = smooth_min(d, limb(p, TAIL[0], end, 0.085, 0.034), 0.03)
    return d


def body(p):
    """Returns the field of the strider."""
    d = ellipsoid(p, (0.0, 0, 1.09), (0.38, 0.23, 0.24), 8)
    d = smooth_min(d, chain(p, NECK, [0.12, 0.075, 0.052, 0.056], 0.09), 0.12)
    d = smooth_min(d, _feathers(p), 0.07)
    for side in LEGS:
        d = smooth_min(d, _leg(p, side), 0.09)
    head = smooth_min(ellipsoid(p, (0.61, 0, 1.79), (0.125, 0.08, 0.082), -8), ball(p, (0.63, 0.062, 1.815), 0.034), 0.02)
    head = smooth_min(head, ball(p, (0.63, -0.062, 1.815), 0.034), 0.02)
    beak = smooth_min(limb(p, (0.69, 0, 1.795), (0.87, 0, 1.765), 0.042, 0.010),
                      limb(p, (0.69, 0, 1.755), (0.82, 0, 1.725), 0.026, 0.008), 0.012)
    d = smooth_min(d, smooth_min(head, beak, 0.03), 0.05)
    for i, (x, z) in enumerate(((0.46, 2.00), (0.38, 1.93), (0.35, 1.84))):
        plume = smooth_min(limb(p, (0.56 - 0.02 * i, 0, 1.85 - 0.01 * i), (x, 0, z), 0.02, 0.010), ball(p, (x, 0, z), 0.028), 0.02)
        d = smooth_min(d, plume, 0.025)
    return d


def _bones():
    """Returns {name: (start, end, radius, parent)}. A bone rotates about its start; parents come before children."""
    bones = {"body": ((-0.25, 0, 1.08), (0.25, 0, 1.12), 0.2, None),
             "tail": (*TAIL, 0.08, "body"),
             "neck": (NECK[0], NECK[1], 0.07, "body"), "throat": (NECK[1], NECK[2], 0.05, "neck"),
             "head": (NECK[2], (0.72, 0, 1.80), 0.06, "throat")}
    for side, (hip, knee, ankle, foot) in LEGS.items():
        dx, dz = TOES[side]
        bones[side + " thigh"] = (hip, knee, 0.1, "body")
        bones[side + " shin"] = (knee, ankle, 0.04, side + " thigh")
        bones[side + " shank"] = (ankle, foot, 0.03, side + " shin")
        bones[side + " toes"] = (foot, (foot[0] + dx, foot[1], foot[2] + dz), 0.03, side + " shank")
        bones[side + " wing"] = (*WINGS[side], 0.05, "body")
    return bones


# Rotations of the bones about the y axis at each key, in degrees. Positive: the lower end of a limb moves back, a head or a
# tip moves down.
POSES = (
    {},
    {"right thigh": 26, "right shin": -10, "right shank": 6, "left thigh": -34, "left shin": 14, "left shank": 8,
     "neck": 5, "head": -5, "right wing": -8, "left wing": -8},
    {"right thigh": 54, "right shin": -30, "right shank": 26, "right toes": 30, "left thigh": -62, "left shin": 12,
     "left shank": -8, "neck": -3, "head": 4, "tail": 6, "right wing": -14, "left wing": -14},
)


def _matrices(bones, pose):
    """Returns the 4x4 matrices, for row vectors, that move each bone from the rest pose to `pose`."""
    matrices = {}
    for name, (start, _, _, parent) in bones.items():
        c, s = np.cos(np.radians(pose.get(name, 0))), np.sin(np.radians(pose.get(name, 0)))
        turn = np.eye(4)
        turn[:3, :3] = [[c, 0, s], [0, 1, 0], [-s, 0, c]]  # x turns to +z: a hanging limb (-z) turns to +x
        turn[3, :3] = np.asarray(start) - np.asarray(start) @ turn[:3, :3]
        matrices[name] = turn @ matrices[parent] if parent else turn
    return np.stack(list(matrices.values()))


def posed(points, pose):
    """Returns points moved from the rest pose to `pose`."""
    bones = _bones()
    weight = []
    for name, (start, end, radius, _) in bones.items():
        d, _ = segment_distance(points, start, end)
        weight.append((np.maximum(d - 0.7 * radius, 0) ** 2 + 0.02 ** 2) ** -2)
    weight = np.stack(weight, 1)
    weight /= weight.sum(1, keepdims=True)
    blend = np.einsum("nb,bij->nij", weight, _matrices(bones, pose))
    return np.einsum("ni,nij->nj", np.concatenate([points, np.ones((len(points), 1))], 1), blend)[:, :3]


def meshes():
    """Yields the file name and the mesh of the rigid strider and of each key of the deforming strider."""
    points, normals, triangles = mesh(body, (-0.85, -0.6, -0.05), (1.0, 0.6, 2.15), 0.0175)
    yield "strider.ply", (points, normals, triangles)
    for i, pose in enumerate(POSES):
        moved = posed(points, pose)
        yield f"strider-run-{i}.ply", (moved, vertex_normals(moved, triangles), triangles)
