"""Arrays of evaluated meshes, and their PLY files, which are named by their content."""
import hashlib
import os

import numpy as np

from .vertex_normals import vertex_normals


def values(collection, attribute, width, dtype=np.float32):
    """Returns an attribute of all items of a collection as an array with `width` columns."""
    found = np.empty(len(collection) * width, dtype)
    collection.foreach_get(attribute, found)
    return found.reshape(-1, width) if width > 1 else found


def positions(mesh):
    """Returns the positions of the vertices."""
    return values(mesh.vertices, "co", 3)


def _corner_normals(mesh):
    """Returns the normals of the corners of polygons."""
    if hasattr(mesh, "corner_normals"):
        return values(mesh.corner_normals, "vector", 3)
    mesh.calc_normals_split()
    return values(mesh.loops, "normal", 3)


def _merged(columns):
    """Returns (first, inverse) of the distinct rows of integer columns: row i equals row first[inverse[i]]."""
    mixed = np.zeros(len(columns[0]), np.uint64)
    for column in columns:
        mixed = (mixed ^ column.astype(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    _, first, inverse = np.unique(mixed, return_index=True, return_inverse=True)
    return first, inverse


class MeshData:
    """A mesh at its first key, split by material. Vertices of strobe have one normal and one texture coordinate, thus
    corners of Blender's polygons that differ in these become separate vertices."""

    def __init__(self, mesh):
        """Copies the arrays of an evaluated mesh."""
        mesh.calc_loop_triangles()
        self.count = len(mesh.vertices)
        self.corner_vertex = values(mesh.loops, "vertex_index", 1, np.int32)
        self.slots = values(mesh.loop_triangles, "material_index", 1, np.int32)
        self.used_slots = [int(s) for s in np.unique(self.slots)]
        self.normal_kind = self._kind_of_normals(mesh)
        self._merge(mesh, values(mesh.loop_triangles, "loops", 3, np.int32))
        self.points = positions(mesh)
        self.normals = self._normals(mesh)

    def _kind_of_normals(self, mesh):
        """Returns "corner", "vertex", or None for flat shading."""
        smooth = values(mesh.polygons, "use_smooth", 1, bool)
        custom = mesh.has_custom_normals or (getattr(mesh, "use_auto_smooth", False) and smooth.any())
        if custom or (smooth.any() and not smooth.all()):
            return "corner"
        return "vertex" if smooth.any() else None

    def _merge(self, mesh, triangles):
        """Makes the vertices of strobe from the corners of polygons."""
        layer = next((l for l in mesh.uv_layers if l.active_render), None)
        uv = values(layer.data, "uv", 2) if layer and len(layer.data) else None
        columns = [self.corner_vertex]
        if uv is not None:
            columns += [uv[:, 0].view(np.uint32), uv[:, 1].view(np.uint32)]
        if self.normal_kind == "corner":
            split = _corner_normals(mesh)
            columns += [np.round(split[:, i] * 1e4).astype(np.int64).view(np.uint64) for i in range(3)]
        if len(columns) == 1:
            self.corners, self.vertices, self.triangles, self.uv = None, None, self.corner_vertex[triangles], None
            return
        self.corners, inverse = _merged(columns)
        self.vertices = self.corner_vertex[self.corners]
        self.triangles = inverse[triangles].astype(np.int32)
        self.uv = uv[self.corners] if uv is not None else None

    def _normals(self, mesh):
        """Returns one normal per vertex of strobe, or None for flat shading."""
        if self.normal_kind == "corner":
            return _corner_normals(mesh)[self.corners]
        if self.normal_kind == "vertex":
            found = vertex_normals(mesh)
            return found if self.vertices is None else found[self.vertices]
        return None

    def key(self, mesh):
        """Returns (positions, normals) of the mesh at another time, or None if it has other vertices or corners."""
        if len(mesh.vertices) != self.count or len(mesh.loops) != len(self.corner_vertex):
            return None
        return positions(mesh), self._normals(mesh)

    def write(self, folder, slot, points=None, normals=None):
        """Writes the triangles of a material slot to a PLY file, if no file has this content. Returns its name."""
        points = self.points if points is None else points
        normals = self.normals if normals is None else normals
        triangles = self.triangles if len(self.used_slots) == 1 else self.triangles[self.slots == slot]
        chosen = None if self.vertices is None else self.vertices
        uv = self.uv
        if len(self.used_slots) > 1:
            used, inverse = np.unique(triangles, return_inverse=True)
            triangles = inverse.reshape(-1, 3).astype(np.int32)
            chosen = used if chosen is None else chosen[used]
            normals = normals[used] if normals is not None else None
            uv = uv[used] if uv is not None else None
        return write_ply(folder, points if chosen is None else points[chosen], normals, uv, triangles)


def write_ply(folder, points, normals, uv, triangles):
    """Writes a binary PLY file. Returns its name in the folder."""
    fields = [("xyz", points)] + ([("n", normals)] if normals is not None else []) + ([("uv", uv)] if uv is not None else [])
    names = ["x", "y", "z"] + (["nx", "ny", "nz"] if normals is not None else []) + (["u", "v"] if uv is not None else [])
    rows = np.concatenate([array for _, array in fields], 1).astype("<f4")
    faces = np.empty(len(triangles), [("n", "u1"), ("v", "<i4", 3)])
    faces["n"], faces["v"] = 3, triangles
    header = "ply\nformat binary_little_endian 1.0\n" + f"element vertex {len(points)}\n"
    header += "".join(f"property float {name}\n" for name in names)
    header += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    digest = hashlib.blake2b(header.encode(), digest_size=12)
    digest.update(rows)
    digest.update(faces.view(np.uint8))
    name = digest.hexdigest() + ".ply"
    path = os.path.join(folder, name)
    if not os.path.exists(path):
        with open(path + ".tmp", "wb") as file:
            file.write(header.encode())
            file.write(rows)
            file.write(faces.view(np.uint8))
        os.replace(path + ".tmp", path)
    return name
