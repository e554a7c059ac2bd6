"""Signed distance fields, and triangle meshes of their zero sets.

A field maps an array of points [n, 3] to n values: negative inside, and near the surface about the distance to it.
"""

import numpy as np


def smooth_min(a, b, k):
    """Returns the union of two fields, blended where they differ by less than `k`."""
    h = np.maximum(k - np.abs(a - b), 0) / k
    return np.minimum(a, b) - h * h * k / 4


def smooth_max(a, b, k):
    """Returns the blended intersection of two fields; smooth_max(a, -b, k) subtracts b from a."""
    return -smooth_min(-a, -b, k)


def segment_distance(p, a, b):
    """Returns the distance to the segment a b, and the parameter in [0,1] of the nearest point."""
    a, b = np.asarray(a, p.dtype), np.asarray(b, p.dtype)
    ab = b - a
    t = np.clip((p - a) @ ab / (ab @ ab), 0, 1)
    return np.linalg.norm(p - a - t[:, None] * ab, axis=1), t


def limb(p, a, b, ra, rb):
    """Returns the field of a capsule whose radius changes from ra to rb."""
    d, t = segment_distance(p, a, b)
    return d - (ra + (rb - ra) * t)


def chain(p, points, radii, k):
    """Returns the field of limbs through `points`, blended by k."""
    d = limb(p, points[0], points[1], radii[0], radii[1])
    for i in range(1, len(points) - 1):
        d = smooth_min(d, limb(p, points[i], points[i + 1], radii[i], radii[i + 1]), k)
    return d


def ball(p, center, radius):
    """Returns the field of a sphere."""
    return np.linalg.norm(p - np.asarray(center, p.dtype), axis=1) - radius


def ellipsoid(p, center, radii, pitch=0.0):
    """Returns the field of an ellipsoid that is rotated about the y axis: its x axis rises by `pitch` degrees."""
    q = p - np.asarray(center, p.dtype)
    c, s = np.cos(np.radians(pitch)), np.sin(np.radians(pitch))
    q = np.stack([c * q[:, 0] + s * q[:, 2], q[:, 1], c * q[:, 2] - s * q[:, 0]], axis=1)
    r = np.asarray(radii, p.dtype)
    k0 = np.linalg.norm(q / r, axis=1)
    k1 = np.linalg.norm(q / (r * r), axis=1)
    return k0 * (k0 - 1) / np.maximum(k1, 1e-6)


def gradient(field, p, step):
    """Returns the gradient of a field by central differences."""
    g = np.empty_like(p)
    for axis in range(3):
        d = np.zeros(3, p.dtype)
        d[axis] = step
        g[:, axis] = (field(p + d) - field(p - d)) / (2 * step)
    return g


