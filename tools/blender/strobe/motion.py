"""Keys of motion over the shutter: as few times as reproduce it by interpolation."""
import math

import numpy as np
from mathutils import Matrix


class Snapshot:
    """What moves at one time: {item: Matrix} and {item: (positions, normals) of a mesh that differs from its first key}."""

    def __init__(self):
        """Creates an empty snapshot."""
        self.matrices, self.meshes = {}, {}


def interpolated(a, b, x):
    """Returns the matrix between two matrices, as strobe interpolates: translation and scale linearly, and the rotation."""
    (at, ar, scale_a), (bt, br, scale_b) = a.decompose(), b.decompose()
    return Matrix.LocRotScale(at.lerp(bt, x), ar.slerp(br, x), scale_a.lerp(scale_b, x))


def matrix_error(a, b, true, x, radius):
    """Returns a bound of the distance by which interpolation misplaces points within a radius of the origin."""
    difference = interpolated(a, b, x) - true
    columns = [column.to_3d().length for column in difference.col]
    return columns[3] + radius * math.hypot(*columns[:3])


def fits(before, middle, after, radii, tolerance):
    """Returns whether the snapshot in the middle equals the interpolation of its neighbors within the tolerance."""
    for item, true in middle.matrices.items():
        a, b = before.matrices.get(item), after.matrices.get(item)
        if a is None or b is None or a == b == true:
            continue
        if matrix_error(a, b, true, 0.5, radii.get(item, 1.0)) > tolerance(true.translation):
            return False
    for item, mesh in middle.meshes.items():
        a, b, place = before.meshes.get(item), after.meshes.get(item), middle.matrices[item]
        if a is None or b is None or mesh is None or not len(mesh[0]):
            continue
        error = np.linalg.norm((a[0] + b[0]) / 2 - mesh[0], axis=1).max()
        if error * max(place.to_scale()) > tolerance(place.translation):
            return False
    return True


def collect(snapshot_at, levels, radii, tolerance):
    """Returns {time in [0,1]: Snapshot} of equidistant times. snapshot_at(time) evaluates the scene. Intervals are halved
    until their centers need no key, `levels` times at most."""
    shots = {t: snapshot_at(t) for t in (0.0, 0.5, 1.0)}
    keys = [0.0, 1.0]
    for level in range(levels + 1):
        centers = [(a + b) / 2 for a, b in zip(keys, keys[1:])]
        for t in centers:
            if t not in shots:
                shots[t] = snapshot_at(t)
        if level == levels or all(fits(shots[a], shots[(a + b) / 2], shots[b], radii, tolerance)
                                  for a, b in zip(keys, keys[1:])):
            break
        keys = sorted(keys + centers)
    return {t: shots[t] for t in keys}


def moves(keys):
    """Returns whether matrices differ."""
    return any(key != keys[0] for key in keys[1:])
