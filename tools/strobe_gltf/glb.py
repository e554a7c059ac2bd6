"""Reads and writes .glb files, and changes the storage of their vertices and indices."""
import json
import struct

import numpy as np

TYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
STRIP = 5


def chunk(kind, data, padding):
    """Returns the bytes of a chunk, padded to a multiple of four."""
    data += padding * (-len(data) % 4)
    return struct.pack("<I4s", len(data), kind) + data


def pack(root, binary):
    """Returns the bytes of a .glb file. `root`: JSON as a dictionary or as bytes."""
    text = root if isinstance(root, bytes) else json.dumps(root).encode()
    chunks = chunk(b"JSON", text, b" ") + (chunk(b"BIN\0", bytes(binary), b"\0") if binary else b"")
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


class Glb:
    """A glTF document whose only buffer is the binary chunk."""

    def __init__(self, root=None, binary=b""):
        self.root = root or {"asset": {"version": "2.0"}}
        self.binary = bytearray(binary)

    @classmethod
    def load(cls, path):
        """Reads a .glb file."""
        with open(path, "rb") as file:
            data = file.read()
        size = struct.unpack_from("<I", data, 12)[0]
        length = struct.unpack_from("<I", data, 20 + size)[0]
        return cls(json.loads(data[20:20 + size]), data[28 + size:28 + size + length])

    def bytes(self):
        """Returns the bytes of the .glb file."""
        self.root["buffers"] = [{"byteLength": len(self.binary)}]
        return pack(self.root, self.binary)

    def save(self, path):
        """Writes the .glb file."""
        with open(path, "wb") as file:
            file.write(self.bytes())

    def add_view(self, data):
        """Adds a buffer view, aligned to four bytes. Returns its index."""
        self.binary += b"\0" * (-len(self.binary) % 4)
        views = self.root.setdefault("bufferViews", [])
        views.append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data
        return len(views) - 1

    def add(self, values, kind, **members):
        """Adds an accessor with the values and the component type of an array. Returns its index."""
        values = np.ascontiguousarray(values)
        code = next(c for c, t in TYPES.items() if t == values.dtype)
        accessors = self.root.setdefault("accessors", [])
        accessors.append({"bufferView": self.add_view(values.tobytes()), "componentType": code, "type": kind,
                          "count": values.size // COMPONENTS[kind], **members})
        return len(accessors) - 1

    def array(self, index):
        """Returns the elements of a tightly packed accessor as an array."""
        accessor = self.root["accessors"][index]
        view = self.root["bufferViews"][accessor["bufferView"]]
        offset = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        n = COMPONENTS[accessor["type"]]
        data = np.frombuffer(self.binary, TYPES[accessor["componentType"]], accessor["count"] * n, offset).copy()
        return data.reshape(-1, n) if n > 1 else data

    def primitives(self):
        """Returns the primitives of all meshes."""
        return [p for mesh in self.root.get("meshes", []) for p in mesh["primitives"]]


def strip_of(triangles):
    """Returns triangles as one strip. Neighbors continue it as long as possible; degenerate triangles connect the runs."""
    by_edge = {}
    for t, (a, b, c) in enumerate(triangles):
        for edge, opposite in (((a, b), c), ((b, c), a), ((c, a), b)):
            by_edge.setdefault(edge, []).append((t, opposite))
    done, strip = set(), []
    for t, corners in enumerate(triangles):
        if t in done:
            continue
        done.add(t)
        if strip:
            strip += [strip[-1], corners[0]]
            strip += [corners[0]] * (len(strip) % 2)  # keeps the orientation of the first triangle
        strip += list(corners)
        while True:
            b, c = strip[-2], strip[-1]
            edge = (c, b) if len(strip) % 2 else (b, c)
            neighbor = next((n for n in by_edge.get(edge, []) if n[0] not in done), None)
            if not neighbor:
                break
            done.add(neighbor[0])
            strip.append(neighbor[1])
    return strip


def to_strips(glb):
    """Replaces the triangles of all primitives by strips, with 8-bit indices where possible."""
    for primitive in glb.primitives():
        triangles = [tuple(int(i) for i in t) for t in glb.array(primitive["indices"]).reshape(-1, 3)]
        strip = strip_of(triangles)
        kind = np.uint8 if max(strip) < 255 else np.uint32
        primitive["indices"] = glb.add(np.array(strip, kind), "SCALAR")
        primitive["mode"] = STRIP


def to_sparse_targets(glb):
    """Stores the displacements of morph targets as sparse accessors."""
    for primitive in glb.primitives():
        for target in primitive.get("targets", []):
            for name, index in target.items():
                values = glb.array(index)
                moved = np.flatnonzero(np.any(values != 0, axis=1))
                if not len(moved):
                    continue
                indices = glb.add_view(moved.astype(np.uint16).tobytes())
                displacements = glb.add_view(np.ascontiguousarray(values[moved]).tobytes())
                accessors = glb.root["accessors"]
                accessors.append({"componentType": 5126, "type": "VEC3", "count": len(values),
                                  "sparse": {"count": len(moved), "indices": {"bufferView": indices, "componentType": 5123},
                                             "values": {"bufferView": displacements}}})
                for limit in ("min", "max"):
                    if limit in accessors[index]:
                        accessors[-1][limit] = accessors[index][limit]
                target[name] = len(accessors) - 1


def to_short_normals(glb):
    """Stores normals as 16-bit integers with a stride of eight bytes (KHR_mesh_quantization)."""
    for primitive in glb.primitives():
        values = np.zeros((len(glb.array(primitive["attributes"]["NORMAL"])), 4), np.int16)
        values[:, :3] = np.round(glb.array(primitive["attributes"]["NORMAL"]) * 32767)
        index = glb.add(values, "VEC4", normalized=True)
        accessor = glb.root["accessors"][index]
        accessor["type"] = "VEC3"
        glb.root["bufferViews"][accessor["bufferView"]]["byteStride"] = 8
        primitive["attributes"]["NORMAL"] = index
    for names in ("extensionsUsed", "extensionsRequired"):
        glb.root[names] = glb.root.get(names, []) + ["KHR_mesh_quantization"]


def to_anisotropic(glb):
    """Adds KHR_materials_anisotropy to the materials whose names end with their strength, as "brushed0 0.5"."""
    for material in glb.root["materials"]:
        if material["name"].startswith("brushed"):
            extensions = material.setdefault("extensions", {})
            extensions["KHR_materials_anisotropy"] = {"anisotropyStrength": float(material["name"].split()[-1])}
    used = glb.root.setdefault("extensionsUsed", [])
    if "KHR_materials_anisotropy" not in used:
        used.append("KHR_materials_anisotropy")
