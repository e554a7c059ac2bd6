"""Keys of motion over the shutter: as few times as reproduce it by interpolation."""
import numpy as np
from mathutils import Matrix


class Snapshot:
    """What moves at one time: {item: 4x4 matrix} and {item: (positions, normals) of a mesh that differs from its first key}."""

    def __init__(self):
        """Creates an empty snapshot."""
        self.matrices, self.meshes = {}, {}


def interpolated(a, b, x):
    """Returns the matrix between two matrices, as strobe interpolates: translation and scale linearly, and the rotation."""
    (at, ar, scale_a), (bt, br, scale_b) = Matrix(a).decompose(), Matrix(b).decompose()
    return np.array(Matrix.LocRotScale(at.lerp(bt, x), ar.slerp(br, x), scale_a.lerp(scale_b, x)), np.float64)


def matrix_error(a, b, true, x, radius):
    """Returns the distance by which interpolation misplaces points within a radius of the origin."""
    difference = np.abs(interpolated(a, b, x) - true)
    return float(np.linalg.norm(difference[:3, 3]) + radius * np.linalg.norm(difference[:3, :3]))


def fits(before, middle, after, radii, tolerance):
    """Returns whether the snapshot in the middle equals the interpolation of its neighbors within the tolerance."""
    for item, true in middle.matrices.items():
        a, b = before.matrices.get(item), after.matrices.get(item)
        if a is None or b is None or (np.array_equal(a, b) and np.array_equal(a, true)):
            continue
        if matrix_error(a, b, true, 0.5, radii.get(item, 1.0)) > tolerance(true[:3, 3]):
            return False
    for item in middle.meshes.keys() | before.meshes.keys() | after.meshes.keys():
        a, true, b = (s.meshes.get(item) for s in (before, middle, after))
        if a is None or b is None or true is None:
            continue
        error = np.abs((a[0] + b[0]) / 2 - true[0]).max() if len(true[0]) else 0
        scale = np.linalg.norm(middle.matrices[item][:3, :3], 2) if item in middle.matrices else 1
        place = middle.matrices[item][:3, 3] if item in middle.matrices else np.zeros(3)
        if error * scale > tolerance(place):
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
    return any(not np.array_equal(keys[0], key) for key in keys[1:])
