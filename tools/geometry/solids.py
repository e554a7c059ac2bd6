"""Triangle meshes of simple solids with vertex normals: rounded boxes, lathes and sheets.

A mesh is (points, normals, triangles). Triangles are counterclockwise seen from outside.
"""

import numpy as np


def _grid_triangles(rows, columns):
    """Returns two triangles per cell of a grid of vertices, stored row by row."""
    i = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    first, second = np.stack([i, i + 1, i + columns + 1], 1), np.stack([i, i + columns + 1, i + columns], 1)
    return np.concatenate([first, second]).astype(np.int32)


def _unit(v):
    """Returns vectors scaled to unit length; zero vectors stay zero."""
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)


def merge(*meshes):
    """Returns one mesh with the triangles of all meshes."""
    first = np.cumsum([0] + [len(m[0]) for m in meshes])
    return (np.concatenate([m[0] for m in meshes]), np.concatenate([m[1] for m in meshes]),
            np.concatenate([m[2] + first[i] for i, m in enumerate(meshes)]).astype(np.int32))


def move(mesh, offset):
    """Returns a translated mesh."""
    return mesh[0] + np.asarray(offset, float), mesh[1], mesh[2]


def turn(mesh, degrees, axis):
    """Returns a mesh that is rotated about a coordinate axis (0, 1 or 2), counterclockwise seen from its tip."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    matrix = np.eye(3)
    u, v = (axis + 1) % 3, (axis + 2) % 3
    matrix[u, u], matrix[u, v], matrix[v, u], matrix[v, v] = c, -s, s, c
    return mesh[0] @ matrix.T, mesh[1] @ matrix.T, mesh[2]


def box(lo, hi, radius=0.004, steps=1):
    """Returns the box lo hi with edges rounded by `radius`, with 2 x `steps` facets per edge; flat faces if `steps` is 0."""
    lo, hi = np.asarray(lo, float), np.asarray(hi, float)
    half, center = (hi - lo) / 2, (hi + lo) / 2
    radius = min(radius, half.min()) if steps else 0
    inner = half - radius
    arc = np.tan(np.linspace(0, np.pi / 4, steps + 1)) if steps else np.zeros(1)
    faces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        lines = [np.concatenate([-inner[k] - radius * arc[::-1], inner[k] + radius * arc]) for k in (u, v)]
        for side in (1, -1):
            p = np.empty((len(lines[1]), len(lines[0]), 3))
            p[..., u], p[..., v] = np.meshgrid(*lines)
            p[..., axis] = side * half[axis]
            p = p.reshape(-1, 3)
            core = np.clip(p, -inner, inner)
            core[:, axis] = side * inner[axis]
            flat = np.zeros(3)
            flat[axis] = side
            n = _unit(p - core) if steps else np.broadcast_to(flat, p.shape)
            t = _grid_triangles(len(lines[1]), len(lines[0]))
            faces.append((center + core + radius * n, n, t if side > 0 else t[:, ::-1]))
    return merge(*faces)


def lathe(profile, segments=48, crease=35.0):
    """Returns the surface of revolution of `profile`, a polyline of (radius, z), about the z axis.

    The outside is right of the polyline. Corners of more than `crease` degrees stay sharp.
    """
    profile = np.asarray(profile, float)
    edge = _unit(np.diff(profile, axis=0))
    normal = np.stack([edge[:, 1], -edge[:, 0]], 1)
    smooth = (normal[1:] * normal[:-1]).sum(1) > np.cos(np.radians(crease))
    mean = _unit(normal[1:] + normal[:-1])
    begin = np.concatenate([normal[:1], np.where(smooth[:, None], mean, normal[1:])])
    end = np.concatenate([np.where(smooth[:, None], mean, normal[:-1]), normal[-1:]])
    phi = np.linspace(0, 2 * np.pi, segments + 1)
    ring = np.stack([np.cos(phi), np.sin(phi)], 1)
    parts = []
    for k in range(len(edge)):
        rows = ((profile[k], begin[k]), (profile[k + 1], end[k]))
        p = np.concatenate([np.column_stack([at[0] * ring, np.full(len(phi), at[1])]) for at, _ in rows])
        n = np.concatenate([np.column_stack([to[0] * ring, np.full(len(phi), to[1])]) for _, to in rows])
        t = _grid_triangles(2, len(phi))
        corner = p[t]
        area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
        parts.append((p, n, t[area > 1e-12]))  # no triangles without area at the axis
    return merge(*parts)


def rod(a, b, radius, segments=20):
    """Returns a cylinder along a coordinate axis between the points a and b."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    axis = int(np.argmax(np.abs(b - a)))
    length = abs((b - a)[axis])
    mesh = lathe([(0, 0), (radius, 0), (radius, length), (0, length)], segments)
    if axis != 2:
        mesh = turn(mesh, 90, 1) if axis == 0 else turn(mesh, -90, 0)
    return move(mesh, np.minimum(a, b))


def sheet(points):
    """Returns the grid of `points` [rows, columns, 3] as a smooth surface; its outside is that of columns x rows."""
    rows, columns, _ = points.shape
    n = _unit(np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0)))
    return points.reshape(-1, 3), n.reshape(-1, 3), _grid_triangles(rows, columns)
