"""Vertex normals of meshes.

Those of Blender are sums by several threads, whose last bits differ between runs. These have the same weights and always the
same bits, so that equal scenes give equal files and images.
"""
import numpy as np


def _values(collection, attribute, width, dtype=np.float32):
    """Returns an attribute of all items of a collection as an array with `width` columns."""
    found = np.empty(len(collection) * width, dtype)
    collection.foreach_get(attribute, found)
    return found.reshape(-1, width) if width > 1 else found


def _unit(vectors):
    """Returns vectors of length 1; zero vectors stay."""
    length = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    return vectors / np.where(length > 0, length, 1)[:, None]


def _neighbors(mesh):
    """Returns (polygon, next corner) of each corner, in the order of the corners."""
    start, total = (_values(mesh.polygons, name, 1, np.int32) for name in ("loop_start", "loop_total"))
    polygon = np.repeat(np.arange(len(start), dtype=np.int32), total)
    corner = np.arange(len(polygon), dtype=np.int32) + np.repeat(start - np.cumsum(total) + total, total).astype(np.int32)
    after = corner + 1
    last = corner == np.repeat(start + total - 1, total)
    after[last] = start[polygon[last]]
    if not np.array_equal(corner, np.arange(len(corner))):
        order = np.argsort(corner)
        polygon, after = polygon[order], after[order]
    return polygon, after


def vertex_normals(mesh):
    """Returns the normal of each vertex: the mean of the normals of its polygons, weighted by their angles."""
    points, vertex = _values(mesh.vertices, "co", 3), _values(mesh.loops, "vertex_index", 1, np.int32)
    polygon, after = _neighbors(mesh)
    edges = _unit(points[vertex[after]] - points[vertex])
    before = np.empty_like(after)
    before[after] = np.arange(len(after), dtype=np.int32)
    cosine = -np.einsum("ij,ij->i", edges, edges[before])
    weighted = _values(mesh.polygons, "normal", 3)[polygon] * np.arccos(np.clip(cosine, -1, 1))[:, None]
    sums = np.stack([np.bincount(vertex, weighted[:, i], len(points)) for i in range(3)], 1)
    loose = ~sums.any(1)
    sums[loose] = points[loose] + (0, 0, 1e-30)  # Blender takes the position of vertices without polygons
    return _unit(sums).astype(np.float32)