def _sample(field, lo, cell, blocks, size=8):
    """Returns the field on a grid of blocks*size nodes per axis. Far from the surface only the sign is correct."""
    nodes = np.full(tuple(blocks * size), 1, np.float32)
    block = np.stack(np.meshgrid(*[np.arange(n) for n in blocks], indexing="ij"), -1).reshape(-1, 3)
    centers = lo + (block * size + (size - 1) / 2) * cell
    d = np.concatenate([field(c) for c in np.array_split(centers, max(1, len(centers) // 65536))])
    reach = 2.0 * cell * size * np.sqrt(3) / 2  # twice the half diagonal: blended fields are not exact distances
    inside = block[d <= 0]
    local = np.stack(np.meshgrid(*[np.arange(size)] * 3, indexing="ij"), -1).reshape(-1, 3)
    for b in inside:
        nodes[tuple(slice(i * size, (i + 1) * size) for i in b)] = -1
    near = block[np.abs(d) < reach]
    for chunk in np.array_split(near, max(1, len(near) // 128)):
        index = (chunk[:, None, :] * size + local).reshape(-1, 3)
        nodes[index[:, 0], index[:, 1], index[:, 2]] = field(lo + index * cell)
    return nodes


def mesh(field, lo, hi, cell):
    """Returns (points, normals, triangles) of the zero set of `field` in the box lo hi, by surface nets (Gibson 1998) with
    cells of size `cell`. The vertices are then moved onto the surface. Triangles are counterclockwise seen from outside.
    """
    lo, hi = np.asarray(lo, np.float64), np.asarray(hi, np.float64)
    blocks = np.ceil((hi - lo) / (8 * cell)).astype(int) + 1
    nodes = _sample(field, lo, cell, blocks)
    inside = nodes < 0
    corners = [(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    shape = np.array(nodes.shape) - 1
    count = sum(inside[c[0]:c[0] + shape[0], c[1]:c[1] + shape[1], c[2]:c[2] + shape[2]].astype(np.int8) for c in corners)
    cells = np.argwhere((count > 0) & (count < 8))
    value = np.stack([nodes[tuple((cells + c).T)] for c in corners], 1).astype(np.float64)
    total, crossings = np.zeros((len(cells), 3)), np.zeros(len(cells))
    for a in range(8):
        for b in range(a + 1, 8):
            if bin(a ^ b).count("1") != 1:
                continue
            cut = (value[:, a] < 0) != (value[:, b] < 0)
            t = np.where(cut, value[:, a] / np.where(cut, value[:, a] - value[:, b], 1), 0)[:, None]
            ca, cb = np.array(corners[a], float), np.array(corners[b], float)
            total += cut[:, None] * (ca + t * (cb - ca))
            crossings += cut
    points = lo + (cells + total / crossings[:, None]) * cell
    vertex_of_cell = np.full(tuple(shape), -1, np.int64)
    vertex_of_cell[tuple(cells.T)] = np.arange(len(cells))
    quads = np.concatenate([_quads(inside, vertex_of_cell, axis) for axis in range(3)])
    for _ in range(4):
        g = gradient(field, points, cell / 4)
        step = field(points)[:, None] * g / np.maximum((g * g).sum(1), 0.05)[:, None]
        length = np.linalg.norm(step, axis=1)[:, None]
        points -= step * np.minimum(1, 0.4 * cell / np.maximum(length, 1e-12))
    g = gradient(field, points, cell / 4)
    return points, g / np.linalg.norm(g, axis=1)[:, None], _triangles(points, quads)


def _quads(inside, vertex_of_cell, axis):
    """Returns a quad around each grid edge along `axis` that crosses the surface."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    a = np.take(inside, range(inside.shape[axis] - 1), axis)
    b = np.take(inside, range(1, inside.shape[axis]), axis)
    edges = np.argwhere(a != b)
    u_inside = (edges[:, u] > 0) & (edges[:, u] < vertex_of_cell.shape[u])
    v_inside = (edges[:, v] > 0) & (edges[:, v] < vertex_of_cell.shape[v])
    edges = edges[u_inside & v_inside]
    starts_inside = a[tuple(edges.T)]
    ring = []
    for du, dv in ((1, 1), (0, 1), (0, 0), (1, 0)):
        c = edges.copy()
        c[:, u] -= du
        c[:, v] -= dv
        ring.append(vertex_of_cell[tuple(c.T)])
    quads = np.stack(ring, 1)
    return np.where(starts_inside[:, None], quads, quads[:, ::-1])


def _triangles(points, quads):
    """Returns two triangles of each quad, divided along the shorter diagonal."""
    corner = points[quads]
    first = np.linalg.norm(corner[:, 0] - corner[:, 2], axis=1) <= np.linalg.norm(corner[:, 1] - corner[:, 3], axis=1)
    cut = np.where(first[:, None], quads, np.roll(quads, -1, axis=1))
    return np.concatenate([cut[:, [0, 1, 2]], cut[:, [0, 2, 3]]]).astype(np.int32)


def vertex_normals(points, triangles):
    """Returns vertex normals: area-weighted means of the face normals."""
    p = points[triangles]
    face = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    normals = np.zeros_like(points)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], face)
    return normals / np.linalg.norm(normals, axis=1)[:, None]
