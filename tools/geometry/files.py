"""Writers of PLY, OpenEXR and PNG files. They need only numpy and zlib."""

import os
import struct
import zlib

import numpy as np


def write_bytes(path, *contents):
    """Writes a temporary file and renames it, so that an interrupted run leaves no incomplete file."""
    temporary = f"{path}.part"
    with open(temporary, "wb") as out:
        for content in contents:
            out.write(content)
    os.replace(temporary, path)


def write_ply(path, points, normals, triangles):
    """Writes a binary little-endian PLY file with positions, normals and triangles."""
    header = f"""ply
format binary_little_endian 1.0
comment made by tools/make-geometry of strobe
element vertex {len(points)}
property float x
property float y
property float z
property float nx
property float ny
property float nz
element face {len(triangles)}
property list uchar int vertex_indices
end_header
"""
    vertices = np.concatenate([points, normals], axis=1).astype("<f4")
    faces = np.empty(len(triangles), dtype=[("n", "u1"), ("i", "<i4", 3)])
    faces["n"] = 3
    faces["i"] = triangles
    write_bytes(path, header.encode(), vertices.tobytes(), faces.tobytes())


def write_exr(path, rgb):
    """Writes an uncompressed scanline OpenEXR file of half floats; row 0 is the top."""
    height, width, _ = rgb.shape

    def attribute(name, kind, value):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value

    channels = b"".join(c + b"\0" + struct.pack("<iBxxxii", 1, 0, 1, 1) for c in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    header = struct.pack("<ii", 20000630, 2) + b"".join([
        attribute("channels", "chlist", channels), attribute("compression", "compression", b"\0"),
        attribute("dataWindow", "box2i", window), attribute("displayWindow", "box2i", window),
        attribute("lineOrder", "lineOrder", b"\0"), attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
        attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0)),
        attribute("screenWindowWidth", "float", struct.pack("<f", 1)), b"\0"])
    row = 3 * 2 * width
    first = len(header) + 8 * height
    offsets = (first + np.arange(height, dtype="<u8") * (8 + row)).astype("<u8")
    planes = rgb[:, :, ::-1].transpose(0, 2, 1).astype("<f2")  # each row: all B, all G, all R
    lines = b"".join(struct.pack("<ii", y, row) + planes[y].tobytes() for y in range(height))
    write_bytes(path, header, offsets.tobytes(), lines)


def write_png(path, rgb):
    """Writes an 8-bit PNG file of display values in [0,1]."""
    pixels = np.clip(np.round(rgb * 255), 0, 255).astype(np.uint8)
    height, width, _ = pixels.shape
    raw = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, -1)], axis=1).tobytes()

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    write_bytes(path, b"\x89PNG\r\n\x1a\n", chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
                chunk(b"IDAT", zlib.compress(raw, 9)), chunk(b"IEND", b""))
